"""What a run found out about the pose of one image, in a line for people."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from cityflow.handover.oriented import of_json
from cityflow.runs.poses_note import SettledPoses

if TYPE_CHECKING:
    from cityflow.io.catalog.stac_assets import Catalog


def lines_of_pose(found: SettledPoses, name: str, given: Catalog) -> Iterator[str]:
    """How the pose of an image was adjusted; nothing where it was not.

    Parameters
    ----------
    given : with the poses of before
    """
    rows = [i for i in (found.block or {}).get("images", ()) if i["name"] == name] if found.refined else []
    before = next((a.oriented for a in given.images if a.name == name), None)
    if not rows or before is None:
        return
    row, after = rows[0], of_json(rows[0])
    turn = (np.trace(after.rotation @ before.rotation.T) - 1) / 2
    angle, move = np.degrees(np.arccos(np.clip(turn, -1, 1))), np.linalg.norm(after.centre - before.centre)
    yield (
        f"pose refined: moved by {move * 100:.1f} cm and turned by {angle:.4f}° by {row['observations']} observations, exact to {row['sigma_px']:.2f} px "
        f"(orientation.json)"
    )

"""``orientation.json`` of a RUN: what was found out about the poses of its images, and adjusted poses where it uses them.

The note holds the poses themselves: no command needs the work of the adjustment, and a RUN can be moved.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from cityflow.errors import RunError
from cityflow.flow.store import Store

NOTE = "orientation.json"
VERSION = 1


@dataclass(frozen=True, slots=True)
class SettledPoses:
    """What was found out about the poses of a catalog.

    Attributes
    ----------
    of : digest of the images, their poses and the parameters that it was found of
    refined : whether the run uses adjusted poses
    sample : `RelativeError` of the given poses by a sample, and `images` that were looked at; None where nobody has looked
    summary, block : of the adjustment, as `handover.refined_block.encode_refinement` makes them; None where there was none
    left_out : images that could not be read and keep their poses
    problem : why poses could not be adjusted, though they should; empty where they could
    is_final : False where something failed that the next run tries again
    """

    of: str
    refined: bool
    sample: Mapping[str, Any] | None = None
    summary: Mapping[str, Any] | None = None
    block: Mapping[str, Any] | None = None
    left_out: Sequence[str] = field(default_factory=tuple)
    problem: str = ""
    is_final: bool = True
    version: int = VERSION


def read_note(store: Store) -> SettledPoses | None:
    """The note of a RUN; None where there is none, or a damaged one, which the next run makes again."""
    try:
        found = SettledPoses(**json.loads(store.read_bytes(NOTE)))
    except (OSError, ValueError, TypeError):
        return None
    return found if found.version == VERSION else None


def write_poses(store: Store, settled: SettledPoses) -> None:
    """Note what was found out.

    Raises
    ------
    RunError
        The RUN cannot be written.
    """
    try:
        store.write_bytes(NOTE, (json.dumps(asdict(settled), sort_keys=True, allow_nan=False) + "\n").encode(), durable=True)  # fmt: skip
    except OSError as error:
        remedy = "make room, or choose another --out"
        raise RunError(f"{NOTE} cannot be written ({error})", where=store.root, remedy=remedy) from error

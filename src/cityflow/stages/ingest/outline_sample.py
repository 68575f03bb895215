"""Sample of outlines for the accuracy of all given ones: some of those in the LiDAR file that contains most of them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from cityflow.core.grid import Bounds, grown
from cityflow.handover.outline_lines import Standing, lines
from cityflow.outlines.under_eaves.facades_inside import LARGEST_M, NEAR_M

SAMPLE = "sample.jsonl"
MOST = 400
"""So many outlines tell enough; set by hand."""


def sampled(standings: Sequence[Standing], files: Mapping[str, Bounds]) -> tuple[str, bytes]:
    """The file that most outlines stand in, and lines of some of these, by a hash of their names; empty where there is none."""
    inside = {name: [standings[k] for k in numbers] for name, numbers in _inside(standings, files).items()}
    name = min(inside, key=lambda n: (-len(inside[n]), n), default="")
    if not name or not inside[name]:
        return "", b""
    chosen = sorted(inside[name], key=lambda s: hashlib.sha256(s.outline.id.encode()).hexdigest())[:MOST]
    return name, lines(chosen)


def _inside(standings: Sequence[Standing], files: Mapping[str, Bounds]) -> dict[str, list[int]]:
    """Numbers of the outlines of usual size that lie in each file with their surroundings."""
    names, inside = sorted(files), {name: list[int]() for name in sorted(files)}
    if not names or not standings:
        return inside
    outer = np.array([files[name] for name in names], np.float64)
    inner = np.array([grown(s.outline.polygon.bounds, NEAR_M) for s in standings])
    usual = np.flatnonzero(np.max(inner[:, 2:] - inner[:, :2], axis=1) <= LARGEST_M)
    outline, file = shapely.STRtree(shapely.box(*outer.T)).query(shapely.box(*inner[usual].T))
    low, high = outer[file, :2] <= inner[usual[outline], :2], outer[file, 2:] >= inner[usual[outline], 2:]
    whole = low.all(axis=1) & high.all(axis=1)
    for k, number in sorted(zip(usual[outline[whole]].tolist(), file[whole].tolist(), strict=True)):
        inside[names[number]].append(k)
    return inside

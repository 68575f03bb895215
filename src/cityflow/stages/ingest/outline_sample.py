"""Sample of outlines for the accuracy of all given ones: some of those in the LiDAR file that contains most of them."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Bounds
from cityflow.outlines.under_eaves.facades_inside import LARGEST_M, NEAR_M

SAMPLE = "sample.jsonl"
MOST = 400
"""So many outlines tell enough; set by hand."""


def sampled(names: Sequence[str], bounds: FloatArray, files: Mapping[str, Bounds]) -> tuple[str, list[int]]:
    """The file that most outlines stand in, and numbers of some of these, by a hash of their names; none where there is no such file.

    Parameters
    ----------
    names, bounds : (N,) ids and (N, 4) boxes of outlines, metres
    files : LiDAR file → its bounds, metres
    """
    inside = _inside(bounds, files)
    file = min(inside, key=lambda n: (-len(inside[n]), n), default="")
    if not file or not len(inside[file]):
        return "", []
    chosen = sorted(inside[file].tolist(), key=lambda i: hashlib.sha256(names[i].encode()).hexdigest())[:MOST]
    return file, sorted(chosen)


def _inside(bounds: FloatArray, files: Mapping[str, Bounds]) -> dict[str, IntArray]:
    """Numbers of the outlines of usual size that lie in each file with their surroundings."""
    inner = bounds + NEAR_M * np.array([-1.0, -1.0, 1.0, 1.0])
    usual = np.flatnonzero(np.max(inner[:, 2:] - inner[:, :2], axis=1) <= LARGEST_M)
    tree = shapely.STRtree(shapely.box(*inner[usual].T))
    found = {}
    for name in sorted(files):
        over = usual[np.sort(tree.query(shapely.box(*files[name])))]
        low, high = np.array(files[name][:2]) <= inner[over, :2], np.array(files[name][2:]) >= inner[over, 2:]
        found[name] = over[low.all(axis=1) & high.all(axis=1)]
    return found

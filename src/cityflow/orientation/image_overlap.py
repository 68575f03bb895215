"""How much of an exposure its neighbours see again: forward along the flight, and sideways to the next strip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import FloatArray
from cityflow.core.local_frame import LocalFrame
from cityflow.orientation.views import View, footprints

NEAREST = 24
"""Exposures whose overlap with one is looked at; set by hand."""
SAME_PLACE = 0.02
"""Exposures nearer than this share of a footprint's size count as one; set by hand."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Overlaps of the images of a look direction.

    Attributes
    ----------
    direction : name of the look direction
    forward, side : (N,) share of each footprint that the best neighbour along, and across, the flight sees again; 0 where there is none
    """

    direction: str
    forward: FloatArray
    side: FloatArray


def overlaps(views: Sequence[View], frames: Sequence[LocalFrame]) -> tuple[Overlap, ...]:
    """Forward and side overlap by look direction; the nearest exposure that looks alike tells which way is forward."""
    ordered = sorted(views, key=lambda view: view.name)
    ground = np.array(footprints(ordered))
    number = {view.name: k for k, view in enumerate(ordered)}
    centres = np.array([view.image.centre[:2] for view in ordered]).reshape(-1, 2)
    result = []
    for frame in frames:
        members = np.array([number[name] for name in frame.images if name in number], np.int64)
        members = members[shapely.area(ground[members]) > 0]
        if len(members) > 1:
            forward, side = _forward_and_side(ground[members], centres[members])
            result.append(Overlap(frame.name, forward, side))
    return tuple(result)


def _forward_and_side(ground: FloatArray, centres: FloatArray) -> tuple[FloatArray, FloatArray]:
    area = shapely.area(ground)
    distance, near = cKDTree(centres).query(centres, min(NEAREST, len(centres)))
    apart = distance > SAME_PLACE * np.sqrt(np.median(area))
    step = centres[near] - centres[:, None, :]
    first = np.argmax(apart, axis=1)
    way = step[np.arange(len(step)), first]
    way = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
    along = np.abs(np.sum(step * way[:, None, :], axis=2)) >= np.sqrt(0.5) * distance
    share = shapely.area(shapely.intersection(ground[:, None], ground[near])) / area[:, None]
    return (
        np.where(apart & along, share, 0.0).max(axis=1),
        np.where(apart & ~along, share, 0.0).max(axis=1),
    )

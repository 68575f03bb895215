"""Faces over corners, which know their vertex in plan and their level there, become faces over vertex numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.reconstruction.solids.wall_merging import Corner

Place = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class CornerFace:
    """A face whose rings are corners: plan vertex and level."""

    rings: Sequence[Sequence[Corner]]
    semantic: Semantic
    plane: int = -1


def numbered(
    faces: Sequence[CornerFace], place: Callable[[Corner], Place], is_needed: Callable[[Corner, set[Corner]], bool]
) -> Polyhedron:
    """The faces, without the corners that are not needed: those within a straight edge.

    Parameters
    ----------
    place : world x, y, z of a corner, metres
    is_needed : asked of every corner, with those that an edge leads to
    """
    ends: dict[Corner, set[Corner]] = {}
    for ring in (ring for face in faces for ring in face.rings):
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            ends.setdefault(a, set()).add(b)
            ends.setdefault(b, set()).add(a)
    kept = [corner for corner in sorted(ends) if is_needed(corner, ends[corner])]
    index = {corner: k for k, corner in enumerate(kept)}
    made = tuple(
        Face(tuple(tuple(index[c] for c in ring if c in index) for ring in f.rings), f.semantic, f.plane) for f in faces
    )
    return Polyhedron(np.array([place(corner) for corner in kept]), made)


def leaves_line(place: Place, ends: Sequence[Place], near_m: float) -> bool:
    """Whether a place lies further than `near_m` off the line between two others."""
    here, a, b = (np.array(p) for p in (place, *ends))
    line = b - a
    return bool(np.linalg.norm(np.cross(here - a, line)) > near_m * np.linalg.norm(line))

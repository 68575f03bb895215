"""Edges of models that photographs show: where two faces meet at an angle, sampled along their length."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Face, Polyhedron, Semantic

LEAST_M = 0.8
"""Shorter edges are left out; set by hand, as are those below."""
LEAST_TURN_DEG = 15.0
"""Faces that meet at a smaller angle look alike."""
STEP_M, MOST_SAMPLES = 0.2, 1500
"""Samples along an edge, farther apart where there would be more than so many."""
AT_ENDS = 0.06
"""Share of an edge at each end that is left out: other edges meet there."""


@dataclass(frozen=True, slots=True, eq=False)
class EdgeSamples:
    """Points on the edges of models.

    Attributes
    ----------
    xyz : (S, 3) world metres;  along : (S, 3) unit vectors along the edge
    edge : (S,) number of the edge, 0 to E - 1
    normals : (E, 2, 3) outward unit normals of the faces that meet
    """

    xyz: FloatArray
    along: FloatArray
    edge: IntArray
    normals: FloatArray


def edge_samples(models: Sequence[Polyhedron]) -> EdgeSamples:
    """Of all models; edges at the ground, which plants hide, and at party walls are left out."""
    edges = [e for model in models for e in _edges(model)]
    if not edges:
        return EdgeSamples(np.empty((0, 3)), np.empty((0, 3)), np.empty(0, np.int64), np.empty((0, 2, 3)))
    start, end = (np.array([e[k] for e in edges]) for k in range(2))
    length = np.linalg.norm(end - start, axis=1)
    step = max(STEP_M, float(length.sum()) / MOST_SAMPLES)
    count = np.maximum((length * (1 - 2 * AT_ENDS) / step).astype(np.int64), 1)
    edge = np.repeat(np.arange(len(edges)), count)
    within = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    at = AT_ENDS + (1 - 2 * AT_ENDS) * (within + 0.5) / count[edge]
    xyz = start[edge] + at[:, None] * (end - start)[edge]
    return EdgeSamples(xyz, ((end - start) / length[:, None])[edge], edge, np.array([e[2] for e in edges]))


def _edges(model: Polyhedron) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Start, end, (2, 3) normals of both faces."""
    sides: dict[tuple[int, int], list[int]] = defaultdict(list)
    places, place = np.unique(np.round(model.vertices, 3), axis=0, return_inverse=True)
    for number, face in enumerate(model.faces):
        for corners in face.rings:
            ring = place[list(corners)].tolist()
            for one, other in zip(ring, (*ring[1:], ring[0]), strict=True):
                sides[min(one, other), max(one, other)].append(number)
    normals = [_normal(model, face) for face in model.faces]
    for (one, other), faces in sorted(sides.items()):
        start, end = places[one], places[other]
        if len(faces) != 2 or np.linalg.norm(end - start) < LEAST_M:
            continue
        met = [model.faces[k] for k in faces]
        if any(f.neighbour is not None or f.semantic is Semantic.GROUND for f in met):
            continue
        first, second = (normals[k] for k in faces)
        if first @ second < np.cos(np.radians(LEAST_TURN_DEG)):
            yield start, end, np.array([first, second])


def _normal(model: Polyhedron, face: Face) -> FloatArray:
    """Outward unit normal (Newell), zeros where the face encloses nothing."""
    ring = model.ring(face.rings[0])
    ring = ring - ring.mean(axis=0)
    vector = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))

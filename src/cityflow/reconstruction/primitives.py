"""A roof from primitives: straight cuts part the outline, each part is flat, a shed, a gable or a hip.

For few points: a plane of its own wants a dozen of them, a shape that follows the axes of the outline two or three and some that agree. All trees of
cuts and shapes are compared by one description length.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
import shapely
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import moved
from cityflow.reconstruction.partition.cut_lines import main_directions
from cityflow.reconstruction.planes.roof_cloud import local_origin
from cityflow.reconstruction.primitive_parts.cut_search import CutSearch, Part
from cityflow.reconstruction.primitive_parts.roof_of_parts import roof_of_parts
from cityflow.reconstruction.primitive_parts.shape_fits import BEYOND_M
from cityflow.reconstruction.solids.assemble import MIN_HEIGHT, assemble
from cityflow.reconstruction.solids.levels import block_levels

METHOD = "primitives"
ASKEW = math.radians(4.0)
"""Directions nearer to each other are one; set by hand."""
MOST_FRAMES = 2
"""Directions that are tried; bounds time."""


class PrimitivesParameters(Parameters):
    """What a roof of shapes is made from, and what its description costs."""

    sigma: float = Field(
        0.08, gt=0, le=1, description="how far points of one roof scatter across it (m): noise and unevenness"
    )
    number_nats: float = Field(
        3.0, gt=0, le=50, description="cost of each number of a shape (nats; a point off every roof costs 4.5)"
    )
    most_points: int = Field(600, ge=3, le=10_000, description="units of more points are left to the other methods")


def reconstruct(evidence: Evidence, parameters: PrimitivesParameters) -> Candidate:
    """The method. No solid, and why, where there are too few points or too many."""
    origin = local_origin(evidence)
    points = evidence.points.xyz - np.asarray(origin)
    points = points[np.all(np.isfinite(points), axis=1)]
    points = points[np.lexsort(points.T)]
    if not 1 <= len(points) <= parameters.most_points:
        return Candidate(
            METHOD,
            None,
            status=Status.FAILED,
            reason=f"{len(points)} points: the method takes 1 to {parameters.most_points}",
        )
    outline = moved(evidence.outline, -origin[0], -origin[1])
    floor = evidence.ground_height - origin[2]
    angle, tree = min(
        ((a, _tree(outline, points, a, floor, parameters)) for a in _frames(outline)), key=lambda found: found[1].cost
    )
    partition, segments = roof_of_parts(outline, points, angle, tree, origin, parameters.sigma)
    solid = assemble(partition, segments.coefficients, evidence.ground_height, origin, evidence.outline)
    faults = check_polyhedron(solid)
    if faults:
        return Candidate(METHOD, None, status=Status.FAILED, reason=f"{faults[0].code} {faults[0].name}")
    blocks = block_levels(partition, segments.coefficients, evidence.ground_height, origin, evidence.outline)
    notes = {"parts": sum(1 for _ in tree.leaves()), "nats": round(tree.cost, 2)}
    return Candidate(METHOD, solid, segments.roof_planes(), blocks, Status.DONE, "", notes, numbers=tree.numbers)


def simpler(full: PrimitivesParameters) -> Iterator[PrimitivesParameters]:
    """Parameters for roofs of fewer shapes."""
    for times in (2.0, 5.0):
        yield full.model_copy(update={"number_nats": min(full.number_nats * times, 50.0)})


def _frames(outline: Polygon) -> Iterator[float]:
    """Directions (radians) of the axes, most metres first; each with the one square to it."""
    kept: list[float] = []
    for angle in main_directions(outline):
        folded = angle % (math.pi / 2)
        if all(abs((folded - k + math.pi / 4) % (math.pi / 2) - math.pi / 4) > ASKEW for k in kept):
            kept.append(folded)
    return iter(kept[:MOST_FRAMES])


def _tree(outline: Polygon, points: FloatArray, angle: float, floor: float, parameters: PrimitivesParameters) -> Part:
    turn = turned(angle)
    ring = shapely.get_coordinates(outline.exterior)[:-1] @ turn
    z = np.ascontiguousarray(points[:, 2])
    limits = max(float(z.min()) - BEYOND_M, floor + MIN_HEIGHT), float(z.max()) + BEYOND_M
    search = CutSearch(
        np.ascontiguousarray(points[:, :2] @ turn),
        z,
        _own_lines(outline, turn),
        limits,
        parameters.sigma,
        parameters.number_nats,
    )
    return search.best(np.arange(len(points)), np.ascontiguousarray(ring))


def turned(angle: float) -> FloatArray:
    """(2, 2) matrix from xy to the frame whose first axis has this direction: uv = xy @ matrix."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _own_lines(outline: Polygon, turn: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where sides of the outline run across each axis."""
    found: tuple[list[float], list[float]] = ([], [])
    for ring in (outline.exterior, *outline.interiors):
        uv = shapely.get_coordinates(ring) @ turn
        for a, b in itertools.pairwise(uv):
            length = float(np.hypot(*(b - a)))
            for axis in (0, 1):
                if length >= 0.5 and abs(b[axis] - a[axis]) <= math.sin(ASKEW) * length:
                    found[axis].append(float((a[axis] + b[axis]) / 2))
    return _apart(found[0]), _apart(found[1])


def _apart(values: list[float]) -> FloatArray:
    kept: list[float] = []
    for value in sorted(values):
        if not kept or value - kept[-1] > 0.15:
            kept.append(value)
    return np.array(kept)

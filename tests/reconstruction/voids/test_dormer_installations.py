"""Dormers of a solid: a box on the slope of a gable, and what is none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.building import Installation, Polyhedron, Semantic
from cityflow.core.points import BUILDING, PointCloud
from cityflow.geometry.polyhedron import face_normals
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.partition.partition_values import RoofCell, RoofPartition
from cityflow.reconstruction.solids.assemble import assemble
from cityflow.reconstruction.voids.dormer_installations import find_dormers

ORIGIN = (1000.0, 2000.0, 0.0)
EAVE, SLOPE = 13.0, 0.7
PLAN = [(0.0, 0.0), (12.0, 0.0), (12.0, 8.0), (0.0, 8.0)]
RIDGE = [(0.0, 4.0), (12.0, 4.0)]


def on_gable(ring: Sequence[tuple[float, float]], top_m: float, slope: float = SLOPE) -> Polyhedron:
    """A gable, its ridge along x, with a level roof over a ring in its front."""
    corners = np.array([*PLAN, *RIDGE, *ring])
    box = tuple(range(6, 6 + len(ring)))
    cells = (RoofCell(((0, 1, 5, 4), box[::-1]), 0), RoofCell(((4, 5, 2, 3),), 1), RoofCell((box,), 2))
    planes = np.array([(0.0, slope, EAVE), (0.0, -slope, EAVE + 8 * slope), (0.0, 0.0, top_m)])
    outline = Polygon(np.asarray(PLAN) + ORIGIN[:2])
    solid = assemble(RoofPartition(corners, 4, cells), planes, 8.0, ORIGIN, outline)
    assert check_polyhedron(solid) == []
    return solid


def found(
    solid: Polyhedron, ring: Sequence[tuple[float, float]], top_m: float, count: int = 200
) -> tuple[Installation, ...]:
    (x_0, y_0), (x_1, y_1) = np.min(ring, axis=0), np.max(ring, axis=0)
    rng = np.random.default_rng(1)
    plan = np.column_stack([rng.uniform(x_0, x_1, count), rng.uniform(y_0, y_1, count)]) + ORIGIN[:2]
    points = PointCloud.of(np.column_stack([plan, top_m + rng.normal(0, 0.03, count)]), BUILDING)
    return find_dormers(solid, points)


TOP = EAVE + SLOPE * 3.5
BOX = [(5.0, 1.0), (7.0, 1.0), (7.0, 3.5), (5.0, 3.5)]


def test_a_dormer_is_its_roof_its_front_and_its_flanks() -> None:
    solid = on_gable(BOX, TOP)
    (one,) = found(solid, BOX, TOP)
    assert (one.kind, one.points) == ("dormer", 200)
    assert one.is_of_solid
    kinds = [f.semantic for f in one.surfaces.faces]
    assert (kinds.count(Semantic.ROOF), kinds.count(Semantic.WALL)) == (1, 3)
    low, high = one.surfaces.vertices.min(axis=0) - ORIGIN, one.surfaces.vertices.max(axis=0) - ORIGIN
    assert low == pytest.approx((5.0, 1.0, EAVE + SLOPE))
    assert high == pytest.approx((7.0, 3.5, TOP))
    middle = one.surfaces.vertices.mean(axis=0)
    for face, normal in zip(one.surfaces.faces, face_normals(one.surfaces), strict=True):
        assert normal @ (one.surfaces.ring(face.rings[0]).mean(axis=0) - middle) > 0


@pytest.mark.parametrize(
    ("ring", "top_m", "slope", "count"),
    [
        (BOX, TOP, SLOPE, 10),
        (BOX, EAVE + 2.2, 0.1, 200),
        ([(1.0, 1.0), (11.0, 1.0), (11.0, 3.5), (1.0, 3.5)], TOP, SLOPE, 200),
        ([(5.0, 1.0), (5.6, 1.0), (5.6, 1.6), (5.0, 1.6)], TOP + 1.0, SLOPE, 200),
        ([(5.0, 1.0), (7.0, 1.0), (7.0, 3.5), (5.0, 3.5)], EAVE + SLOPE, SLOPE, 200),
    ],
    ids=["too few points", "on a flat roof", "most of the roof", "a chimney", "a loggia"],
)
def test_what_is_no_dormer(ring: list[tuple[float, float]], top_m: float, slope: float, count: int) -> None:
    assert found(on_gable(ring, top_m, slope), ring, top_m, count) == ()


def test_a_plain_roof_has_none() -> None:
    corners = np.array([*PLAN, *RIDGE])
    cells = (RoofCell(((0, 1, 5, 4),), 0), RoofCell(((4, 5, 2, 3),), 1))
    planes = np.array([(0.0, SLOPE, EAVE), (0.0, -SLOPE, EAVE + 8 * SLOPE)])
    solid = assemble(RoofPartition(corners, 4, cells), planes, 8.0, ORIGIN, Polygon(np.asarray(PLAN) + ORIGIN[:2]))
    assert found(solid, BOX, TOP) == ()

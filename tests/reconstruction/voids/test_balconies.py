"""Balconies before the façade of a small building, and what is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Installation, Semantic
from cityflow.core.facade_points import joined_walls
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.polyhedron import face_normals
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.voids.with_voids import VoidParameters, with_voids
from storey_scenes import HEIGHT, ORIGIN, VOID, storeys

NOISE_M, TURN = 0.05, 0.3
WIDTH_M, DEPTH_M, RAIL_M, SLAB_M = 3.5, 1.4, 1.0, 0.2


def found_in(evidence: Evidence) -> tuple[Installation, ...]:
    """What is fixed to it; the solid stays as it is."""
    block = Candidate("block", extrude(evidence.outline, float(ORIGIN[2]), float(ORIGIN[2] + HEIGHT)))
    made = with_voids(block, evidence, VoidParameters())
    assert made.solid is block.solid
    return made.installations


def in_plan(xyz: FloatArray) -> FloatArray:
    """World points in the frame of the building: along its front, inwards, up."""
    turned = np.array([[np.cos(TURN), np.sin(TURN)], [-np.sin(TURN), np.cos(TURN)]])
    local = xyz - ORIGIN
    return np.column_stack([local[:, :2] @ turned.T, local[:, 2]])


def with_floor(evidence: Evidence) -> Evidence:
    """The floor of the balcony is seen from above."""
    rng = np.random.default_rng(5)
    turned = np.array([[np.cos(TURN), np.sin(TURN)], [-np.sin(TURN), np.cos(TURN)]])
    plan = np.column_stack([rng.uniform(4, 4 + WIDTH_M, 120), rng.uniform(-DEPTH_M, 0, 120)]) @ turned
    floor = np.column_stack([plan, VOID + rng.normal(0, NOISE_M, 120)]) + ORIGIN
    return replace(evidence, around=PointCloud.of(floor, BUILDING))


@pytest.mark.parametrize("seed", [1, 2])
def test_a_balcony_stands_where_it_is(seed: int) -> None:
    (one,) = found_in(with_floor(storeys("balcony", NOISE_M, seed)))
    assert one.kind == "balcony"
    assert one.points == pytest.approx(30 * WIDTH_M * (RAIL_M + SLAB_M), rel=0.1)
    low, high = (f(in_plan(one.surfaces.vertices), axis=0) for f in (np.min, np.max))
    assert low == pytest.approx([4, -DEPTH_M, VOID - SLAB_M], abs=0.12)
    assert high == pytest.approx([4 + WIDTH_M, 0, VOID + RAIL_M], abs=0.12)
    (floor,) = one.surfaces.of_semantic(Semantic.OUTER_FLOOR)
    assert one.surfaces.ring(floor.rings[0])[:, 2] - ORIGIN[2] == pytest.approx(np.full(4, VOID), abs=0.03)


def test_faces_are_seen_from_outside_and_say_how_many_points_show_them() -> None:
    (one,) = found_in(with_floor(storeys("balcony", NOISE_M, 1)))
    middle = one.surfaces.vertices.mean(axis=0)
    for face, normal in zip(one.surfaces.faces, face_normals(one.surfaces), strict=True):
        if face.semantic is Semantic.OUTER_FLOOR:
            assert normal[2] == pytest.approx(1.0)
        else:
            assert normal @ (one.surfaces.ring(face.rings[0]).mean(axis=0) - middle) > 0
        assert (face.points == 0) == (face.semantic is Semantic.OUTER_CEILING)


def test_a_floor_that_is_not_seen_is_not_made() -> None:
    (one,) = found_in(storeys("balcony", NOISE_M, 1))
    assert one.surfaces.of_semantic(Semantic.OUTER_FLOOR) == ()
    assert len(one.surfaces.faces) == 4


@pytest.mark.parametrize("kind", ["block", "bay"])
def test_a_building_without_a_balcony_has_none(kind: str) -> None:
    evidence = storeys(kind, NOISE_M, 1)
    block = Candidate("block", extrude(evidence.outline, float(ORIGIN[2]), float(ORIGIN[2] + HEIGHT)))
    assert with_voids(block, evidence, VoidParameters()).installations == ()


@pytest.mark.parametrize("away", ["above", "below"])
def test_where_the_facade_is_not_seen_above_and_below_it_is_none(away: str) -> None:
    """What stands so may be an eave, or a wall in the garden."""
    evidence = storeys("balcony", NOISE_M, 1)
    u, v, z = in_plan(evidence.walls.xyz).T
    beside = (v > -0.7) & (v < 0.7) & (u > 3.9) & (u < 4.1 + WIDTH_M)
    gone = beside & (z > VOID + RAIL_M if away == "above" else z < VOID - SLAB_M)
    assert found_in(replace(evidence, walls=joined_walls([evidence.walls.take(~gone)]))) == ()

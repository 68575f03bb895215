"""Voids and bodies of small buildings with known truth."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.core.building import Semantic
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.level_section import level_section
from cityflow.geometry.polyhedron import volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.reconstruction.voids import with_voids as whole
from cityflow.reconstruction.voids.with_voids import VoidParameters, with_voids
from storey_scenes import HEIGHT, LOGGIA, ORIGIN, VOID, VOLUME_M3, storeys

PARAMETERS = VoidParameters()
NOISE_M = 0.05


def _block(evidence: Evidence) -> Candidate:
    return Candidate("block", extrude(evidence.outline, float(ORIGIN[2]), float(ORIGIN[2] + HEIGHT)))


@pytest.mark.parametrize("kind", ["arcade", "passage", "loggia", "bay"])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_hull_is_that_of_the_truth(kind: str, seed: int) -> None:
    evidence = storeys(kind, NOISE_M, seed)
    made = with_voids(_block(evidence), evidence, PARAMETERS)
    assert made.solid is not None
    assert check_polyhedron(made.solid) == []
    assert volume(made.solid) == pytest.approx(VOLUME_M3[kind], rel=0.01)
    assert (made.notes["voids"], made.notes["bodies"]) == ((0, 1) if kind == "bay" else (1, 0))


@pytest.mark.parametrize(("kind", "high", "area"), [("arcade", VOID, 30.0), ("loggia", VOID + LOGGIA, 5.6)])
def test_walls_and_undersides_stand_where_they_are(kind: str, high: float, area: float) -> None:
    evidence = storeys(kind, NOISE_M, 3)
    solid = with_voids(_block(evidence), evidence, PARAMETERS).solid
    assert solid is not None
    ceilings = [solid.ring(f.rings[0])[:, 2] - ORIGIN[2] for f in solid.of_semantic(Semantic.OUTER_CEILING)]
    assert len(ceilings) == 1
    assert np.abs(ceilings[0] - high).max() < 0.15
    section = level_section(solid, ORIGIN[2] + high - 1.0)
    assert evidence.outline.area - section.area == pytest.approx(area, rel=0.04)


def test_faces_say_how_many_points_show_them() -> None:
    evidence = storeys("arcade", NOISE_M, 3)
    solid = with_voids(_block(evidence), evidence, PARAMETERS).solid
    assert solid is not None
    (ceiling,) = solid.of_semantic(Semantic.OUTER_CEILING)
    assert ceiling.points == 0
    (back,) = (f for f in solid.of_semantic(Semantic.WALL) if f.points is not None)
    assert back.points is not None
    assert back.points == pytest.approx(30 * 12 * (VOID - 0.1), rel=0.1)
    assert all(f.points is None for f in solid.of_semantic(Semantic.ROOF))


def test_a_block_stays_as_it_is() -> None:
    evidence = storeys("block", NOISE_M, 1)
    best = _block(evidence)
    assert with_voids(best, evidence, PARAMETERS) is best


@pytest.mark.parametrize("kind", ["arcade", "bay"])
def test_without_points_of_facades_nothing_is_made(kind: str) -> None:
    evidence = storeys(kind, NOISE_M, 1, walls=False)
    best = _block(evidence)
    assert with_voids(best, evidence, PARAMETERS) is best


def test_a_facade_out_of_sight_is_no_void() -> None:
    """The lower part of a façade that no image shows, with nothing seen behind it."""
    evidence = storeys("block", NOISE_M, 1)
    local = shapely.distance(evidence.outline.exterior, shapely.points(evidence.walls.xyz[:, :2])) < 1.0
    low = local & (evidence.walls.xyz[:, 2] < ORIGIN[2] + 3.0)
    unseen = Evidence(
        "unit", evidence.outline, evidence.points, evidence.ground_height, walls=evidence.walls.take(~low)
    )
    best = _block(unseen)
    assert with_voids(best, unseen, PARAMETERS) is best


def test_ground_that_runs_through_shows_a_void() -> None:
    """The wall behind an arcade is not seen, but the ground under it is."""
    evidence = storeys("arcade", NOISE_M, 1)
    deep = shapely.distance(evidence.outline.exterior, shapely.points(evidence.walls.xyz[:, :2])) > 1.0
    rng = np.random.default_rng(1)
    turned = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    plan = np.column_stack([rng.uniform(0, 12, 600), rng.uniform(0, 2.5, 600)]) @ turned
    covered = np.column_stack([plan, rng.normal(0, NOISE_M, 600)]) + ORIGIN
    walls = joined_walls([evidence.walls.take(~deep)])
    seen = Evidence("unit", evidence.outline, evidence.points, evidence.ground_height, walls=walls, covered=covered)
    made = with_voids(_block(seen), seen, PARAMETERS)
    assert made.solid is not None
    assert volume(made.solid) < VOLUME_M3["block"] - 0.5 * (VOLUME_M3["block"] - VOLUME_M3["arcade"])


def test_posts_stand_in_no_voids_way() -> None:
    """Fronts of posts of 0.5 m at the outer edge of an arcade."""
    evidence = storeys("arcade", NOISE_M, 1)
    rng = np.random.default_rng(2)
    turned = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    u = np.concatenate([rng.uniform(at, at + 0.5, 60) for at in (0.0, 3.9, 7.7, 11.5)])
    xyz = np.column_stack([np.column_stack([u, np.zeros(240)]) @ turned, rng.uniform(0, VOID, 240)]) + ORIGIN
    normal = np.tile(np.array([0.0, -1.0]) @ turned, (240, 1)).astype(np.float32)
    posts = WallPoints(xyz, normal, np.full(240, NOISE_M, np.float32), np.full(240, 3, np.uint8))
    seen = Evidence(
        "unit", evidence.outline, evidence.points, evidence.ground_height, walls=joined_walls([evidence.walls, posts])
    )
    made = with_voids(_block(seen), seen, PARAMETERS)
    assert made.solid is not None
    assert volume(made.solid) == pytest.approx(VOLUME_M3["arcade"], rel=0.01)


def test_the_model_is_kept_where_a_void_leaves_it_invalid(monkeypatch: pytest.MonkeyPatch) -> None:
    evidence = storeys("arcade", NOISE_M, 1)
    best = _block(evidence)
    monkeypatch.setattr(whole, "check_polyhedron", lambda _: ["a fault"])
    made = with_voids(best, evidence, PARAMETERS)
    assert made.solid is best.solid
    assert made.notes["void_reason"] == "1 of 1 voids and bodies gave no valid solid and are left out"


def test_a_model_has_its_voids_unless_they_are_not_asked_for() -> None:
    evidence = storeys("passage", NOISE_M, 1)
    found = model(evidence, ModelParameters(methods=("orientation_histogram",))).candidate
    assert found.solid is not None
    assert volume(found.solid) == pytest.approx(VOLUME_M3["passage"], rel=0.01)
    plain = ModelParameters(methods=("orientation_histogram",), voids=VoidParameters(search=False))
    without = model(evidence, plain).candidate
    assert without.solid is not None
    assert volume(without.solid) == pytest.approx(VOLUME_M3["block"], rel=0.01)

from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from cityflow.core.building import Lod, Semantic, Status
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.faults import Fault
from cityflow.geometry.polyhedron import volume
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.volumetric import VolumetricParameters, reconstruct, simpler
from cityflow.reconstruction.volumetric_parts.nodes import NodeParameters
from roof_scenes import ORIGIN, OUTLINE, SCENES, Height, gable, scan
from storey_scenes import HEIGHT, VOID, VOLUME_M3, storeys

DEFAULT = VolumetricParameters()
FAR = np.array(ORIGIN)


def within(evidence: Evidence, height: Height, limit: float) -> float:
    """Share of the outline where the hull's roof is within `limit` of the truth."""
    candidate = reconstruct(evidence, DEFAULT)
    assert candidate.solid is not None
    assert check_polyhedron(candidate.solid) == []
    x0, y0, x1, y1 = evidence.outline.bounds
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x0 + 0.1, x1, 0.23), np.arange(y0 + 0.1, y1, 0.23)))
    inside = shapely.contains_xy(evidence.outline, x, y)
    x, y = x[inside], y[inside]
    truth = np.stack([x, y, height(x - FAR[0], y - FAR[1]) + FAR[2]], 1)
    return float(np.mean(np.abs(distances_to_roof(candidate.solid, truth)) < limit))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(("density", "noise"), [(6.0, 0.02), (20.0, 0.08), (100.0, 0.15)])
def test_roofs_meet_the_truth(name: str, density: float, noise: float) -> None:
    height, planes = SCENES[name]
    evidence = scan(height, OUTLINE, density, noise, 11)
    # At these densities and noises the dormer of 1.8 by 1.6 m is not more than a few points across.
    assert within(evidence, height, 0.15) > (0.97 if density > 6 else 0.95)
    assert reconstruct(evidence, DEFAULT).notes["surfaces"] == planes


@pytest.mark.parametrize("kind", ["block", "set-back", "arcade", "passage"])
@pytest.mark.parametrize("noise", [0.02, 0.1])
def test_set_backs_and_voids(kind: str, noise: float) -> None:
    candidate = reconstruct(storeys(kind, noise, 5), DEFAULT)
    assert candidate.solid is not None
    assert candidate.status is Status.DONE
    assert check_polyhedron(candidate.solid) == []
    assert volume(candidate.solid) == pytest.approx(VOLUME_M3[kind], rel=0.005)
    undersides = candidate.solid.of_semantic(Semantic.OUTER_CEILING)
    assert len(undersides) == (kind in ("arcade", "passage"))
    for face in undersides:
        z = candidate.solid.ring(face.rings[0])[:, 2] - FAR[2]
        assert np.ptp(z) == 0
        assert z[0] == pytest.approx(VOID, abs=0.15)


def test_unseen_walls_close_the_hull_down_to_the_ground() -> None:
    candidate = reconstruct(storeys("arcade", 0.05, 3, walls=False), DEFAULT)
    assert candidate.solid is not None
    assert volume(candidate.solid) == pytest.approx(96 * HEIGHT, rel=0.005)


def test_a_wall_that_rises_from_a_roof_stands_where_it_is_seen() -> None:
    candidate = reconstruct(storeys("set-back", 0.05, 4, turn=0.0), DEFAULT)
    assert candidate.solid is not None
    xyz = candidate.solid.vertices - FAR
    middle = xyz[(xyz[:, 1] > 0.5) & (xyz[:, 1] < 7.5)]
    assert len(middle) == 4
    assert np.abs(middle[:, 1] - 3.0).max() < 0.03


def test_a_step_is_found_without_its_wall() -> None:
    candidate = reconstruct(storeys("set-back", 0.05, 4, turn=0.0, walls=False), DEFAULT)
    assert candidate.solid is not None
    assert volume(candidate.solid) == pytest.approx(VOLUME_M3["set-back"], rel=0.01)


def test_outline_is_taken_over_bit_for_bit() -> None:
    evidence = storeys("set-back", 0.08, 1)
    candidate = reconstruct(evidence, DEFAULT)
    assert candidate.solid is not None
    ground = candidate.solid.of_semantic(Semantic.GROUND)
    assert len(ground) == 1
    ring = {tuple(p) for p in candidate.solid.ring(ground[0].rings[0])[:, :2].tolist()}
    assert ring >= {tuple(p) for p in shapely.get_coordinates(evidence.outline).tolist()}
    assert set(candidate.solid.ring(ground[0].rings[0])[:, 2].tolist()) == {evidence.ground_height}


def test_missing_part_is_filled_by_the_planes_around() -> None:
    evidence = scan(gable, OUTLINE, 20.0, 0.05, 3)
    x, y = (evidence.points.xyz - FAR)[:, :2].T
    hidden = (x > 4) & (x < 8) & (y < 6)
    part = Evidence("u", evidence.outline, evidence.points.take(~hidden), evidence.ground_height)
    assert within(part, gable, 0.15) > 0.97


@pytest.mark.parametrize("count", [0, 3, 10])
def test_few_points_give_a_valid_solid_or_a_reason(count: int) -> None:
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 2)
    few = Evidence("u", evidence.outline, evidence.points.take(np.arange(count)), 2.0)
    candidate = reconstruct(few, DEFAULT)
    if candidate.solid is None:
        assert str(count) in candidate.reason
    else:
        assert check_polyhedron(candidate.solid) == []


def test_points_on_a_line_give_a_reason() -> None:
    t = np.linspace(0, 12, 300)
    points = PointCloud.of(np.column_stack([t, 4 + 0 * t, 8 + 0 * t]) + FAR, BUILDING)
    candidate = reconstruct(Evidence("u", scan(gable, OUTLINE, 8, 0, 0).outline, points, 2.0), DEFAULT)
    assert candidate.solid is None or check_polyhedron(candidate.solid) == []
    assert candidate.solid is not None or candidate.reason


def test_a_tower_of_two_hundred_metres() -> None:
    rng = np.random.default_rng(2)
    x, y = rng.uniform(0, 30, (2, 20_000))
    tower = (x > 8) & (x < 20) & (y > 8) & (y < 22)
    z = np.where(tower, 200.0, 12.0) + rng.normal(0, 0.05, len(x))
    outline = Polygon(np.asarray(box(0, 0, 30, 30).exterior.coords)[:-1] + ORIGIN[:2])
    evidence = Evidence("u", outline, PointCloud.of(np.stack([x, y, z], 1) + FAR, BUILDING), 2.0)
    candidate = reconstruct(evidence, DEFAULT)
    assert candidate.solid is not None
    assert check_polyhedron(candidate.solid) == []
    assert volume(candidate.solid) == pytest.approx(900 * 12 + 168 * 188, rel=0.005)


def test_blocks_come_along() -> None:
    candidate = reconstruct(storeys("set-back", 0.05, 1), DEFAULT)
    assert set(candidate.blocks) == {Lod.LOD12, Lod.LOD13}
    assert all(check_polyhedron(solid) == [] for solid in candidate.blocks.values())
    assert volume(candidate.blocks[Lod.LOD13]) == pytest.approx(VOLUME_M3["set-back"], rel=0.01)


def test_order_of_points_does_not_matter() -> None:
    evidence = storeys("arcade", 0.05, 2)
    order = np.random.default_rng(0).permutation(len(evidence.points))
    other = Evidence(evidence.id, evidence.outline, evidence.points.take(order), 2.0, walls=evidence.walls)
    one, two = reconstruct(evidence, DEFAULT), reconstruct(other, DEFAULT)
    assert one.solid is not None
    assert two.solid is not None
    assert one.solid.faces == two.solid.faces
    assert np.abs(one.solid.vertices - two.solid.vertices).max() < 2e-4


def many_slopes(seed: int) -> Evidence:
    """36 squares of 6 m, each with a slope of 17 to 31° in a direction of its own, up to 16 m apart in height."""
    rng = np.random.default_rng(seed)
    parts = []
    for k in range(36):
        x, y = rng.uniform(0, 6, (2, 400))
        towards, rise = np.radians(k * 130.0), 0.3 + 0.05 * (k % 7)
        slope = rise * ((x - 3) * np.cos(towards) + (y - 3) * np.sin(towards))
        z = 6 + 0.45 * ((k * 7) % 36) + slope + rng.normal(0, 0.03, 400)
        parts.append(np.column_stack([x + k % 6 * 6, y + k // 6 * 6, z]))
    outline = Polygon(np.asarray(box(0, 0, 36, 36).exterior.coords)[:-1] + ORIGIN[:2])
    return Evidence("u", outline, PointCloud.of(np.concatenate(parts) + FAR, BUILDING), 2.0)


def test_many_sloping_surfaces_take_no_minutes() -> None:
    evidence = many_slopes(1)
    reconstruct(evidence, DEFAULT)
    start = time.process_time()
    candidate = reconstruct(evidence, DEFAULT)
    assert time.process_time() - start < 2.0
    assert candidate.notes["surfaces"] == 36
    assert candidate.notes["triplets_left_out"] == 0
    assert candidate.solid is not None
    assert check_polyhedron(candidate.solid) == []


def test_triplets_beyond_the_limit_are_noted() -> None:
    evidence = many_slopes(2)
    wide, few = (DEFAULT.model_copy(update={"nodes": NodeParameters(cell=4, max_triplets=n)}) for n in (200_000, 100))
    whole, cut = reconstruct(evidence, wide).notes, reconstruct(evidence, few).notes
    assert whole["triplets_left_out"] == 0
    assert int(cut["triplets_left_out"] or 0) == int(whole["triplets"] or 0) - int(cut["triplets"] or 0) > 0


def test_simpler_parameters_give_simpler_hulls() -> None:
    evidence = scan(SCENES["dormer"][0], OUTLINE, 20.0, 0.05, 11)
    counts = [reconstruct(evidence, p).notes["surfaces"] for p in (DEFAULT, *simpler(DEFAULT))]
    assert counts == [3, 2, 2]
    arcade = [reconstruct(storeys("arcade", 0.05, 1), p).notes["voids"] for p in (DEFAULT, *simpler(DEFAULT))]
    assert arcade == [1, 0, 0]


def test_a_hull_that_stays_invalid_is_no_hull(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cityflow.reconstruction.volumetric.check_polyhedron", lambda _: [Fault.of(302)])
    candidate = reconstruct(scan(gable, OUTLINE, 10.0, 0.03, 1), DEFAULT)
    assert candidate.solid is None
    assert candidate.status is Status.FAILED
    assert "302" in candidate.reason

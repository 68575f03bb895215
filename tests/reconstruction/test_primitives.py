from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.building import Semantic
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import distances_to_roof, summarise
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.primitives import PrimitivesParameters, reconstruct
from roof_scenes import OUTLINE, SCENES, Height, scan

DEFAULT = PrimitivesParameters()
ANGLED = Polygon([(0, 0), (12, 0), (12, 12), (7, 12), (7, 8), (0, 8)])
"""A house of 12 × 8 m with an annex of 5 × 4 m behind it."""


def with_annex(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.where(y < 8, SCENES["gable"][0](x, y), 2.8)


def inside(evidence: Evidence, outline: Polygon) -> Evidence:
    """Without the points of the bounding box that the outline does not hold."""
    at = evidence.points.xyz[:, :2] - np.asarray(evidence.outline.bounds[:2])
    kept = (at[:, 1] < 8) | (at[:, 0] > 7) if outline is ANGLED else np.ones(len(at), bool)
    return replace(evidence, points=evidence.points.take(np.flatnonzero(kept)))


def met(height: Height, outline: Polygon, density: float, seed: int, noise: float = 0.03) -> tuple[float, int]:
    """Share of the true roof within 20 cm of the model from few points, and its number of roof faces."""
    solid = reconstruct(inside(scan(height, outline, density, noise, seed), outline), DEFAULT).solid
    assert solid is not None
    assert not check_polyhedron(solid)
    dense = inside(scan(height, outline, 30.0, 0.0, seed + 100), outline)
    share = summarise(distances_to_roof(solid, dense.points.xyz)).within_20cm
    return share, len(solid.of_semantic(Semantic.ROOF))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("name", "density"), [("gable", 0.12), ("hip", 0.25), ("two levels", 0.25)])
def test_a_dozen_points_tell_a_shape(name: str, density: float, seed: int) -> None:
    share, faces = met(SCENES[name][0], OUTLINE, density, seed)
    assert share > 0.85
    assert faces == SCENES[name][1]


@pytest.mark.parametrize("seed", range(4))
def test_an_annex_is_cut_off_along_the_outline(seed: int) -> None:
    share, faces = met(with_annex, ANGLED, 0.4, seed)
    assert share > 0.98
    assert faces == 3


def with_stair_house(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.where((x > 4) & (x < 7) & (y > 2.5) & (y < 6), 7.5, 5.0)


@pytest.mark.parametrize("seed", range(4))
def test_a_stair_house_in_the_middle_is_a_box_and_parts_nothing_else(seed: int) -> None:
    share, faces = met(with_stair_house, OUTLINE, 0.8, seed)
    assert share > 0.9
    assert faces == 2


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("density", [0.1, 0.5, 2.0])
def test_a_rough_level_roof_is_one_face(density: float, seed: int) -> None:
    assert met(lambda x, y: 5.0 + 0.0 * x, OUTLINE, density, seed, noise=0.08) == (1.0, 1)


@pytest.mark.parametrize("seed", range(4))
def test_what_stands_on_a_roof_makes_no_part(seed: int) -> None:
    evidence = scan(SCENES["gable"][0], OUTLINE, 0.7, 0.03, seed)
    xyz = evidence.points.xyz.copy()
    rng = np.random.default_rng([seed, 7])
    loose = rng.random(len(xyz)) < 0.1
    xyz[loose, 2] += rng.uniform(0.5, 3.0, int(loose.sum()))
    solid = reconstruct(replace(evidence, points=replace(evidence.points, xyz=xyz)), DEFAULT).solid
    assert solid is not None
    assert len(solid.of_semantic(Semantic.ROOF)) == 2


def test_the_order_of_the_points_is_of_no_matter() -> None:
    evidence = inside(scan(with_annex, ANGLED, 0.7, 0.03, 1), ANGLED)
    shuffled = evidence.points.take(np.random.default_rng(0).permutation(len(evidence.points)))
    first, other = reconstruct(evidence, DEFAULT).solid, reconstruct(replace(evidence, points=shuffled), DEFAULT).solid
    assert first is not None
    assert other is not None
    assert np.array_equal(first.vertices, other.vertices)


def test_many_points_are_left_to_others() -> None:
    candidate = reconstruct(scan(SCENES["gable"][0], OUTLINE, 8.0, 0.03, 1), DEFAULT)
    assert candidate.solid is None
    assert "768 points" in candidate.reason

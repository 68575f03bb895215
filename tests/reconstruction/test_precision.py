"""What a model says of its own precision, against what is known of the roof."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapely import box

from cityflow.core.building import RoofPlane
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.precision import _has_near, with_precision

OUTLINE = box(0, 0, 24, 18)
TOP = 8.0


def _roof(errors: np.ndarray, xy: np.ndarray) -> tuple[Candidate, Evidence]:
    """A level roof whose plane stands where the points say, on average."""
    points = PointCloud.of(np.column_stack([xy, TOP + errors]), BUILDING)
    found = float(np.round(TOP + errors.mean(), 4))
    solid = extrude(OUTLINE, 0.0, found)
    plane = RoofPlane(0.0, 0.0, found, (0.0, 0.0))
    faces = tuple(replace(f, plane=0 if f.plane >= 0 or f.semantic.value == "RoofSurface" else -1) for f in solid.faces)
    return Candidate("made", replace(solid, faces=faces), (plane,)), Evidence("u", OUTLINE, points, 0.0)


def _everywhere(rng: np.random.Generator, n: int = 4000) -> np.ndarray:
    return np.column_stack([rng.uniform(0, 24, n), rng.uniform(0, 18, n)])


def _waves(xy: np.ndarray, rng: np.random.Generator, sigma: float, reach_m: float) -> np.ndarray:
    """Errors that are alike over squares of some extent, as those of matching are."""
    cell = np.floor(xy / reach_m).astype(int)
    field = rng.normal(0, sigma, (60, 60))
    return np.asarray(field[cell[:, 0], cell[:, 1]])


def test_the_height_of_a_plane_is_as_sure_as_it_says_though_errors_are_alike() -> None:
    """Over many made roofs the true error of the mean height, in units of the standard deviation said, is about one."""
    for alike in (False, True):
        ratios = []
        for seed in range(40):
            rng = np.random.default_rng(seed)
            xy = _everywhere(rng)
            errors = _waves(xy, rng, 0.1, 1.5) if alike else rng.normal(0, 0.1, len(xy))
            plane = with_precision(*_roof(errors, xy)).planes[0]
            ratios.append((plane.height - TOP) / plane.sigma_height)
        assert 0.6 < float(np.sqrt(np.mean(np.square(ratios)))) < 1.5


def test_alike_errors_make_a_plane_less_sure_than_as_many_independent_ones() -> None:
    rng = np.random.default_rng(3)
    xy = _everywhere(rng)
    alone = with_precision(*_roof(rng.normal(0, 0.1, len(xy)), xy)).planes[0]
    alike = with_precision(*_roof(_waves(xy, rng, 0.1, 2.0), xy)).planes[0]
    assert alike.sigma_height > 3 * alone.sigma_height
    assert alike.sigma_slope_deg > 3 * alone.sigma_slope_deg
    assert (alone.points, alone.seen) == (4000, 1.0)
    assert alone.rmse == pytest.approx(0.1, rel=0.1)


def test_an_extended_plane_says_how_much_of_it_was_seen_and_claims_less() -> None:
    rng = np.random.default_rng(4)
    xy = _everywhere(rng)
    half = xy[xy[:, 0] < 12]
    whole, part = (with_precision(*_roof(rng.normal(0, 0.03, len(p)), p)) for p in (xy, half))
    assert part.planes[0].seen == pytest.approx(0.53, abs=0.04)
    assert float(str(whole.notes["claimed_rmse_m"])) < 0.03
    assert float(str(part.notes["claimed_rmse_m"])) > 0.1


def test_a_model_that_misses_its_points_does_not_claim_to_be_right() -> None:
    rng = np.random.default_rng(5)
    xy = _everywhere(rng)
    candidate, evidence = _roof(0.1 * np.abs(xy[:, 1] - 9) + rng.normal(0, 0.03, len(xy)), xy)
    assert float(str(with_precision(candidate, evidence).notes["claimed_rmse_m"])) > 0.2


def test_without_points_or_solid_nothing_is_said() -> None:
    candidate, evidence = _roof(np.zeros(10), _everywhere(np.random.default_rng(6), 10))
    none = replace(evidence, points=PointCloud.empty())
    assert with_precision(candidate, none) is candidate
    few = with_precision(candidate, evidence).planes[0]
    assert few.points == 10
    assert math.isfinite(few.rmse)


@pytest.mark.parametrize("near", [0.3, 0.75, 3.0])
def test_places_with_a_point_near_them_are_those_of_a_tree(near: float) -> None:
    rng = np.random.default_rng(int(100 * near))
    xyz = rng.uniform((85_000, 447_000, 0), (85_030, 447_020, 9), (60, 3))
    places = np.concatenate([rng.uniform((84_998, 446_998), (85_032, 447_022), (500, 2)), xyz[:3, :2] + (near, 0.0)])
    assert np.array_equal(_has_near(places, xyz, near), cKDTree(xyz[:, :2]).query(places)[0] <= near)
    assert len(_has_near(places[:0], xyz, near)) == 0

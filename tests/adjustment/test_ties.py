"""From two pictures of a textured ground to matches that lie on each other, and to tracks."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from adjustment.scenes import rendered_ground
from cityflow.adjustment.block import rotation_of
from cityflow.adjustment.descriptor_matching import MatchingParameters
from cityflow.adjustment.features import FeatureParameters, Features, find_features
from cityflow.adjustment.guided_matching import guided_matches
from cityflow.adjustment.pair_check import agreeing
from cityflow.adjustment.tracks import spread, tied
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.pixels import ArrayPixels
from cityflow.geometry.epipolar import vertical_parallax
from cityflow.geometry.rotations import from_omega_phi_kappa

CAMERA = Camera(520, 400, 600.0, 600.0, 263.0, 195.0, (-0.05, 0.02, 1e-4, 2e-4))
HEIGHTS = (-3.0, 3.0)
BOUND_PX = 10.0


@lru_cache(maxsize=4)
def _pictures() -> tuple[tuple[OrientedImage, np.ndarray], ...]:
    """Three images of level ground at height 0, two upright and one tilted by 30°."""
    made = []
    for name, x, y, omega in (("a", -4.0, 0.0, 0.0), ("b", 5.0, 1.0, 0.0), ("c", 0.0, -26.0, 30.0)):
        image = OrientedImage(name, CAMERA, from_omega_phi_kappa(np.radians(omega), 0.02, 0.1), np.array([x, y, 50.0]))
        made.append((image, rendered_ground(image)))
    return tuple(made)


@lru_cache(maxsize=1)
def _features() -> tuple[Features, ...]:
    return tuple(find_features(ArrayPixels(p), 255.0, FeatureParameters(per_image=800)) for _, p in _pictures())


def _true_distance(one: int, other: int, uv: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """How far points of the second image are from where the first's ones are there, pixels."""
    images = [i for i, _ in _pictures()]
    rays = images[one].rays(uv[0])
    ground = images[one].centre + rays * (-images[one].centre[2] / rays[:, 2])[:, None]
    return np.asarray(np.linalg.norm(images[other].project(ground)[0] - uv[1], axis=1))


def _matched(one: int, other: int, given: tuple[OrientedImage, OrientedImage]) -> tuple[np.ndarray, np.ndarray]:
    """Matches, and which of them agree."""
    pair = _features()[one], _features()[other]
    found = guided_matches(given, pair, HEIGHTS, BOUND_PX, MatchingParameters())
    uv = pair[0].uv[found[:, 0]], pair[1].uv[found[:, 1]]
    return found, agreeing(given, uv, BOUND_PX)


def test_matches_lie_on_each_other_also_between_upright_and_tilted_images() -> None:
    images = [i for i, _ in _pictures()]
    for one, other, least in ((0, 1, 150), (0, 2, 60)):
        found, good = _matched(one, other, (images[one], images[other]))
        pair = _features()[one].uv[found[good, 0]], _features()[other].uv[found[good, 1]]
        off = _true_distance(one, other, pair)
        assert good.sum() >= least
        assert np.median(off) < 0.35
        assert np.mean(off < 2.0) > 0.97


def test_a_pose_that_is_off_hides_no_match_and_lets_no_wrong_one_in() -> None:
    images = [i for i, _ in _pictures()]
    turn = rotation_of(np.array([[4.0, -3.0, 5.0]]) / 600.0)[0]
    wrong = replace(images[1], rotation=turn @ images[1].rotation)
    found, good = _matched(0, 1, (images[0], wrong))
    uv = _features()[0].uv[found[good, 0]], _features()[1].uv[found[good, 1]]
    assert np.median(np.abs(vertical_parallax(images[0], wrong, *uv))) > 1.5
    assert good.sum() >= 150
    assert np.mean(_true_distance(0, 1, uv) < 2.0) > 0.97


def test_images_taken_in_one_place_have_no_epipolar_lines() -> None:
    one = _pictures()[0][0]
    other = replace(one, rotation=rotation_of(np.array([[0.3, 0.0, 0.0]]))[0] @ one.rotation)
    uv = np.random.default_rng(2).uniform(0, 400, (2, 40, 2))
    assert not agreeing((one, other), (uv[0], uv[1]), BOUND_PX).any()
    moved = replace(other, centre=other.centre + np.array([0.3, 0.0, 0.0]))
    assert agreeing((one, moved), (uv[0], uv[1]), BOUND_PX).any()


def test_points_do_not_depend_on_raster_windows() -> None:
    image = ArrayPixels(_pictures()[0][1])
    whole, parts = (find_features(image, 255.0, FeatureParameters(per_image=50000, window_px=w)) for w in (1024, 256))
    places = {tuple(p) for p in np.round(whole.uv, 1)}
    assert len(parts) > 300
    assert np.mean([tuple(p) in places for p in np.round(parts.uv, 1)]) > 0.97


def test_points_are_spread_over_the_image() -> None:
    few = find_features(ArrayPixels(_pictures()[0][1]), 255.0, FeatureParameters(per_image=200, cells=6))
    edge = 520 / 6
    count, _, _ = np.histogram2d(few.uv[:, 0], few.uv[:, 1], (6, 4), ((0, 520), (0, 4 * edge)))
    assert 200 <= len(few) <= 260
    assert count.min() >= 0.6 * count.max()


def test_tracks_join_three_images_and_contradictions_go() -> None:
    uv = [np.arange(10.0).reshape(5, 2) for _ in range(3)]
    scale = [np.ones(5, np.float32)] * 3
    matches = {
        (0, 1): np.array([[0, 0], [1, 1], [3, 4]]),
        (1, 2): np.array([[0, 2], [1, 1]]),
        (0, 2): np.array([[0, 2], [2, 1]]),
    }
    ties = tied(matches, uv, scale)
    # 1 of the first image and 2 of the first image would be one point by way of the third
    assert ties.lengths.tolist() == [3, 2]
    assert ties.image.tolist() == [0, 1, 2, 0, 1]
    assert ties.feature.tolist() == [0, 0, 2, 3, 4]
    assert spread(ties, [(10, 10)] * 3, 4).points == 2

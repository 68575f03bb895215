"""A mapped block that GNSS positions and control points hold: bends go, cameras are right, and what cannot be known is held and told."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from adjustment.scenes import CAMERA, PIXEL_M, Scene, disturbed, scene
from adjustment.test_control import _points
from cityflow.adjustment.block import Block, vector_of
from cityflow.adjustment.bundle import AdjustmentParameters, adjusted
from cityflow.adjustment.georeferencing import Georeferenced, Positions, georeferenced
from cityflow.core.camera import OrientedImage
from cityflow.orientation.stations import stations


@lru_cache(maxsize=1)
def _mapped(seed: int = 31) -> tuple[Scene, tuple[OrientedImage, ...]]:
    """A block with a focal length that is 0.5 % off and a lens that is not known: poses make up for it, and bend."""
    truth = scene(seed)
    sheet = replace(CAMERA, fx=1507.5, fy=1507.5, cx=600.0, cy=450.0, distortion=())
    given = [replace(i, camera=sheet, head="only") for i in disturbed(truth.images, 0.3, 3.0, seed=seed)]
    origin = np.asarray(np.round(np.mean([i.centre for i in given], axis=0)), np.float64)
    asked = AdjustmentParameters(calibrate=False, position_sigma_m=2.0, angle_sigma_deg=1.0)
    block = adjusted(Block.of(given, origin), truth.ties, asked).block
    return truth, tuple(block.image(k, i.name, origin) for k, i in enumerate(given))


@lru_cache(maxsize=1)
def _mounted() -> tuple[Scene, tuple[OrientedImage, ...]]:
    """The scene with three heads on one mount at eight stations, and poses that are off by pixels."""
    truth = scene(33, noise_px=0.6, mounted=True)
    origin = np.asarray(np.round(np.mean([i.centre for i in truth.images], axis=0)), np.float64)
    given = [replace(i, head=str(k % 3)) for k, i in enumerate(disturbed(truth.images, 0.3, 3.0, seed=33))]
    asked = AdjustmentParameters(calibrate=False, position_sigma_m=2.0, angle_sigma_deg=1.0)
    block = adjusted(Block.of(given, origin), truth.ties, asked).block
    return truth, tuple(block.image(k, i.name, origin) for k, i in enumerate(given))


def _gnss(truth: Scene, noise_m: float, seed: int, arm: tuple[float, ...] = (0.0,) * 3) -> Positions:
    rng = np.random.default_rng(seed)
    places = np.array([i.centre + i.rotation.T @ np.array(arm) for i in truth.images])
    return Positions(places + rng.normal(0, noise_m, places.shape), np.full(places.shape, np.nan))


def _off(found: Georeferenced, truth: Scene) -> np.ndarray:
    return np.array([i.centre - t.centre for i, t in zip(found.refinement.images, truth.images, strict=True)])


def test_positions_take_a_bend_out_and_calibrate() -> None:
    truth, bent = _mapped()
    before = np.array([i.centre - t.centre for i, t in zip(bent, truth.images, strict=True)])
    found = georeferenced(bent, truth.ties, _gnss(truth, 0.1, seed=1))
    off = _off(found, truth)
    rms = float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
    assert found.is_taken
    assert rms < 0.5 * float(np.sqrt(np.mean(np.sum(before**2, axis=1))))
    assert rms < 1.2 * PIXEL_M
    assert found.refinement.adjusted.position_sigma_m == pytest.approx(0.1, rel=0.4)
    told = np.sqrt(np.einsum("nii->ni", found.refinement.covariances)[:, 3:])
    assert 0.3 < np.sqrt(np.mean((off / told) ** 2)) < 2.0
    assert found.refinement.images[0].camera.fx == pytest.approx(1500.0, rel=1e-3)
    assert found.held_focals == ()
    assert not found.refinement.adjusted.arms.any()


def test_control_points_hold_it_and_tell_the_datum_of_positions() -> None:
    truth, bent = _mapped()
    gnss = _gnss(truth, 0.1, seed=2)
    points = _points(truth, 5, 6, seed=3)
    lost = replace(gnss, xyz=gnss.xyz + np.array([0.0, 0.0, 43.5]))
    lost.xyz[5] += 30.0
    found = georeferenced(bent, truth.ties, lost, points)
    assert np.sqrt(np.mean(np.sum(_off(found, truth) ** 2, axis=1))) < 1.0 * PIXEL_M
    control = found.refinement.control
    assert control is not None
    assert control.shift_known
    assert control.shift[2] == pytest.approx(-43.5, abs=0.15)
    plan, height = control.rms(holds=False) or (np.inf, np.inf)
    assert plan < 0.7 * PIXEL_M
    assert height < 1.0 * PIXEL_M
    assert found.far == (truth.images[5].name,)
    assert found.refinement.images[0].camera.fx == pytest.approx(1500.0, rel=2e-4)


def test_control_points_alone_hold_it() -> None:
    truth, bent = _mapped()
    nothing = np.full((len(bent), 3), np.nan)
    found = georeferenced(bent, truth.ties, Positions(nothing, nothing), _points(truth, 5, 6, seed=3))
    assert np.sqrt(np.mean(np.sum(_off(found, truth) ** 2, axis=1))) < 1.5 * PIXEL_M
    with pytest.raises(ValueError, match="neither positions nor control points"):
        georeferenced(bent, truth.ties, Positions(nothing, nothing))


def test_an_antenna_beside_the_camera_is_found_and_a_given_one_is_used() -> None:
    truth, bent = _mapped()
    arm = (0.05, 0.4, -0.3)
    gnss = _gnss(truth, 0.02, seed=4, arm=arm)
    points = _points(truth, 5, 0, seed=3)
    found = georeferenced(bent, truth.ties, gnss, points).refinement.adjusted
    assert np.abs(found.arms[0] - arm).max() < 0.06
    assert (np.abs(found.arms[0] - arm) < 4 * found.arm_sigmas[0]).all()
    given = georeferenced(bent, truth.ties, replace(gnss, arm=np.array(arm)), points).refinement.adjusted
    assert given.position_sigma_m == pytest.approx(0.02, rel=0.4)
    assert np.abs(given.shift).max() < 0.06


def test_heads_that_fire_together_are_held_by_their_mount() -> None:
    """Three heads on eight stations with one mount; stations that are none give no mount."""
    truth, bent = _mounted()
    gnss = _gnss(truth, 0.3, seed=6)
    alone = georeferenced(bent, truth.ties, gnss)
    held = georeferenced(bent, truth.ties, replace(gnss, stations=tuple(k // 3 for k in range(24))))
    mixed = georeferenced(bent, truth.ties, replace(gnss, stations=tuple((k * 7 % 24) // 3 for k in range(24))))
    assert alone.mounts is None
    assert mixed.mounts is None
    assert held.mounts is not None
    assert held.mounts.sigmas[0] < 0.2 / CAMERA.fx
    assert _beside(held, truth) < 0.5 * _beside(alone, truth)


def test_heads_of_a_station_have_one_position() -> None:
    """What a station's position is off, its heads share: it says as much of the place of the block as one position does, not as three."""
    truth, bent = _mounted()
    errors = np.repeat(np.random.default_rng(8).normal(0, 0.3, (8, 3)), 3, axis=0)
    places = np.array([i.centre for i in truth.images]) + errors
    gnss = Positions(places, np.full(places.shape, np.nan), stations=tuple(k // 3 for k in range(24)))
    found = georeferenced(bent, truth.ties, gnss)
    assert found.mounts is not None
    stated = np.sqrt(np.median(found.refinement.covariances[:, 3, 3]))
    assert stated > 0.9 * found.refinement.adjusted.position_sigma_m / np.sqrt(8)
    assert found.refinement.adjusted.position_sigma_m == pytest.approx(0.3, rel=0.35)


def _beside(found: Georeferenced, truth: Scene) -> float:
    """Scatter over the stations of how far the left head's rotation from the level head's is off, radians."""
    ours, theirs = (np.array([i.rotation for i in images]) for images in (found.refinement.images, truth.images))
    turns = [r[1::3] @ np.swapaxes(r[0::3], 1, 2) for r in (ours, theirs)]
    off = vector_of(turns[0] @ np.swapaxes(turns[1], 1, 2))
    return float(np.std(off, axis=0).max())


def test_stations_are_known_by_time_or_by_names() -> None:
    heads = [k % 3 for k in range(12)]
    taken = [f"2026:06:21 10:00:{k // 3:02d}" for k in range(12)]
    groups = tuple(k // 3 for k in range(12))
    assert stations([f"x{k}" for k in range(12)], heads, taken) == groups
    assert stations([f"{'abc'[k % 3]}/{k // 3:03d}.jpg" for k in range(12)], heads, [""] * 12) == groups
    assert stations([f"s{k // 3:03d}_h{k % 3}.jpg" for k in range(12)], heads, [""] * 12) == groups
    assert stations([f"x{k:03d}" for k in range(12)], heads, [""] * 12) == (None,) * 12
    assert stations([f"x{k}" for k in range(12)], [0] * 12, taken) == (None,) * 12

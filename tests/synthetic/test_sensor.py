"""Sensors: noise, vignetting and exposure measured on uniform light; raw frames and their calibration."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import Float32Array
from cityflow.core.camera import Camera, OrientedImage
from cityflow.synthetic.sensor import SensorParameters, blurred, exposed, exposure_gain
from cityflow.synthetic.sensor_readout import RawParameters, dark_frame, fixed_pattern, flat_frame, mosaic, raw_frame

SHAPE = 240, 320
QUIET = SensorParameters(vignetting=0, exposure=1.0, exposure_sigma=0, noise=False, tone="linear", bits=16)


def image(name: str = "s00_000_nadir") -> OrientedImage:
    height, width = SHAPE
    return OrientedImage(name, Camera(width, height, 400.0, 400.0, 160.0, 120.0), np.diag([1.0, -1, -1]), np.zeros(3))


def uniform(level: float, bands: int = 3) -> Float32Array:
    return np.full((*SHAPE, bands), level, np.float32)


@pytest.mark.parametrize("level", [0.02, 0.2, 0.7])
def test_noise_is_shot_noise_and_read_noise(level: float) -> None:
    sensor = QUIET.model_copy(update={"noise": True, "full_well_e": 8000.0, "read_noise_e": 15.0})
    array = exposed(uniform(level), image(), sensor, 1) / sensor.white
    expected = np.sqrt(level * 8000 + 15**2) / 8000
    assert array.std() == pytest.approx(expected, rel=0.02)
    assert array.mean() == pytest.approx(level, abs=5 * expected / np.sqrt(array.size) + 1e-5)
    neighbours = np.corrcoef(array[:, :-1, 0].ravel(), array[:, 1:, 0].ravel())[0, 1]
    assert abs(neighbours) < 0.02


def test_corners_get_as_much_less_light_as_asked() -> None:
    sensor = QUIET.model_copy(update={"vignetting": 0.4})
    array = exposed(uniform(0.5), image(), sensor, 1)[..., 0] / sensor.white
    assert array[120, 160] == pytest.approx(0.5, abs=1e-3)
    assert array[0, 0] == pytest.approx(0.5 * 0.6, rel=0.01)
    assert array[120, 0] == pytest.approx(0.5 * (1 - 0.4 * 160**2 / (160**2 + 120**2)), rel=0.01)


def test_exposures_differ_by_image_and_the_second_group_is_brighter() -> None:
    sensor = SensorParameters(exposure_sigma=0.05, second_group_gain=2.0, second_group_share=0.5)
    strips = [f"s{k:02d}" for k in range(60)]
    gains = np.array([[exposure_gain(image(f"{s}_{i:03d}_nadir"), 3, sensor, 9)[1] for i in range(8)] for s in strips])
    bright = np.median(gains, axis=1) > 1.5 * np.sqrt(2)
    assert 0.25 < bright.mean() < 0.75
    relative = np.log(np.where(bright[:, None], gains / 2, gains) / 1.5)
    assert relative.std() == pytest.approx(0.05 * np.sqrt(1 + 0.25**2), rel=0.1)
    assert np.abs(relative.mean()) < 0.01


@pytest.mark.parametrize(
    ("bits", "dtype", "white"), [(8, np.uint8, 255), (12, np.uint16, 4095), (16, np.uint16, 65535)]
)
def test_bits_and_saturation(bits: int, dtype: type, white: int) -> None:
    sensor = SensorParameters(bits=bits, exposure_sigma=0, noise=False)
    array = exposed(uniform(5.0), image(), sensor, 1)
    assert array.dtype == dtype
    assert (array == white).all()


def test_the_srgb_curve_maps_middle_grey() -> None:
    sensor = QUIET.model_copy(update={"tone": "srgb", "bits": 8})
    # a reflectance of 21.4 % is sRGB 128 (IEC 61966-2-1)
    assert (exposed(uniform(0.2140), image(), sensor, 1) == 127).mean() + (
        exposed(uniform(0.2140), image(), sensor, 1) == 128
    ).mean() == 1


def test_blur_has_the_spread_asked_for_and_keeps_the_light() -> None:
    light = np.zeros((41, 41, 1), np.float32)
    light[20, 20] = 1.0
    soft = blurred(light, 1.5)[..., 0]
    assert soft.sum() == pytest.approx(1.0, abs=1e-5)
    offset = np.arange(41) - 20
    assert np.sqrt((soft.sum(axis=0) * offset**2).sum()) == pytest.approx(1.5, rel=0.02)


def test_mosaic_takes_each_colour_where_its_filter_is_also_from_an_odd_row() -> None:
    signal = np.zeros((4, 6, 3), np.float32)
    signal[...] = (1, 2, 3)
    assert mosaic(signal, "GRBG")[:2, :2].tolist() == [[2, 1], [3, 2]]
    assert mosaic(signal[1:], "GRBG", top=1)[:2, :2].tolist() == [[3, 2], [2, 1]]


def test_calibration_frames_give_back_the_fixed_pattern_and_mend_a_raw_frame() -> None:
    sensor = SensorParameters(exposure=1.0, exposure_sigma=0, vignetting=0.0)
    raw = RawParameters(dark_sigma=0.004, response_sigma=0.03, hot_share=1e-3)
    truth = fixed_pattern(SHAPE, "nadir", raw, 4)
    darks = [dark_frame(SHAPE, "nadir", k, sensor, raw, 4) for k in range(24)]
    flats = [flat_frame(SHAPE, "nadir", k, sensor, raw, 4) for k in range(24)]
    assert darks[0].dtype == np.uint16
    assert (darks[0] != darks[1]).mean() > 0.2
    dark, flat = (np.mean(f, axis=0)[..., 0] for f in (darks, flats))
    response = (flat - dark) / (flat - dark).mean()
    assert np.std(dark / raw.white - truth.dark) < 0.0005
    sound = flat < 0.98 * raw.white
    assert np.std((response - truth.response)[sound]) < 0.005
    frame = raw_frame(uniform(0.3), image(), sensor, raw, 4)
    assert frame.shape == (*SHAPE, 1)
    before = frame[..., 0].astype(float)
    after = (before - dark) / response
    shot = np.sqrt(0.32 * sensor.full_well_e + 100) / sensor.full_well_e
    assert before.std() / raw.white > 1.5 * shot
    assert (after / raw.white).std() == pytest.approx(shot, rel=0.15)
    assert after.mean() / raw.white == pytest.approx(0.3, abs=0.003)


def test_heads_have_sensors_of_their_own_and_frames_of_one_share_its_pattern() -> None:
    raw = RawParameters()
    assert (fixed_pattern(SHAPE, "nadir", raw, 4).response != fixed_pattern(SHAPE, "left", raw, 4).response).any()
    sensor = SensorParameters(noise=False, vignetting=0, exposure_sigma=0)
    a, b = (raw_frame(uniform(0.3), image(n), sensor, raw, 4) for n in ("s00_000_nadir", "s01_005_nadir"))
    assert (a == b).all()

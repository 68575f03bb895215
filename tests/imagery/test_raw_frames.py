"""Raw frames of a known scene, spoilt as sensors spoil them, come back within their noise."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.camera import Camera
from cityflow.core.pixels import ArrayPixels
from cityflow.imagery.raw_calibration import (
    CalibrationParameters,
    bad_pixels,
    calibration_of,
    gain_of,
    master_dark,
)
from cityflow.imagery.raw_frames import (
    Pattern,
    corrected,
    demosaicked,
    developed,
    full_range,
    mended,
)
from cityflow.imagery.resampling import infrared_rows, undistorted

SHAPE = (240, 320)
READ_NOISE, TOP = 3.0, 4095


class Sensor:
    """12 bits: dark signal with column structure, 3 % of non-uniformity, hot and dead pixels, shot and read noise."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.dark = 60 + self.rng.normal(0, 4, (1, SHAPE[1])) + self.rng.normal(0, 2, SHAPE)
        self.answer = self.rng.normal(1, 0.03, SHAPE)
        self.bad = self.rng.random(SHAPE) < 0.001
        hot = self.bad & (self.rng.random(SHAPE) < 0.5)
        self.dark[hot] += 900
        self.answer[self.bad & ~hot] = 0.01

    def frame(self, light: np.ndarray | float) -> np.ndarray:
        signal = np.broadcast_to(light, SHAPE) * self.answer
        noisy = signal + self.rng.normal(0, 1, SHAPE) * np.sqrt(np.maximum(signal, 0) * 0.3 + READ_NOISE**2) + self.dark
        return np.clip(np.rint(noisy), 0, TOP).astype(np.uint16)

    def flats(self, light: np.ndarray | float, count: int = 40) -> list[np.ndarray]:
        return [self.frame(light) for _ in range(count)]


def _scene() -> np.ndarray:
    """(rows, cols, 3) smooth radiance in raw numbers, with one sharp vertical edge."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    base = 1200 + 700 * np.sin(x / 40) * np.cos(y / 30)
    base = np.where(x > 200, base * 0.4, base)
    return np.stack([base, 0.8 * base, 0.5 * base], axis=-1)


def _mosaic(colour: np.ndarray, pattern: str) -> np.ndarray:
    out = np.empty(colour.shape[:2], colour.dtype)
    for (r, c), name in zip(((0, 0), (0, 1), (1, 0), (1, 1)), pattern, strict=True):
        out[r::2, c::2] = colour[r::2, c::2, "RGB".index(name)]
    return out


@pytest.mark.parametrize("pattern", ["RGGB", "BGGR", "GRBG", "GBRG"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_colours_of_a_mosaic_come_back(pattern: Pattern, dtype: type) -> None:
    truth: np.ndarray = (_scene() / (8 if dtype is np.uint8 else 1)).astype(dtype)
    made = demosaicked(_mosaic(truth, pattern), pattern)
    away = np.abs(np.arange(SHAPE[1]) - 201) > 3
    error = np.abs(made.astype(float) - truth)[4:-4, 4:-4][:, away[4:-4]]
    assert made.dtype == dtype
    assert np.quantile(error, 0.999) <= 0.01 * truth.max() + 1


@pytest.mark.parametrize("seed", [0, 1])
def test_a_calibrated_frame_is_as_good_as_its_noise(seed: int) -> None:
    sensor = Sensor(seed)
    calibration = calibration_of(sensor.flats(0.0), sensor.flats(2500.0))
    assert np.array_equal(calibration.bad, sensor.bad)
    good = ~sensor.bad
    assert np.std((calibration.dark - sensor.dark)[good]) < 1.0
    assert np.std((calibration.gain * sensor.answer)[good]) < 0.005
    truth = _mosaic(_scene(), "RGGB")
    raw = sensor.frame(truth)
    noise = np.sqrt(truth * 0.3 + READ_NOISE**2)
    before = (raw.astype(float) - 60 - truth)[good] / noise[good]
    after = (corrected(raw, calibration).astype(float) - truth) / noise
    assert np.std(before) > 1.3
    assert np.std(after[good]) < 1.1
    assert abs(np.mean(after[good])) < 0.02
    assert np.quantile(np.abs(after[sensor.bad]), 0.8) < 4.0


def test_what_the_lens_takes_away_is_kept_where_asked() -> None:
    sensor = Sensor(3)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    shade = 1 - 0.4 * ((x - 160) ** 2 + (y - 120) ** 2) / 200**2
    dark, flats = master_dark(sensor.flats(0.0, 12)), sensor.flats(2500.0 * shade, 24)
    both = gain_of(master_dark(flats) - dark)
    pixel = gain_of(master_dark(flats) - dark, CalibrationParameters(vignetting_px=24))
    inner = ~sensor.bad
    inner[:16] = inner[-16:] = False
    inner[:, :16] = inner[:, -16:] = False
    assert np.isnan(both[~inner & sensor.bad]).any()
    flat = (both * sensor.answer * shade)[inner]
    assert np.std(flat) / np.mean(flat) < 0.01
    assert np.std((pixel * sensor.answer)[inner]) < 0.01
    assert bad_pixels(dark, pixel)[~sensor.bad].mean() < 1e-4


def test_a_cosmic_ray_leaves_no_trace() -> None:
    sensor = Sensor(5)
    frames = sensor.flats(0.0, 10)
    clean = master_dark(frames)
    frames[4][100, 100:120] = TOP
    assert np.abs(master_dark(frames) - clean)[100, 100:120].max() < 6.0
    with pytest.raises(ValueError, match="at least one"):
        master_dark([])


def test_only_bad_pixels_are_mended() -> None:
    raw = _mosaic(_scene(), "RGGB").astype(np.uint16)
    bad = np.zeros(SHAPE, bool)
    bad[50, 60] = bad[50, 62] = bad[0, 0] = bad[-1, -1] = True
    spoilt = raw.copy()
    spoilt[bad] = 65535
    made = mended(spoilt, bad)
    assert np.array_equal(made[~bad], raw[~bad])
    assert np.abs(made[bad].astype(int) - raw[bad]).max() < 60


def test_twelve_bits_fill_sixteen() -> None:
    raw = np.array([[0, 1, 2048, 4095]], np.uint16)
    assert full_range(raw, 12).tolist() == [[0, 16, 32776, 65535]]
    assert (
        full_range(np.left_shift(raw, 4).astype(np.uint16), 12, left_aligned=True).tolist()
        == full_range(raw, 12).tolist()
    )
    assert full_range(np.array([[255]], np.uint8), 8).tolist() == [[65535]]
    with pytest.raises(ValueError, match="12 bits"):
        full_range(np.left_shift(raw, 4).astype(np.uint16), 12)


@pytest.mark.parametrize(
    "camera",
    [
        Camera(320, 240, 300.0, 305.0, 165.0, 117.0, (-0.15, 0.04, 0.001, -0.001)),
        Camera(320, 240, 260.0, 260.0, 160.0, 120.0, (0.02, -0.005, 0.0, 0.0), "fisheye"),
    ],
)
def test_distortion_goes(camera: Camera) -> None:
    """A pattern painted on rays: pixel centres of either camera show the pattern at their own rays."""

    def painted(kind: Camera) -> np.ndarray:
        v, u = np.mgrid[:240, :320] + 0.5
        n = kind.undistort(np.column_stack([u.ravel(), v.ravel()])).reshape(240, 320, 2)
        a = 20000 + 15000 * np.sin(14 * n[..., 0]) * np.cos(11 * n[..., 1])
        return np.stack([a, a / 2, 40000 - a], axis=-1).astype(np.uint16)

    made, pinhole, seen = undistorted(painted(camera), camera)
    truth = painted(pinhole)
    assert pinhole.is_pinhole
    assert 0.8 < seen.mean() <= 1.0
    inner = seen.copy()
    inner[:3] = inner[-3:] = False
    inner[:, :3] = inner[:, -3:] = False
    assert np.abs(made.astype(int) - truth)[inner].max() < 120  # of 65535, at slopes of 800 a pixel
    assert (made[~seen] == 0).all()
    with pytest.raises(ValueError, match="camera of"):
        undistorted(made[:100], camera)


def test_infrared_lies_on_the_colours() -> None:
    y, x = np.mgrid[:200, :260] + 0.5
    shift = np.array([[1.02, 0.01, -6.3], [-0.01, 1.02, 4.7], [0, 0, 1.0]])
    rows, cols = np.mgrid[:180, :240] + 0.5
    infrared = (3000 + 2000 * np.sin(x / 15) * np.cos(y / 12)).astype(np.uint16)[..., None]
    at = np.stack([cols, rows, np.ones_like(rows)], axis=-1) @ shift.T
    truth = 3000 + 2000 * np.sin(at[..., 0] / 15) * np.cos(at[..., 1] / 12)
    made = infrared_rows(ArrayPixels(infrared), shift, 240, (0, 180))
    inside = (at[..., 0] > 1) & (at[..., 0] < 259) & (at[..., 1] > 1) & (at[..., 1] < 199)
    assert made.shape == (180, 240, 1)
    assert np.abs(made[..., 0] - truth)[inside].max() < 12


def test_the_whole_chain_gives_a_picture() -> None:
    sensor = Sensor(7)
    calibration = calibration_of(sensor.flats(0.0, 12), sensor.flats(2500.0, 24))
    made = developed(sensor.frame(_mosaic(_scene(), "GRBG")), "GRBG", 12, calibration)
    away = np.abs(np.arange(SHAPE[1]) - 201) > 4
    error = (made / 65535 * TOP - _scene())[4:-4, 4:-4][:, away[4:-4]]
    assert made.dtype == np.uint16
    assert np.sqrt(np.mean(error**2)) < 25
    assert abs(np.median(error)) < 2

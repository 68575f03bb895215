"""What photographs do to a façade: crowns before it, shade, noise, a misplaced edge."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray

FINE_M = 0.02
"""Façades are drawn on cells of this size, and seen on those of a picture."""


@dataclass(frozen=True, slots=True)
class ImageErrors:
    """What a picture makes of a façade.

    Attributes
    ----------
    gsd_m : cell of the picture
    foreshortening : cells upright by cells across before rectification, 0.4 to 1
    blur_px : standard deviation of the point spread;  noise : of grey values of 0 to 255
    exposure, gamma : factor and exponent on values of 0 to 1
    trees : crowns that stand before the wall
    shadow : whether a neighbour's shadow falls on it
    hidden_m : height of what is interpolated at the wall base
    jpeg : quality of the compression, 0 for none
    wave_px, turn_deg : rectification that is off: displacements that change along the wall, and a rotation; openings move with what is seen of them
    """

    gsd_m: float = 0.08
    foreshortening: float = 0.7
    blur_px: float = 0.8
    noise: float = 3.0
    exposure: float = 1.0
    gamma: float = 1.0
    trees: int = 0
    shadow: bool = False
    hidden_m: float = 0.0
    jpeg: int = 0
    wave_px: float = 0.0
    turn_deg: float = 0.0

    @classmethod
    def rough(cls, rng: np.random.Generator) -> ImageErrors:
        """Errors of poor flights: coarse, blurred by up to two pixels, compressed, rectified with errors of one to two pixels."""
        return cls(
            gsd_m=float(rng.uniform(0.05, 0.17)), foreshortening=float(rng.uniform(0.5, 0.95)), blur_px=float(rng.uniform(0.8, 1.8)),
            noise=float(rng.uniform(1.0, 6.0)), exposure=float(rng.uniform(0.5, 1.3)), gamma=float(rng.uniform(0.75, 1.3)),
            trees=int(rng.choice([0, 0, 1])), shadow=bool(rng.random() < 0.3), jpeg=int(rng.integers(40, 95)),
            wave_px=float(rng.uniform(0, 2)), turn_deg=float(rng.uniform(-1.2, 1.2)),
        )  # fmt: skip

    @classmethod
    def at_random(cls, rng: np.random.Generator) -> ImageErrors:
        """Errors as flights have them, one façade of three partly behind trees or in a shadow."""
        return cls(
            gsd_m=float(rng.uniform(0.03, 0.12)), foreshortening=float(rng.uniform(0.5, 0.95)), blur_px=float(rng.uniform(0.5, 1.1)),
            noise=float(rng.uniform(1.0, 6.0)), exposure=float(rng.uniform(0.6, 1.3)), gamma=float(rng.uniform(0.8, 1.25)),
            trees=int(rng.choice([0, 0, 0, 1, 2])), shadow=bool(rng.random() < 0.3), hidden_m=float(rng.choice([0.0, 0.0, rng.uniform(0.3, 2.0)])),
        )  # fmt: skip


def smooth_noise(rows: int, cols: int, size_m: float, rng: np.random.Generator) -> FloatArray:
    k = max(round(size_m / FINE_M), 2)
    coarse = rng.standard_normal((rows // k + 3, cols // k + 3))
    return np.asarray(
        cv2.resize(coarse, ((cols // k + 3) * k, (rows // k + 3) * k), interpolation=cv2.INTER_CUBIC)[:rows, :cols]
    )


def crowns_before(shape: tuple[int, int], count: int, rng: np.random.Generator) -> BoolArray:
    """Trees before the wall: discs with ragged rims that stand at the wall base."""
    out = np.zeros(shape, bool)
    y, x = np.mgrid[: shape[0], : shape[1]] * FINE_M
    for _ in range(count):
        radius, at = rng.uniform(0.8, 1.8), rng.uniform(0, shape[1] * FINE_M)
        middle = shape[0] * FINE_M - rng.uniform(0.8, 3.0)
        ragged = 1 + 0.22 * smooth_noise(*shape, 0.3, rng)
        out |= np.hypot(x - at, y - middle) < radius * ragged
    return out


def leaf_colours(shape: tuple[int, ...], rng: np.random.Generator) -> FloatArray:
    light = 60 * (1 + 0.45 * smooth_noise(shape[0], shape[1], 0.12, rng))
    return np.asarray(light[..., None] * np.array([0.8, 1.15, 0.6]))


def shadow_on(shape: tuple[int, ...], rng: np.random.Generator) -> FloatArray:
    """A neighbour's shadow: everything below a sloping line, with a soft rim."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    line = shape[0] * rng.uniform(0.2, 0.8) + rng.uniform(-0.7, 0.7) * (x - shape[1] / 2)
    return np.asarray(1 - rng.uniform(0.3, 0.55) / (1 + np.exp(-(y - line) / 3)))


def photographed(fine: Float32Array, errors: ImageErrors, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Foreshortened, blurred, with noise, exposed, and rectified again, on whole cells of the picture."""
    rows, cols = (max(round(n * FINE_M / errors.gsd_m), 2) for n in fine.shape[:2])
    scale = errors.gsd_m / FINE_M
    wide, high = (max(math.ceil(n * scale), 1) for n in (cols, rows))
    more = ((0, max(high - fine.shape[0], 0)), (0, max(wide - fine.shape[1], 0)), (0, 0))
    fine = np.pad(fine, more, mode="edge")[:high, :wide]
    low = max(round(rows * errors.foreshortening), 2)
    image = cv2.resize(fine, (cols, low), interpolation=cv2.INTER_AREA)
    image = cv2.GaussianBlur(image, (0, 0), errors.blur_px)
    image = 255 * errors.exposure * (np.clip(image, 0, 255) / 255) ** errors.gamma
    image = image + errors.noise * rng.standard_normal(image.shape)
    image = cv2.resize(np.clip(image, 0, 255).astype(np.float32), (cols, rows), interpolation=cv2.INTER_LINEAR)
    whole = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    if errors.jpeg == 0:
        return whole
    _, data = cv2.imencode(".jpg", whole, [cv2.IMWRITE_JPEG_QUALITY, errors.jpeg])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)


def hidden_rows(rows: int, errors: ImageErrors, cell: float = FINE_M) -> slice:
    return slice(rows - min(round(errors.hidden_m / cell), rows), rows)

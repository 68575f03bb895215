"""How alike two pictures look: structural similarity (Wang 2004), colour difference CIEDE2000 (Sharma 2005)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray

SIGMA_PX, RADIUS_PX = 1.5, 5
C_1, C_2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
LUMA = np.array([0.2125, 0.7154, 0.0721])
XYZ_OF_RGB = np.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]])  # fmt: skip
WHITE_D65 = np.array([0.95047, 1.0, 1.08883])
KNEE = 6.0 / 29.0
FULL_25 = 25.0**7


@dataclass(frozen=True, slots=True)
class Similarity:
    """Of two pictures on some pixels.

    Attributes
    ----------
    ssim : mean structural similarity of their luminance
    delta_e : median CIEDE2000;  delta_e_90 : its 90th percentile
    pixels : number of them
    gain : by which each band of the picture was multiplied
    """

    ssim: float
    delta_e: float
    delta_e_90: float
    pixels: int
    gain: tuple[float, float, float]


def image_similarity(picture: Float32Array, reference: Float32Array, of: BoolArray) -> Similarity:
    """Compare after a gain per band; what is not asked for is taken from the reference, so that it neither helps nor hurts beside the rest.

    Parameters
    ----------
    picture, reference : (rows, cols, 3) sRGB, 0 to 255;  of : (rows, cols) pixels that are compared
    """
    gain = fitted_gain(picture[of], reference[of])
    alike = np.where(of[..., None], np.clip(picture * gain, 0, 255), reference).astype(np.float32)
    similar = float(ssim_map(alike @ LUMA, reference @ LUMA)[of].mean())
    difference = delta_e_2000(lab_of(alike[of]), lab_of(reference[of]))
    return Similarity(
        similar, float(np.median(difference)), float(np.percentile(difference, 90)), int(of.sum()), (float(gain[0]), float(gain[1]), float(gain[2]))
    )  # fmt: skip


def fitted_gain(values: FloatArray | Float32Array, reference: FloatArray | Float32Array) -> FloatArray:
    """(3,) factors of (N, 3) values that bring them nearest to the reference, by least squares."""
    v, r = values.astype(np.float64), reference.astype(np.float64)
    return np.asarray((v * r).sum(axis=0) / np.maximum((v * v).sum(axis=0), 1e-9))


def ssim_map(one: FloatArray, two: FloatArray) -> FloatArray:
    """(rows, cols) structural similarity around each pixel of two grey pictures, 0 to 255; Gaussian window of 11 x 11."""
    a, b = np.asarray(one, np.float64), np.asarray(two, np.float64)
    mean_a, mean_b = _smooth(a), _smooth(b)
    var_a, var_b = _smooth(a * a) - mean_a**2, _smooth(b * b) - mean_b**2
    common = _smooth(a * b) - mean_a * mean_b
    top = (2 * mean_a * mean_b + C_1) * (2 * common + C_2)
    return np.asarray(top / ((mean_a**2 + mean_b**2 + C_1) * (var_a + var_b + C_2)))


def lab_of(srgb: FloatArray | Float32Array) -> FloatArray:
    """(…, 3) sRGB, 0 to 255 → CIELAB of D65 (IEC 61966-2-1, CIE 15).

    >>> abs(lab_of(np.array([255.0, 255.0, 255.0]))).round(2).tolist()
    [100.0, 0.0, 0.0]
    """
    c = np.asarray(srgb, np.float64) / 255.0
    light = np.where(c <= 0.04045, c / 12.92, ((np.maximum(c, 0.0) + 0.055) / 1.055) ** 2.4)
    t = light @ XYZ_OF_RGB.T / WHITE_D65
    f = np.where(t > KNEE**3, np.cbrt(t), t / (3 * KNEE**2) + 4.0 / 29.0)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], axis=-1)


def delta_e_2000(one: FloatArray, two: FloatArray) -> FloatArray:
    """(…,) CIEDE2000 between (…, 3) colours in CIELAB, all weights 1."""
    (l_1, a_1, b_1), (l_2, a_2, b_2) = np.moveaxis(one, -1, 0), np.moveaxis(two, -1, 0)
    mean_c = (np.hypot(a_1, b_1) + np.hypot(a_2, b_2)) / 2
    stretch = 1.5 - 0.5 * np.sqrt(mean_c**7 / (mean_c**7 + FULL_25))
    c_1, c_2 = np.hypot(stretch * a_1, b_1), np.hypot(stretch * a_2, b_2)
    h_1, h_2 = _hue(stretch * a_1, b_1), _hue(stretch * a_2, b_2)
    coloured = c_1 * c_2 > 0
    turn = np.where(coloured, (h_2 - h_1 + 180) % 360 - 180, 0.0)
    # hues exactly opposite: the difference keeps the sign of the way that does not wrap
    turn = np.where(coloured & (np.abs(h_2 - h_1) == 180), h_2 - h_1, turn)
    mean_l, mean_c = (l_1 + l_2) / 2, (c_1 + c_2) / 2
    mean_h = np.where(coloured, _mean_hue(h_1, h_2), h_1 + h_2)
    t = (
        1 - 0.17 * _cos(mean_h - 30) + 0.24 * _cos(2 * mean_h) + 0.32 * _cos(3 * mean_h + 6) - 0.20 * _cos(4 * mean_h - 63)
    )  # fmt: skip
    s_l = 1 + 0.015 * (mean_l - 50) ** 2 / np.sqrt(20 + (mean_l - 50) ** 2)
    in_l = (l_2 - l_1) / s_l
    in_c = (c_2 - c_1) / (1 + 0.045 * mean_c)
    in_h = 2 * np.sqrt(c_1 * c_2) * np.sin(np.radians(turn) / 2) / (1 + 0.015 * mean_c * t)
    blue = 2 * np.sqrt(mean_c**7 / (mean_c**7 + FULL_25)) * np.sin(np.radians(60 * np.exp(-(((mean_h - 275) / 25) ** 2))))  # fmt: skip
    return np.asarray(np.sqrt(np.maximum(in_l**2 + in_c**2 + in_h**2 - blue * in_c * in_h, 0.0)))


def _mean_hue(h_1: FloatArray, h_2: FloatArray) -> FloatArray:
    total = h_1 + h_2
    apart = np.abs(h_1 - h_2) > 180
    return np.asarray(np.where(apart, np.where(total < 360, total + 360, total - 360), total) / 2)


def _hue(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(np.degrees(np.arctan2(b, a)) % 360)


def _cos(degrees: FloatArray) -> FloatArray:
    return np.asarray(np.cos(np.radians(degrees)))


def _smooth(values: FloatArray) -> FloatArray:
    size = 2 * RADIUS_PX + 1
    return np.asarray(cv2.GaussianBlur(values, (size, size), SIGMA_PX, borderType=cv2.BORDER_REFLECT))

"""How alike two pictures look: structural similarity (Wang 2004), colour difference CIEDE2000 (Sharma 2005), after a gain per band."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from skimage.color import deltaE_ciede2000, rgb2lab
from skimage.metrics import structural_similarity

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray

LUMA = np.array([0.2125, 0.7154, 0.0721])


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
    _, similar = structural_similarity(
        alike @ LUMA, reference @ LUMA, data_range=255, gaussian_weights=True, use_sample_covariance=False, full=True
    )
    lab = [rgb2lab(values[of].astype(np.float64) / 255) for values in (alike, reference)]
    difference = deltaE_ciede2000(*lab)
    red, green, blue = map(float, gain)
    return Similarity(
        float(similar[of].mean()), float(np.median(difference)), float(np.percentile(difference, 90)), int(of.sum()),
        (red, green, blue),
    )  # fmt: skip


def fitted_gain(values: FloatArray | Float32Array, reference: FloatArray | Float32Array) -> FloatArray:
    """(3,) factors of (N, 3) values that bring them nearest to the reference, by least squares."""
    v, r = values.astype(np.float64), reference.astype(np.float64)
    return np.asarray((v * r).sum(axis=0) / np.maximum((v * v).sum(axis=0), 1e-9))

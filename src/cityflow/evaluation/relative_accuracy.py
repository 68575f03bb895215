"""Relative accuracy of a block: true points, measured where true poses have them, seen through the poses that are judged.

Matching feels this and nothing else of poses: vertical parallax makes pairs miss their partners, and rays of several pairs that do not meet make noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.geometry.epipolar import intersections, vertical_parallax
from cityflow.geometry.similarity import Similarity, similarity_between

LEAST_COMMON = 8
"""Points that two images must both show to be a pair; set by hand."""


@dataclass(frozen=True, slots=True)
class BlockFigures:
    """Relative errors of a block.

    Attributes
    ----------
    pairs : of images with enough common points
    parallax_rms_px, parallax_median_px, parallax_p95_px : vertical parallax over all points of all pairs
    points : that two or more images show
    plan_rmse_m, height_rmse_m : of the places where all their rays meet, against the true points
    """

    pairs: int
    parallax_rms_px: float
    parallax_median_px: float
    parallax_p95_px: float
    points: int
    plan_rmse_m: float
    height_rmse_m: float


def block_figures(
    found: Sequence[OrientedImage],
    truth: Sequence[OrientedImage],
    xyz: FloatArray,
    seen: BoolArray | None = None,
    most_axes_deg: float = 40.0,
) -> BlockFigures:
    """Compare a block with its truth, image by image of the same name.

    Parameters
    ----------
    found, truth : world metres
    xyz : (P, 3) true points, world metres
    seen : (images of `truth`, P) which point an image really shows; None: what lies in its frame
    most_axes_deg : pairs whose viewing directions differ by more are none that matching takes

    Raises
    ------
    ValueError
        No image is in both, or no two of them show the same points.
    """
    images, ideal, uv, shown = _seen(found, truth, xyz, seen)
    parallax = [
        vertical_parallax(ideal[a], ideal[b], uv[a][both], uv[b][both])
        for a, b in combinations(range(len(images)), 2)
        if images[a][1].axis @ images[b][1].axis >= np.cos(np.radians(most_axes_deg))
        and (both := shown[a] & shown[b]).sum() >= LEAST_COMMON
        and not np.array_equal(images[a][0].centre, images[b][0].centre)
    ]
    if not parallax:
        raise ValueError("no two images of the block show the same points")
    off = np.abs(np.concatenate(parallax))
    place = _places(ideal, uv, shown)
    error = (place - xyz)[np.isfinite(place).all(axis=1)]
    return BlockFigures(
        len(parallax), _rms(off), float(np.median(off)), float(np.percentile(off, 95)), len(error),
        _rms(np.hypot(error[:, 0], error[:, 1])), _rms(error[:, 2]),
    )  # fmt: skip


def whole_error(found: Sequence[OrientedImage], truth: Sequence[OrientedImage], xyz: FloatArray) -> Similarity:
    """What a block is off by as a whole: the similarity from true points to where its rays meet; arguments as in `block_figures`.

    Raises
    ------
    ValueError
        Two images show fewer than three common points.
    """
    _, ideal, uv, shown = _seen(found, truth, xyz, None)
    place = _places(ideal, uv, shown)
    known = np.isfinite(place).all(axis=1)
    return similarity_between(xyz[known], place[known])


def _seen(
    found: Sequence[OrientedImage], truth: Sequence[OrientedImage], xyz: FloatArray, seen: BoolArray | None
) -> tuple[list[tuple[OrientedImage, OrientedImage]], list[OrientedImage], FloatArray, BoolArray]:
    """Images that both have, found and true; the found ones without lenses; (N, P, 2) where these show the points; (N, P) whether they do."""
    by_name = {i.name: i for i in found}
    kept = [k for k, t in enumerate(truth) if t.name in by_name]
    images = [(by_name[truth[k].name], truth[k]) for k in kept]
    shown = np.array([_in_frame(t, xyz) for _, t in images]).reshape(len(images), len(xyz))
    # lenses are undone once, not for each pair
    uv = np.array([_without_lens(f, t, xyz, own) for (f, t), own in zip(images, shown, strict=True)])
    ideal = [replace(f, camera=f.camera.pinhole) for f, _ in images]
    return images, ideal, uv, shown if seen is None else shown & seen[kept]


def _without_lens(found: OrientedImage, true: OrientedImage, xyz: FloatArray, shown: BoolArray) -> FloatArray:
    """(P, 2) where points lie in the picture, as a camera without distortion has them; NaN where they are not shown."""
    uv = np.full((len(xyz), 2), np.nan)
    uv[shown] = found.camera.pinhole.distort(found.camera.undistort(true.project(xyz[shown])[0]))
    return uv


def _in_frame(image: OrientedImage, xyz: FloatArray) -> BoolArray:
    uv, depth = image.project(xyz)
    return image.holds(uv) & (depth > 0)


def _places(images: Sequence[OrientedImage], uv: FloatArray, shown: BoolArray) -> FloatArray:
    image, point = np.nonzero(shown)
    found = np.full((shown.shape[1], 3), np.nan)
    met = intersections(images, point, image, uv[image, point])
    found[: len(met)] = met
    return found


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")

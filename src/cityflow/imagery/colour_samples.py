"""Brightness of common ground points in several images: logarithms of colours, summed up per pair of images.

Colours are means over some pixels, so that small errors of heights and poses do not matter; medians over many points take no notice of those that are
hidden in one of the two images, of cars and of shadows that have moved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field
from scipy.sparse import csr_array, triu

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.parameters import Parameters
from cityflow.core.pixels import Pixels, level_shape

WINDOW_PX = 1024
"""Pixels are read in windows of this edge; no result depends on it."""


class SampleParameters(Parameters):
    """How colours are compared."""

    level: int = Field(
        4, ge=0, le=10, description="pyramid level of the samples: each is the mean of 2**level pixels squared"
    )
    darkest_share: float = Field(0.02, ge=0, lt=0.5, description="darker samples say nothing, share of the white level")
    brightest_share: float = Field(
        0.97, gt=0.5, le=1, description="brighter samples may be saturated, share of the white level"
    )
    least_points: int = Field(12, ge=3, description="a pair of images with fewer common points is not used")
    partners: int = Field(
        12, ge=1, description="an image is compared with so many others, those with most common points"
    )
    bins: int = Field(
        3, ge=1, le=9, description="the points of a pair are summed up in up to so many classes of brightness"
    )
    class_points: int = Field(6, ge=1, description="a class of brightness has at least so many points")


@dataclass(frozen=True, slots=True)
class PointColours:
    """What one image shows at points.

    Attributes
    ----------
    point : (K,) int64, numbers of the points, rising
    log_colour : (K, bands) float32, natural logarithm of the share of the greatest value
    radius2 : (K,) float32, squared distance from the middle of the image over half its diagonal
    burnt : int64, numbers of further points, rising, that are so bright that they may be saturated
    """

    point: IntArray
    log_colour: FloatArray
    radius2: FloatArray
    burnt: IntArray


@dataclass(frozen=True, slots=True)
class PairSamples:
    """Medians over common points of two images; several rows a pair, one per class of brightness.

    Attributes
    ----------
    first, second : (M,) int64, numbers of the images
    log_first, log_second : (M, bands) logarithms of colours;  radius2_first, radius2_second : (M,)
    count : (M,) points;  spread : (M, bands) 1.4826 times the median absolute deviation of the logarithm of the ratio
    """

    first: IntArray
    second: IntArray
    log_first: FloatArray
    log_second: FloatArray
    radius2_first: FloatArray
    radius2_second: FloatArray
    count: IntArray
    spread: FloatArray

    def __len__(self) -> int:
        return len(self.first)


def point_colours(
    image: OrientedImage,
    pixels: Pixels,
    xyz: FloatArray,
    parameters: SampleParameters | None = None,
    white: float = 0.0,
) -> PointColours:
    """Colours of those of (N, 3) world points, metres, that the image shows well exposed. Whether they are hidden is not asked.

    `white`: the value that is shown as white; 0: the dtype's greatest.
    """
    asked = parameters or SampleParameters()
    uv, depth = image.project(xyz)
    shown = np.flatnonzero((depth > 0) & image.holds(uv, float(1 << asked.level)))
    top = float(np.iinfo(pixels.dtype).max)
    share, level = _at(pixels, uv[shown], asked.level) / top, (white or top) / top
    burnt = np.any(share > asked.brightest_share * level, axis=1)
    good = np.all(share >= asked.darkest_share * level, axis=1) & ~burnt
    half = np.array([image.camera.width, image.camera.height]) / 2.0
    radius2 = np.sum((uv[shown] - half) ** 2, axis=1) / np.sum(half**2)
    return PointColours(shown[good], np.log(share[good]), radius2[good], shown[burnt])


def pair_samples(seen: Sequence[PointColours], parameters: SampleParameters | None = None) -> PairSamples:
    """Compare images two by two, each with those it shares most points with."""
    asked = parameters or SampleParameters()
    rows = [_pair_rows(i, j, seen[i], seen[j], asked) for i, j in _pairs(seen, asked)]
    bands = seen[0].log_colour.shape[1] if seen else 1
    empty = (np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, bands)), np.empty((0, bands)), np.empty(0),
             np.empty(0), np.empty(0, np.int64), np.empty((0, bands)))  # fmt: skip
    return PairSamples(*(np.concatenate(column) for column in zip(empty, *rows, strict=True)))


def _pairs(seen: Sequence[PointColours], asked: SampleParameters) -> list[tuple[int, int]]:
    image = np.repeat(np.arange(len(seen)), [len(s.point) for s in seen])
    point = np.concatenate([s.point for s in seen]) if len(seen) else np.empty(0, np.int64)
    holds = csr_array((np.ones(len(point), np.int32), (image, point)), shape=(len(seen), int(point.max(initial=0)) + 1))
    common = triu(holds @ holds.T, k=1).tocoo()
    enough = common.data >= asked.least_points
    i, j, n = common.row[enough], common.col[enough], common.data[enough]
    # both images' own ranking counts, so that an image which nobody prefers is tied to the rest all the same
    order = np.lexsort((np.concatenate([j, i]), -np.concatenate([n, n]), np.concatenate([i, j])))
    owner, other = np.concatenate([i, j])[order], np.concatenate([j, i])[order]
    rank = np.arange(len(owner)) - np.searchsorted(owner, owner)
    kept = rank < asked.partners
    low, high = np.minimum(owner, other)[kept], np.maximum(owner, other)[kept]
    return [(int(a), int(b)) for a, b in np.unique(np.column_stack([low, high]), axis=0)]


def _pair_rows(i: int, j: int, a: PointColours, b: PointColours, asked: SampleParameters) -> tuple[np.ndarray, ...]:
    _, at_a, at_b = np.intersect1d(a.point, b.point, assume_unique=True, return_indices=True)
    la, lb = a.log_colour[at_a], b.log_colour[at_b]
    groups = _classes((la + lb).mean(axis=1), a.radius2[at_a] - b.radius2[at_b], asked)
    ratio, bands = la - lb, la.shape[1]
    every = np.column_stack([ratio, (la + lb), a.radius2[at_a], b.radius2[at_b]])
    medians = np.array([_median(every[g]) for g in groups]).reshape(len(groups), 2 * bands + 2)
    middle, level = medians[:, :bands], medians[:, bands : 2 * bands] / 2
    return (
        np.full(len(groups), i), np.full(len(groups), j), level + middle / 2, level - middle / 2,
        medians[:, -2], medians[:, -1], np.array([len(g) for g in groups]),
        np.array([1.4826 * _median(np.abs(ratio[g] - m)) for g, m in zip(groups, middle, strict=True)]),
    )  # fmt: skip


def _median(columns: FloatArray) -> FloatArray:
    """(columns,) as `np.median`, which takes ten times as long for so few rows."""
    ordered, count = np.sort(columns, axis=0), len(columns)
    return np.asarray((ordered[(count - 1) // 2] + ordered[count // 2]) / 2)


def _classes(light: FloatArray, off_centre: FloatArray, asked: SampleParameters) -> list[IntArray]:
    """Points nearer the middle of the one image or of the other, each by brightness: both a curve and a fall-off show between classes."""
    bins = int(np.clip(len(light) // (2 * asked.class_points), 1, asked.bins))
    sides = np.array_split(np.argsort(off_centre, kind="stable"), 2)
    return [g for side in sides for g in np.array_split(side[np.argsort(light[side], kind="stable")], bins) if len(g)]


def _at(pixels: Pixels, uv: FloatArray, level: int) -> FloatArray:
    """(K, bands) pixels of a level that hold level-0 image coordinates, read in a few large windows."""
    tall, wide = level_shape(pixels.height, pixels.width, level)
    rows = np.clip((uv[:, 1] / (1 << level)).astype(np.int64), 0, tall - 1)
    cols = np.clip((uv[:, 0] / (1 << level)).astype(np.int64), 0, wide - 1)
    out = np.zeros((len(uv), pixels.bands))
    for r in range(0, tall, WINDOW_PX):
        for c in range(0, wide, WINDOW_PX):
            inside = np.flatnonzero((rows // WINDOW_PX == r // WINDOW_PX) & (cols // WINDOW_PX == c // WINDOW_PX))
            if len(inside):
                window = pixels.window((r, min(r + WINDOW_PX, tall)), (c, min(c + WINDOW_PX, wide)), level)
                out[inside] = window[rows[inside] - r, cols[inside] - c]
    return out

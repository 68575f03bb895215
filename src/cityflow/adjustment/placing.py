"""Place, direction and scale of a mapped model: from positions of its images, from control points, or level and of a stated size where nothing is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from cityflow.adjustment.block import Block
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import triangulated
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.control_points import ControlPoint
from cityflow.geometry.similarity import Similarity, similarity_between

TRIPLES = 400
"""Of points that are tried; of more, evenly chosen ones; set by hand, as are those below."""
OUTLYING = 4.0
"""Points further off than so many times what most are, do not belong."""
CLEARLY = 4.0
"""A finding about control points must make the residuals so many times smaller."""
LEAST_WIDTH = 0.02
"""Places whose second extent is a smaller share of the first lie on a line: the rotation about it stays open."""
GROUND_PERCENT = 10.0
"""Of the tie points' heights: most of what lies lower is a mistake."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A similarity; `used`: (N,) which points it was fitted to; `residuals`: (N, 3) moved points less targets, metres."""

    similarity: Similarity
    used: BoolArray
    residuals: FloatArray

    @property
    def rms(self) -> float:
        """Per axis, over the points that were used, metres."""
        return float(np.sqrt(np.mean(self.residuals[self.used] ** 2)))


@dataclass(frozen=True, slots=True)
class ControlFit:
    """As `Fit`, of control points: `exchanged` names two whose coordinates are each other's, `wrong` those that contradict the others."""

    fit: Fit
    exchanged: tuple[str, str] | None
    wrong: tuple[str, ...]


def is_line(points: FloatArray) -> bool:
    """Whether (N, 3) points lie on a line, as those of a single strip do."""
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extents[1] < LEAST_WIDTH * max(extents[0], 1e-300))


def robust_fit(source: FloatArray, target: FloatArray, least_m: float) -> Fit:
    """The similarity that most of the points agree with.

    Parameters
    ----------
    source, target : (N, 3);  least_m : points nearer than this are never left out

    Raises
    ------
    ValueError
        Fewer than three points, or all on one line.
    """
    best = similarity_between(source, target)
    least = np.inf
    for chosen in _triples(len(source)):
        try:
            tried = similarity_between(source[chosen], target[chosen])
        except ValueError:
            continue
        middle = float(np.median(np.linalg.norm(tried.moved(source) - target, axis=1)))
        if tried.scale > 0 and middle < least:
            best, least = tried, middle
    used = np.ones(len(source), bool)
    for _ in range(5):
        away = np.linalg.norm(best.moved(source) - target, axis=1)
        kept = away <= max(OUTLYING * float(np.median(away)), least_m)
        try:
            best = similarity_between(source[kept], target[kept])
        except ValueError:
            break
        used = kept
    return Fit(best, used, best.moved(source) - target)


def _triples(count: int) -> list[list[int]]:
    """Numbers of three points each: all, or evenly spread ones."""
    if count <= 14:
        return [list(t) for t in combinations(range(count), 3)]
    rng = np.random.default_rng(1)
    return [sorted(rng.choice(count, 3, replace=False).tolist()) for _ in range(TRIPLES)]


def seen_places(images: Sequence[OrientedImage], points: Sequence[ControlPoint]) -> FloatArray:
    """(N, 3) where the images have marked points, in the frame of the images; NaN where fewer than two of them show one."""
    number = {image.name: k for k, image in enumerate(images)}
    rows = [
        (p, number[m.image], m.col, m.row) for p, point in enumerate(points) for m in point.marks if m.image in number
    ]
    places = np.full((len(points), 3), np.nan)
    if not rows:
        return places
    table = np.array(sorted(rows), np.float64)
    ties = Ties(
        table[:, 0].astype(np.int64),
        table[:, 1].astype(np.int64),
        np.arange(len(table)),
        table[:, 2:],
        np.ones(len(table)),
    )
    kept = np.bincount(ties.point, minlength=len(points)) >= 2
    if kept.any():
        # numbered without gaps, as `some` does it
        places[kept] = triangulated(Block.of(images, np.zeros(3)), ties.of_points(kept)).xyz
    return places


def control_fit(places: FloatArray, points: Sequence[ControlPoint], least_m: float) -> ControlFit:
    """The similarity onto control points; two that are exchanged, or single ones that contradict all others, are found and left out.

    Parameters
    ----------
    places : (N, 3) of the same points in the model, all known
    least_m : residuals below this are no contradiction

    Raises
    ------
    ValueError
        Fewer than three points, or all on one line.
    """
    target = np.array([p.xyz for p in points])
    fit = _fit(places, target, np.ones(len(points), bool))
    if fit.rms <= least_m or len(points) < 4:
        return ControlFit(fit, None, ())
    swaps = []
    for i, k in combinations(range(len(points)), 2):
        order = np.arange(len(points))
        order[[i, k]] = k, i
        swaps.append((_fit(places, target[order], np.ones(len(points), bool)).rms, i, k))
    best, i, k = min(swaps)
    if best < fit.rms / CLEARLY and best < _best_without_one(places, target)[0]:
        used = np.ones(len(points), bool)
        used[[i, k]] = False
        enough = used.sum() >= 3
        order = np.arange(len(points))
        order[[i, k]] = k, i
        right = _fit(places, target, used) if enough else _fit(places, target[order], ~used | used)
        right = replace(right, residuals=right.similarity.moved(places) - target, used=used)
        return ControlFit(right, (points[i].name, points[k].name), ())
    used, wrong = np.ones(len(points), bool), []
    while used.sum() >= 5 and fit.rms > least_m:
        rms, out = _best_without_one(places[used], target[used])
        if rms > fit.rms / CLEARLY:
            break
        number = int(np.flatnonzero(used)[out])
        used[number] = False
        wrong.append(points[number].name)
        fit = _fit(places, target, used)
    return ControlFit(fit, None, tuple(sorted(wrong)))


def _fit(source: FloatArray, target: FloatArray, used: BoolArray) -> Fit:
    similarity = similarity_between(source[used], target[used])
    return Fit(similarity, used, similarity.moved(source) - target)


def _best_without_one(source: FloatArray, target: FloatArray) -> tuple[float, int]:
    """Residuals without the point that contradicts most, and its number; infinite where too few would be left to tell."""
    if len(source) < 5:
        return np.inf, -1
    every = np.arange(len(source))
    return min(
        (_fit(source[every != k], target[every != k], np.ones(len(source) - 1, bool)).rms, k) for k in every.tolist()
    )


def levelled(images: Sequence[OrientedImage], xyz: FloatArray, height_m: float) -> Similarity:
    """A frame whose ground is level at height 0, over which the images were taken at `height_m` in the median; its origin lies under their middle.

    Parameters
    ----------
    xyz : (P, 3) tie points
    """
    centres = np.array([i.centre for i in images])
    middle = np.median(xyz, axis=0)
    kept = np.ones(len(xyz), bool)
    up = np.array([0.0, 0.0, 1.0])
    for _ in range(6):
        up = np.linalg.svd(xyz[kept] - xyz[kept].mean(axis=0), full_matrices=False)[2][2]
        away = np.abs((xyz - xyz[kept].mean(axis=0)) @ up)
        kept = away <= max(2.0 * float(np.median(away)), 1e-12)
    if np.median((centres - middle) @ up) < 0:
        up = -up
    ahead = np.linalg.svd(centres - centres.mean(axis=0), full_matrices=False)[2][0]
    ahead = ahead - (ahead @ up) * up
    ahead /= np.linalg.norm(ahead)
    ahead *= 1.0 if ahead[np.argmax(np.abs(ahead))] > 0 else -1.0
    rotation = np.stack([ahead, np.cross(up, ahead), up])
    heights = xyz @ up
    ground = float(np.percentile(heights, GROUND_PERCENT))
    scale = height_m / (float(np.median(centres @ up)) - ground)
    under = rotation @ centres.mean(axis=0)
    return Similarity(scale, rotation, -scale * np.array([under[0], under[1], ground]))


def placed(images: Sequence[OrientedImage], similarity: Similarity) -> tuple[OrientedImage, ...]:
    """The images in the frame that the similarity leads to."""
    return tuple(
        replace(i, rotation=i.rotation @ similarity.rotation.T, centre=similarity.moved(i.centre[None])[0])
        for i in images
    )

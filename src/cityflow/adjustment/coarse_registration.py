"""Where a patch of tie points may lie over a reference: height images are compared over all shifts, and a range of directions and scales."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pydantic import Field
from scipy.fft import irfft2, next_fast_len, rfft2

from cityflow.adjustment.block import rotation_of
from cityflow.adjustment.height_images import HeightImage, height_image, is_raised
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.parameters import Parameters
from cityflow.geometry.similarity import Similarity

CELL_M, WIDE_CELL_M, MOST_CELLS = 1.0, 2.0, 768
"""Of height images; where many directions are tried; along the longer side of the reference; set by hand, as are those below."""
WIDE_DEG = 60.0
"""Directions to each side that are many."""
PATCH_M = 100.0
"""Radius of the patch that is looked for: directions and scales of more ground would have to be tried in finer steps."""
SLACK_M = 2.5
"""At the rim of the patch, half a step of directions or scales moves points by this."""
LEAST_SHARE, FULL_SHARE = 0.3, 0.7
"""Of the patch's cells, as far as the reference is as large, so many must lie over it; from so many on they count in full."""
PEAKS, APART_M = 4, 5.0
"""Places that are kept for each direction and scale, and how far they lie apart."""
CANDIDATES = 6
"""Places that are kept of all."""
MOST_TILT = 0.2
"""Of the ground against that of the reference, metres per metre; steeper fits are no ground."""


@dataclass(frozen=True, slots=True)
class Search:
    """How far the given place may be off: `yaw_deg` to each side (180: any direction), `scale` by this factor (1: known), `shift_m` (inf: anywhere)."""

    yaw_deg: float
    scale: float
    shift_m: float


OF_A_BLOCK = Search(15.0, 1.05, 30.0)
"""Oriented images that are off as a whole; set by hand, as are those below."""
BY_GNSS = Search(25.0, 1.15, 60.0)
"""Photographs placed by GNSS positions of a few metres, perhaps along one strip."""
BY_SCALE, BY_NOTHING = Search(180.0, 1.25, float("inf")), Search(180.0, 4.0, float("inf"))
"""Photographs of which the height over the ground is known, or nothing."""


class RegistrationParameters(Parameters):
    """How far photographs may be off the survey that they are registered to."""

    shift_m: float | None = Field(
        None, gt=0, le=1e6, description="in plan, metres; null: by how their place is known (docs/orient.md)"
    )
    turn_deg: float | None = Field(
        None, gt=0, le=180, description="about the vertical, degrees to each side; null: by how their place is known"
    )
    scale: float | None = Field(
        None, ge=1, le=10, description="size, by this factor at most; null: by how their place is known"
    )

    def search(self, usual: Search) -> Search:
        """`usual`, but for what is stated."""
        return Search(
            usual.yaw_deg if self.turn_deg is None else self.turn_deg,
            usual.scale if self.scale is None else self.scale,
            usual.shift_m if self.shift_m is None else self.shift_m,
        )


@dataclass(frozen=True, slots=True)
class Candidate:
    """A place; `score`: correlation of the height images, at most 1."""

    similarity: Similarity
    score: float


@dataclass(frozen=True, slots=True)
class Patch:
    """The tie points that are looked for.

    Attributes
    ----------
    chosen : (N,) which of the tie points;  middle : (3,)
    radius : metres
    """

    chosen: BoolArray
    middle: FloatArray
    radius: float


def cell_of(extent_m: float, search: Search) -> float:
    """Cell of height images for a reference of that extent, metres."""
    return max(WIDE_CELL_M if search.yaw_deg > WIDE_DEG else CELL_M, extent_m / MOST_CELLS)


def patch_of(xyz: FloatArray, ground: FloatArray, near: BoolArray) -> Patch:
    """Tie points about the middle of what stands over the ground, of those that may lie over the reference."""
    raised = is_raised(xyz, ground) & near
    own = xyz[raised if raised.any() else near]
    middle = np.median(own, axis=0)
    away = np.hypot(*(xyz[:, :2] - middle[:2]).T)
    chosen = near & (away <= PATCH_M)
    return Patch(chosen, middle, max(float(away[chosen].max()), 10.0) if chosen.any() else PATCH_M)


def candidates(
    xyz: FloatArray, ground: FloatArray, patch: Patch, reference: HeightImage, search: Search
) -> list[Candidate]:
    """The best places, the best first.

    Parameters
    ----------
    xyz : (N, 3) tie points;  ground : (N,) under each
    """
    own, level = xyz[patch.chosen] - patch.middle, ground[patch.chosen]
    matcher = _Matcher(reference, patch.radius * search.scale)
    found: list[Candidate] = []
    for turn, scale in _tried(search, patch.radius):
        cosine, sine = np.cos(turn), np.sin(turn)
        rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        moved = scale * own @ rotation.T
        image = height_image(moved, scale * (level - patch.middle[2]), reference.cell, highest=False)
        for shift, score in matcher.peaks(image, patch.middle[:2], search.shift_m):
            found.append(Candidate(Similarity.about(patch.middle, scale, rotation, np.array([*shift, 0.0])), score))
    kept: list[Candidate] = []
    corners = patch.middle + patch.radius / 2 * np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]])
    for each in sorted(found, key=lambda c: -c.score):
        places = each.similarity.moved(corners)
        if all(_distance(places, k.similarity.moved(corners)) > APART_M for k in kept):
            kept.append(each)
            if len(kept) == CANDIDATES:
                break
    return [Candidate(_on_the_ground(c.similarity, xyz, ground, patch, reference), c.score) for c in kept]


def _distance(one: FloatArray, other: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum((one - other) ** 2, axis=1))))


def _tried(search: Search, radius: float) -> Iterator[tuple[float, float]]:
    """Directions and scales, so close that half a step moves the rim by `SLACK_M`."""
    step = 2.0 * SLACK_M / radius
    most = np.radians(min(search.yaw_deg, 180.0))
    count = int(np.ceil(most / step))
    turns = np.linspace(-most, most, 2 * count + 1)
    if search.yaw_deg >= 180.0:
        turns = turns[:-1]
    times = int(np.ceil(np.log(search.scale) / step))
    scales = np.exp(np.linspace(-np.log(search.scale), np.log(search.scale), 2 * times + 1)) if times else np.ones(1)
    for scale in scales.tolist():
        for turn in turns.tolist():
            yield turn, scale


class _Matcher:
    """Correlation with the reference over all shifts, of the cells that both have (Padfield 2012)."""

    def __init__(self, reference: HeightImage, radius: float) -> None:
        self._reference = reference
        rows, cols = reference.values.shape
        more = 2 * int(np.ceil(radius * np.sqrt(2) / reference.cell)) + 4
        self._known_m2 = float(np.isfinite(reference.values).sum()) * reference.cell**2
        self._shape = next_fast_len(rows + more, real=True), next_fast_len(cols + more, real=True)
        known = np.isfinite(reference.values)
        values = np.where(known, reference.values, 0.0)
        self._known, self._values, self._squares = (self._spectrum(v) for v in (known.astype(float), values, values**2))

    def _spectrum(self, values: FloatArray) -> FloatArray:
        # single precision halves the time; what is counted and squared stays below 1e7
        return np.asarray(rfft2(values.astype(np.float32), self._shape))

    def peaks(self, image: HeightImage, middle: FloatArray, most_m: float) -> Iterator[tuple[FloatArray, float]]:
        """(2,) shifts of the patch's middle, metres, and their scores; `image` has that middle as its origin."""
        reference, known = self._reference, np.isfinite(image.values)
        values = np.where(known, image.values, 0.0)
        mask, own, squares = (np.conj(self._spectrum(v)) for v in (known.astype(float), values, values**2))
        count, theirs, ours, theirs2, ours2, product = (
            irfft2(a * b, self._shape)
            for a, b in (
                (self._known, mask), (self._values, mask), (self._known, own), (self._squares, mask), (self._known, squares), (self._values, own)
            )
        )  # fmt: skip
        possible = float(known.sum()) * min(1.0, self._known_m2 / (known.size * reference.cell**2))
        enough = count >= max(LEAST_SHARE * possible, 20.0)
        n = np.maximum(count, 1.0)
        spread = np.maximum(theirs2 - theirs**2 / n, 1e-6) * np.maximum(ours2 - ours**2 / n, 1e-6)
        share = np.sqrt(np.clip(count / max(FULL_SHARE * possible, 1.0), 0.0, 1.0))
        score = np.where(enough, (product - theirs * ours / n) / np.sqrt(spread) * share, -1.0)
        rows, cols = (
            np.where(np.arange(m) >= r, np.arange(m) - m, np.arange(m))
            for m, r in zip(self._shape, reference.values.shape, strict=True)
        )
        x = reference.x_min - image.x_min + cols * reference.cell - middle[0]
        y = reference.y_min - image.y_min + rows * reference.cell - middle[1]
        if np.isfinite(most_m):
            score = np.where(np.hypot(x[None, :], y[:, None]) <= most_m, score, -1.0)
        reach = int(APART_M / reference.cell)
        for _ in range(PEAKS):
            row, col = np.unravel_index(int(np.argmax(score)), score.shape)
            best = float(score[row, col])
            if best <= 0.0:
                return
            yield np.array([x[col], y[row]]), best
            score[
                np.ix_(
                    np.arange(row - reach, row + reach + 1) % score.shape[0],
                    np.arange(col - reach, col + reach + 1) % score.shape[1],
                )
            ] = -1.0


def _on_the_ground(
    by: Similarity, xyz: FloatArray, ground: FloatArray, patch: Patch, reference: HeightImage
) -> Similarity:
    """With height and tilt, so that the ground of the patch lies on that of the reference."""
    own = np.column_stack([xyz[patch.chosen, :2], ground[patch.chosen]])
    moved = by.moved(own)
    rise = reference.at(reference.ground, moved[:, :2]) - moved[:, 2]
    seen = np.isfinite(rise)
    middle = by.moved(patch.middle[None])[0]
    if seen.sum() < 10:
        return by
    off, rise = moved[seen, :2] - middle[:2], rise[seen]
    plane = np.array([float(np.median(rise)), 0.0, 0.0])
    table = np.column_stack([np.ones(len(off)), off])
    for _ in range(20):
        weight = 1.0 / np.maximum(np.abs(rise - table @ plane), 0.05)
        plane = np.linalg.lstsq(table * np.sqrt(weight)[:, None], rise * np.sqrt(weight), rcond=None)[0]
    if np.hypot(plane[1], plane[2]) > MOST_TILT:
        plane = np.array([float(np.median(rise)), 0.0, 0.0])
    tilt = rotation_of(np.array([[plane[2], -plane[1], 0.0]]))[0]
    more = Similarity.about(middle, 1.0, tilt, np.array([0.0, 0.0, plane[0]]))
    return Similarity(by.scale, more.rotation @ by.rotation, more.moved(by.shift[None])[0])

"""Consistency of depth maps: depths that agree count for a depth, greater depths behind it count against it.

A point that matching has put into the air costs nothing in its own pair: one partner alone may take one piece of grass for another. Images from
other sides see the ground behind it. So each depth is held against the depth maps of all other images that look at its place. Each of their words
weighs as many partners as agree on it. A depth with more words against it than for it is refuted; with as many, if one partner alone has seen it. What
stands in front of a point only hides it and says nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from cityflow.core.arrays import ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import DepthMap, numbers_within, world_points
from cityflow.core.grid import Bounds
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.surface.witness_views import Boxes, View, in_view, may_see, run_boxes, view_of

MOST_WORDS = 255
"""The largest byte."""
AGREEMENT_SIGMAS = 1.0
"""Depths agree within so many of their common expected standard deviations. These are of single disparities before smoothing, doubled for a lone partner:
depth maps that see the same differ by 0.1 of them in the median (towns), by 0.3 to 0.7 (photographs). With three, a roof that is drawn out by half a metre
over the ground agrees with the wall behind it."""
AGREEMENT_GSD = 3.0
"""And so many ground pixels, since a slope falls within a pixel; set by hand."""

Window = tuple[int, int, int, int]
"""Level-0 row and column of the upper left pixel of a depth map, its rows and its columns."""

SURELY = 0.999999
"""What is nearer to a limit than this is computed in full: far more than float32 rounds."""


class WitnessParameters(Parameters):
    """When two depth maps see the same, and how far a witness may look past a point."""

    reach_m: float = Field(
        40.0,
        ge=0,
        le=500,
        description="largest distance in plan between a point and that of a witness along its ray, metres",
    )


@dataclass(frozen=True, slots=True)
class Witness:
    """All depths of one reference image that are at hand.

    Attributes
    ----------
    image : its orientation
    row, col : level-0 pixel of the rasters' upper left corner
    depth, sigma : (h, w) float32, as in `DepthMap`, metres;  views : (h, w) uint8
    exact : each depth has a standard deviation of 0 or more
    """

    image: OrientedImage
    row: int
    col: int
    depth: Float32Array
    sigma: Float32Array
    views: ByteArray
    exact: bool

    @classmethod
    def of(cls, image: OrientedImage, parts: Sequence[DepthMap]) -> Witness:
        """From the depth maps of one image over several tiles, which have no pixel in common."""
        top, left = min(m.row for m in parts), min(m.col for m in parts)
        shape = (
            max(m.row + m.depth.shape[0] for m in parts) - top,
            max(m.col + m.depth.shape[1] for m in parts) - left,
        )
        depth, sigma = np.full(shape, np.nan, np.float32), np.full(shape, np.nan, np.float32)
        views = np.zeros(shape, np.uint8)
        for m in parts:
            known = np.isfinite(m.depth)
            at = np.s_[m.row - top : m.row - top + known.shape[0], m.col - left : m.col - left + known.shape[1]]
            for whole, part in ((depth, m.depth), (sigma, m.sigma), (views, m.views)):
                np.copyto(whole[at], part, where=known)
        return cls(image, top, left, depth, sigma, views, bool(np.all((sigma >= 0) | np.isnan(depth))))


@dataclass(frozen=True, slots=True)
class Words:
    """Votes for the depths of one image.

    Attributes
    ----------
    row, col : as in `Witness`
    count : (h, w) uint8, partners that agree, of its own depth map and of all that see the place alike, less those that look through it;
        0 where the depth is refuted, unknown, or was not asked about
    """

    row: int
    col: int
    count: ByteArray

    def over(self, window: Window) -> ByteArray:
        """(h, w) those for a depth map of the image, which lies within."""
        row, col, height, width = window
        row, col = row - self.row, col - self.col
        return np.ascontiguousarray(self.count[row : row + height, col : col + width])


@dataclass(frozen=True, slots=True)
class _Asked:
    """Points of one depth map: (N,) flat pixel, (N, 3) world metres, (N,) sigma; and boxes of runs of them."""

    pixel: IntArray
    xyz: FloatArray
    sigma: Float32Array
    boxes: Boxes


def words_for(witnesses: Sequence[Witness], around: Bounds, parameters: WitnessParameters) -> dict[str, Words]:
    """Number of votes for each depth, by image.

    Parameters
    ----------
    witnesses : one for each image, in any order, with all depths within `reach_m` of `around`
    around : only depths whose points stand here are asked about
    """
    views = [view_of(w.image, (w.row, w.col), w.depth.shape) for w in witnesses]
    found = ((w, _points(w, around)) for w in witnesses)
    return {w.image.name: Words(w.row, w.col, _words(w, points, witnesses, views, parameters)) for w, points in found}


def _words(
    own: Witness, asked: _Asked, witnesses: Sequence[Witness], views: Sequence[View], p: WitnessParameters
) -> ByteArray:
    speaking = own.views.ravel()[asked.pixel].astype(np.int64)
    for k in np.flatnonzero(may_see(views, asked.boxes)).tolist():
        if witnesses[k].image.name != own.image.name:
            _hear(asked, witnesses[k], views[k], p, speaking)
    # as many for as against: what several partners have agreed on stays, what one alone has said goes
    undecided = (speaking == 0) & (own.views.ravel()[asked.pixel] > 1)
    words = np.zeros(own.depth.size, np.uint8)
    words[asked.pixel] = np.clip(np.where(undecided, 1, speaking), 0, MOST_WORDS)
    return words.reshape(own.depth.shape)


def _points(own: Witness, around: Bounds) -> _Asked:
    pixel, xyz = world_points(own.depth, (own.row, own.col), own.image)
    inside = numbers_within(xyz, around)
    pixel, xyz = pixel.take(inside), xyz.take(inside, axis=0)
    return _Asked(pixel, xyz, own.sigma.ravel()[pixel], run_boxes(xyz))


def _hear(asked: _Asked, other: Witness, view: View, p: WitnessParameters, speaking: IntArray) -> None:
    """Add to `speaking` (N,) the words of another image for the points, and take those against them away."""
    image = other.image
    at, normal, depth, aside = in_view(asked.xyz, asked.boxes, view)
    if not len(at):
        return
    camera = image.camera
    lens = (camera.fx, camera.fy, camera.cx, camera.cy) if camera.is_pinhole else (1.0, 1.0, 0.0, 0.0)
    places = normal if camera.is_pinhole else camera.distort(normal)
    gsd = AGREEMENT_GSD / camera.fx
    rasters = (other.depth, other.sigma, other.views, other.exact)
    limits = (AGREEMENT_SIGMAS, gsd, p.reach_m)
    _weigh((places, depth, aside), (*lens, other.row, other.col), asked.sigma, rasters, limits, at, speaking)


@njit(cache=True, nogil=True)
def _weigh(points, lens, sigma, rasters, limits, at, speaking):  # type: ignore[no-untyped-def]
    """A witness looks through a point where it is seen further off in the point's pixel and all around it that are known.

    Mostly all nine pixels are alike, behind or before beyond any doubt of rounding: that is seen by their extremes, without a branch for each.
    `points` are the places, depths, and distances in plan of those in view, `at` their rows in `sigma` and `speaking`. `lens` leads from places to
    image coordinates: focal lengths, principal point, and the pixel where the rasters begin.
    """
    places, depth, aside = points
    fx, fy, cx, cy, top, left = lens
    their_depth, their_sigma, their_views, exact = rasters
    sigmas, gsd, reach = limits
    rows, cols = their_depth.shape
    for i in range(len(at)):
        r, c = int(np.floor(fy * places[i, 1] + cy - top)), int(np.floor(fx * places[i, 0] + cx - left))
        if r < 0 or c < 0 or r >= rows or c >= cols or np.isnan(their_depth[r, c]):
            continue
        if 0 < r < rows - 1 and 0 < c < cols - 1:
            low, high, rough, most = np.float32(np.inf), np.float32(-np.inf), np.float32(-np.inf), np.uint8(0)
            for k in range(3):
                for m in range(3):
                    z, s = their_depth[r + k - 1, c + m - 1], their_sigma[r + k - 1, c + m - 1]
                    v = their_views[r + k - 1, c + m - 1]
                    low, high = z if z < low else low, z if z > high else high
                    rough, most = s if s > rough else rough, v if v > most else most
            far, room, own = depth[i], gsd * depth[i], sigma[at[i]]
            clear = (sigmas * (rough + own) + room) / SURELY
            if far - high > clear:
                continue
            off = max(high - far, far - low)
            if exact and own >= 0.0 and off * aside[i] <= SURELY * reach * far:
                if off <= room and most > 0:
                    speaking[at[i]] += int(most)
                    continue
                if low - far > clear:
                    speaking[at[i]] -= int(their_views[r, c])
                    continue
        speaking[at[i]] += _word(r, c, (depth[i], aside[i], sigma[at[i]]), rasters, limits)


@njit(cache=True, nogil=True)
def _word(r, c, point, rasters, limits):  # type: ignore[no-untyped-def]
    """The most partners of those of the nine pixels that are alike; else those of the pixel itself as a negative number, or 0 where something stands before."""
    depth, sigma, views, _ = rasters
    far, aside, own = point
    sigmas, gsd, reach = limits
    alike, before, known = 0, False, False
    for k in range(max(r - 1, 0), min(r + 2, depth.shape[0])):
        for m in range(max(c - 1, 0), min(c + 2, depth.shape[1])):
            z = depth[k, m]
            # further off than the reach another tile would not know of it
            if np.isnan(z) or abs(z / far - 1.0) * aside > reach:
                continue
            known = known or (k == r and m == c)
            near = sigmas * np.sqrt(sigma[k, m] ** 2 + own**2) + gsd * far
            if abs(z - far) <= near:
                alike = max(alike, int(views[k, m]))
            elif z < far:
                before = True
    if alike > 0:
        return alike
    return -np.int64(views[r, c]) if known and not before else 0

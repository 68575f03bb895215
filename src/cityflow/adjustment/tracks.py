"""Tracks: one place of the world in all images that show it, from the matches of pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

MOST_IN_CELL = 3
"""Tracks that an image asks for in each cell of its grid; set by hand."""


@dataclass(frozen=True, slots=True)
class Ties:
    """Observations of tie points, sorted by point, then image.

    Attributes
    ----------
    point : (M,) number of the tie point, 0 to P - 1, each with two observations at least
    image : (M,) number of the image;  feature : (M,) number of the point among the image's features
    uv : (M, 2) image coordinates, pixels
    sigma : (M,) how exact they are among themselves: 1 for the smallest features
    """

    point: IntArray
    image: IntArray
    feature: IntArray
    uv: FloatArray
    sigma: FloatArray

    @property
    def points(self) -> int:
        return int(self.point[-1]) + 1 if len(self.point) else 0

    @property
    def lengths(self) -> IntArray:
        """(P,) observations of each point."""
        return np.bincount(self.point, minlength=self.points)

    def of_points(self, which: BoolArray) -> Ties:
        """The ties of some of the (P,) points, numbered anew."""
        return self.some(which[self.point])

    def some(self, kept: BoolArray) -> Ties:
        """Some of the (M,) observations; points with fewer than two go."""
        enough = np.bincount(self.point[kept], minlength=self.points) >= 2
        kept = kept & enough[self.point]
        number = np.cumsum(enough) - 1
        return Ties(number[self.point[kept]], self.image[kept], self.feature[kept], self.uv[kept], self.sigma[kept])


def tied(matches: Mapping[tuple[int, int], IntArray], uv: Sequence[FloatArray], scale: Sequence[np.ndarray]) -> Ties:
    """Join matches into tracks; those that show two points in one image contradict themselves and are left out.

    Parameters
    ----------
    matches : (number of an image, of another) → (K, 2) numbers of points in both
    uv : of each image the (N, 2) image coordinates of its points;  scale : their (N,) sizes, pixels
    """
    first = np.cumsum([0, *(len(each) for each in uv)])
    links = [m + np.array([first[i], first[j]]) for (i, j), m in sorted(matches.items()) if len(m)]
    if not links:
        nothing = np.empty(0, np.int64)
        return Ties(nothing, nothing, nothing, np.empty((0, 2)), np.empty(0))
    one, other = np.concatenate(links).T
    graph = coo_matrix((np.ones(len(one), np.int8), (one, other)), shape=(first[-1], first[-1]))
    track = connected_components(graph, directed=False)[1]
    node = np.unique(np.concatenate([one, other]))
    image = np.searchsorted(first, node, side="right") - 1
    order = np.lexsort((image, track[node]))
    node, image = node[order], image[order]
    point = np.unique(track[node], return_inverse=True)[1]
    twice = (point[1:] == point[:-1]) & (image[1:] == image[:-1])
    sound = np.ones(point[-1] + 1, bool)
    sound[point[1:][twice]] = False
    every_uv, every_scale = np.concatenate(list(uv)), np.concatenate(list(scale)).astype(np.float64)
    size = np.maximum(every_scale / max(float(np.min(every_scale)), 1e-6), 1.0)
    ties = Ties(point, image, node - first[image], every_uv[node], np.sqrt(size[node]))
    return ties.of_points(sound)


def of_tracks(tracks: IntArray, uv: Sequence[FloatArray], scale: Sequence[np.ndarray]) -> Ties:
    """Ties of tracks that somebody else has joined.

    Parameters
    ----------
    tracks : (M, 3) numbers of the tie point, of the image, of the point among the image's features; points count from 0 without gaps
    uv, scale : as in `tied`
    """
    point, image, feature = tracks[np.lexsort((tracks[:, 1], tracks[:, 0]))].T
    first = np.cumsum([0, *(len(each) for each in uv)])[image] + feature
    size = np.concatenate(list(scale)).astype(np.float64)[first]
    size = np.maximum(size / max(float(np.min(size, initial=np.inf)), 1e-6), 1.0)
    ties = Ties(point, image, feature, np.concatenate(list(uv)).astype(np.float64)[first], np.sqrt(size))
    # a track that shows two points in one image contradicts itself
    twice = (point[1:] == point[:-1]) & (image[1:] == image[:-1])
    return ties.some(np.r_[True, ~twice]) if len(point) else ties


def spread(ties: Ties, sizes: Sequence[tuple[int, int]], cells: int) -> Ties:
    """The longest tracks in each cell of each image: fewer points that hold the block as firmly.

    Parameters
    ----------
    sizes : of each image width and height, pixels
    cells : of the grid along the longer side
    """
    if not ties.points:
        return ties
    edge = np.array([max(size) / cells for size in sizes])[ties.image]
    cell = (ties.image * cells + (ties.uv[:, 1] // edge).astype(np.int64)) * cells
    cell += (ties.uv[:, 0] // edge).astype(np.int64)
    worst = np.zeros(ties.points)
    np.maximum.at(worst, ties.point, ties.sigma)
    order = np.lexsort((ties.point, worst[ties.point], -ties.lengths[ties.point], cell))
    starts = np.flatnonzero(np.diff(cell[order], prepend=-1))
    rank = np.arange(len(order)) - np.repeat(starts, np.diff(np.r_[starts, len(order)]))
    wanted = np.zeros(ties.points, bool)
    wanted[ties.point[order[rank < MOST_IN_CELL]]] = True
    return ties.of_points(wanted)

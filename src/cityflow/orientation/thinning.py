"""Fewer reference images: which exposures are not worth being reference image, because what is matched for them is mostly the ground of others.

A flight with 80 % overlap gives every exposure a strip of a fifth of its height; matching adds a margin for heights and a halo around it. Where the
neighbours see that strip nearly as well, one window less is matched. A reference image is given up only if the windows of all together become smaller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.orientation.reference_images import DETOUR_DEG, Candidates, ReferenceImageParameters
from cityflow.orientation.views import View

MOST_OTHERS = 24
"""Views of a cell that are looked at as its next reference image; set by hand."""
MOST_ROUNDS = 6
"""Reference images are given up in so many rounds at most; set by hand."""


@dataclass(frozen=True, slots=True)
class Window:
    """What is matched for a reference image: a box of its image, and how much of that is its own ground, square pixels."""

    area: float
    used: float

    @property
    def on_others(self) -> float:
        """Share of the window that is not the reference image's own ground."""
        return 1.0 - self.used / self.area if self.area > 0 else 1.0


@dataclass(frozen=True, slots=True)
class Shares:
    """What each of some ground cells is of an image, with a halo, cut to the image: (n, 2) first and last pixels, (n,) square pixels of the cell itself."""

    start: FloatArray
    stop: FloatArray
    used: FloatArray

    def window(self, which: IntArray) -> Window:
        """The box around some of the cells."""
        if not len(which):
            return Window(0.0, 0.0)
        size = self.stop[which].max(axis=0) - self.start[which].min(axis=0)
        return Window(float(np.prod(np.maximum(size, 0))), float(self.used[which].sum()))


def shares_of(view: View, cells: IntArray, cell_m: float, halo_px: int) -> Shares:
    """Of (n, 2) ground cells in an image, at the heights of the view."""
    size = np.array([view.image.camera.width, view.image.camera.height], np.float64)
    corners = ((cells[:, None, :] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])) * cell_m).reshape(-1, 2)
    low, high = (
        np.clip(view.image.project(np.column_stack([corners, np.full(len(corners), h)]))[0], 0, size).reshape(-1, 4, 2)
        for h in view.heights
    )
    every = [level[:, corner] for level in (low, high) for corner in range(4)]
    start = np.maximum(reduce(np.minimum, every) - halo_px, 0)
    stop = np.minimum(reduce(np.maximum, every) + halo_px, size)
    x, y = low[..., 0], low[..., 1]
    used = np.abs(sum(x[:, i] * y[:, j] - x[:, j] * y[:, i] for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)))) / 2
    return Shares(start, stop, used)


class _Thinning:
    """The state of giving up reference images: who is open, who has which cell, and the window of each."""

    def __init__(
        self, views: Sequence[View], cell: IntArray, others: IntArray, parameters: ReferenceImageParameters
    ) -> None:
        self._views, self._cell, self._others, self._parameters = views, cell, others, parameters
        self._seen = _positions(others)
        self._shares: dict[int, Shares] = {}
        owner = others[:, 0]
        order = np.argsort(owner, kind="stable")
        names, first = np.unique(owner[order], return_index=True)
        self.open = np.zeros(len(views), bool)
        self.open[names] = True
        self._owned = dict(zip(names.tolist(), np.split(order, first[1:]), strict=True))
        self._windows = {k: self._window(k, part) for k, part in self._owned.items()}

    def poorest(self) -> list[int]:
        """Open reference images with too much of their window on the ground of others, the poorest first."""
        poor = [(-round(w.on_others, 6), k) for k, w in self._windows.items() if self.open[k]]
        return [k for share, k in sorted(poor) if -share > self._parameters.max_overlap]

    def give_up(self, k: int) -> bool:
        """Hand the cells of reference image `k` to open others, if all can go and the windows shrink in all."""
        own = self._owned[k]
        others = self._others[own]
        takes = (others >= 0) & (others != k) & self.open[others]
        if not takes.any(axis=1).all():
            return False
        heirs = others[np.arange(len(own)), takes.argmax(axis=1)]
        owned = {v: np.concatenate([self._owned[v], own[heirs == v]]) for v in dict.fromkeys(heirs.tolist())}
        grown = {v: self._window(v, positions) for v, positions in owned.items()}
        if sum(w.area - self._windows[v].area for v, w in grown.items()) >= self._windows[k].area:
            return False
        self._owned.update(owned)
        self._windows.update(grown)
        self.open[k] = False
        return True

    def _window(self, k: int, positions: IntArray) -> Window:
        """What is matched of image `k` for cells that it sees: what these are of the image is worked out once."""
        seen = self._seen[k]
        if k not in self._shares:
            assert self._parameters.cell_m is not None
            self._shares[k] = shares_of(
                self._views[k], self._cell[seen], self._parameters.cell_m, self._parameters.halo_px
            )
        return self._shares[k].window(np.searchsorted(seen, positions))


def _positions(others: IntArray) -> dict[int, IntArray]:
    """View → the rows of `others` that name it, ascending."""
    row, column = np.nonzero(others >= 0)
    view = others[row, column]
    order = np.lexsort((row, view))
    names, first = np.unique(view[order], return_index=True)
    return dict(zip(names.tolist(), np.split(row[order], first[1:]), strict=True))


def surplus_reference_images(
    views: Sequence[View], found: Candidates, parameters: ReferenceImageParameters
) -> set[int]:
    """Views that should not be reference images, as others see their cells at most `DETOUR_DEG` worse than the best view does.

    Parameters
    ----------
    views : of the survey
    found : cells and the views of them in one direction
    """
    if len(found) == 0 or parameters.max_overlap >= 1:
        return set()
    cell, others = _others(found)
    state = _Thinning(views, cell, others, parameters)
    for _ in range(MOST_ROUNDS):
        if sum(state.give_up(k) for k in state.poorest()) == 0:
            break
    seen = {int(v) for v in np.unique(others) if v >= 0}
    return {v for v in seen if not state.open[v]}


def _others(found: Candidates) -> tuple[IntArray, IntArray]:
    """(C, 2) cells, and (C, MOST_OTHERS) their views within reach of the best, best first; -1 beyond."""
    start, number = found.first[:-1], found.number
    rank = np.arange(len(found.view)) - start[number]
    near = (rank < MOST_OTHERS) & (found.cost_deg <= found.cost_deg[start][number] + DETOUR_DEG)
    others = np.full((len(found), MOST_OTHERS), -1, np.int64)
    others[number[near], rank[near]] = found.view[near]
    return found.cell[start], others

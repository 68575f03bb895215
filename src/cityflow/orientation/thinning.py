"""Fewer reference images: which exposures are not worth being reference image, because what is matched for them is mostly the ground of others.

A flight with 80 % overlap gives every exposure a strip of a fifth of its height; matching adds a margin for heights and a halo around it. Where the
neighbours see that strip nearly as well, one window less is matched. A reference image is given up only if the windows of all together become smaller.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cityflow.core.arrays import IntArray
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


def window_of(view: View, cells: IntArray, cell_m: float, halo_px: int) -> Window:
    """The box around (n, 2) ground cells in an image, at the heights of the view, with a halo, cut to the image."""
    if len(cells) == 0:
        return Window(0.0, 0.0)
    size = np.array([view.image.camera.width, view.image.camera.height], np.float64)
    corners = ((cells[:, None, :] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])) * cell_m).reshape(-1, 2)
    low, high = (
        np.clip(view.image.project(np.column_stack([corners, np.full(len(corners), h)]))[0], 0, size)
        for h in view.heights
    )
    start = np.maximum(np.minimum(low.min(axis=0), high.min(axis=0)) - halo_px, 0)
    stop = np.minimum(np.maximum(low.max(axis=0), high.max(axis=0)) + halo_px, size)
    x, y = low.reshape(-1, 4, 2)[..., 0], low.reshape(-1, 4, 2)[..., 1]
    used = np.abs(np.sum(x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y, axis=1)) / 2
    return Window(float(np.prod(np.maximum(stop - start, 0))), float(used.sum()))


@dataclass
class _Thinning:
    """The state of giving up reference images: who is open, who has which cell, and the window of each."""

    views: Sequence[View]
    cell: IntArray
    others: IntArray
    parameters: ReferenceImageParameters
    open: dict[int, bool] = field(default_factory=dict)
    owned: dict[int, list[int]] = field(default_factory=dict)
    windows: dict[int, Window] = field(default_factory=dict)

    def __post_init__(self) -> None:
        owner = self.others[:, 0]
        order = np.argsort(owner, kind="stable")
        names, first = np.unique(owner[order], return_index=True)
        for k, part in zip(names.tolist(), np.split(order, first[1:]), strict=True):
            self.owned[k] = part.tolist()
            self.open[k] = True
            self.windows[k] = self.window(k, self.owned[k])

    def window(self, k: int, positions: list[int]) -> Window:
        assert self.parameters.cell_m is not None
        return window_of(self.views[k], self.cell[positions], self.parameters.cell_m, self.parameters.halo_px)

    def poorest(self) -> list[int]:
        """Open reference images with too much of their window on the ground of others, the poorest first."""
        poor = [(-round(w.on_others, 6), k) for k, w in self.windows.items() if self.open[k]]
        return [k for share, k in sorted(poor) if -share > self.parameters.max_overlap]

    def give_up(self, k: int) -> bool:
        """Hand the cells of reference image `k` to open others, if all can go and the windows shrink in all."""
        heirs: dict[int, list[int]] = {}
        for position in self.owned[k]:
            heir = next((int(v) for v in self.others[position] if v >= 0 and v != k and self.open.get(int(v))), None)
            if heir is None:
                return False
            heirs.setdefault(heir, []).append(position)
        grown = {v: self.window(v, self.owned[v] + more) for v, more in heirs.items()}
        if sum(w.area - self.windows[v].area for v, w in grown.items()) >= self.windows[k].area:
            return False
        for v, more in heirs.items():
            self.owned[v] = self.owned[v] + more
        self.windows.update(grown)
        self.open[k] = False
        return True


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
    return {v for v in seen if not state.open.get(v)}


def _others(found: Candidates) -> tuple[IntArray, IntArray]:
    """(C, 2) cells, and (C, MOST_OTHERS) their views within reach of the best, best first; -1 beyond."""
    start, number = found.first[:-1], found.number
    rank = np.arange(len(found.view)) - start[number]
    near = (rank < MOST_OTHERS) & (found.cost_deg <= found.cost_deg[start][number] + DETOUR_DEG)
    others = np.full((len(found), MOST_OTHERS), -1, np.int64)
    others[number[near], rank[near]] = found.view[near]
    return found.cell[start], others

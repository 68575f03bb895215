"""Cut lines on the page: they lie along the roofs that they part."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.splitting import CutLine, Splitting
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.split_lines import decode_splitting
from cityflow.reporting.view_frame import PageFrame
from cityflow.viewer.report_rows import UnitRow

Json = Any
Surface = Callable[[Bounds], tuple[Grid, FloatArray] | None]
"""Heights over some bounds, as `view_layers.surface_over`."""
CUT_FIGURES = ("vertical", "sloped", "height_step_m", "gap_m", "confidence")
CUT_FIELDS = ("outline", "kind", "accepted", "from", "to", *CUT_FIGURES, "heights")
ABOVE_ROOF_M, BESIDE_M = 0.3, 0.1
STEP_M = 1.0
"""Between two heights of a line, at most."""
INSIDE_M = 0.5
"""Roofs are looked for so far beside a line, and so far from its ends, where walls begin."""


@dataclass(frozen=True)
class Ridges:
    """How high the roofs beside a line rise."""

    tree: shapely.STRtree
    heights: FloatArray
    """Of the highest point of each shape of the tree, world metres."""

    @classmethod
    def of(cls, rows: Sequence[UnitRow], heights: Mapping[str, tuple[float, float]]) -> Ridges:
        known = [u for u in rows if u.rings and len(u.rings[0]) > 3 and u.id in heights]
        return cls(
            shapely.STRtree([shapely.Polygon(u.rings[0]) for u in known]), np.array([heights[u.id][1] for u in known])
        )

    def beside(self, line: shapely.LineString, fallback: float) -> float:
        """The higher roof of those that a line borders or crosses; the nearest one's where it touches none."""
        if not len(self.heights):
            return fallback
        found = self.tree.query(line, predicate="dwithin", distance=BESIDE_M)
        return float(self.heights[found if len(found) else [self.tree.nearest(line)]].max())


@dataclass(frozen=True)
class Roofs:
    """What lines lie on: the surface, but never above the ridges beside them."""

    ridges: Ridges
    ground: float
    surface: Surface

    def along(self, line: shapely.LineString) -> FloatArray:
        """(N, 3) places along a straight line in equal steps, a little above the higher roof beside each, world metres."""
        begin, end = shapely.get_coordinates(line)[[0, -1]]
        length = float(np.hypot(*(end - begin)))
        share = np.linspace(0.0, 1.0, max(int(np.ceil(length / STEP_M)), 1) + 1)
        rim = min(INSIDE_M / max(length, INSIDE_M), 0.5)
        ridge = self.ridges.beside(line, self.ground)
        found = self._highest(
            begin + np.clip(share, rim, 1 - rim)[:, None] * (end - begin), (end - begin) / max(length, 1e-9)
        )
        heights = np.fmin(np.where(np.isfinite(found), found, ridge), ridge)
        return np.column_stack([begin + share[:, None] * (end - begin), heights + ABOVE_ROOF_M])

    def _highest(self, places: FloatArray, way: FloatArray) -> FloatArray:
        """Of the surface at some places and on both sides of them; NaN where nothing is known."""
        aside = INSIDE_M * np.array([-way[1], way[0]])
        every = np.stack([places - aside, places, places + aside])
        low, high = every.reshape(-1, 2).min(axis=0), every.reshape(-1, 2).max(axis=0)
        read = self.surface(grown((low[0], low[1], high[0], high[1]), INSIDE_M))
        if read is None:
            return np.full(len(places), np.nan)
        grid, heights = read
        rows, cols = grid.indices(every[..., 0], every[..., 1])
        return np.asarray(np.fmax.reduce(heights[rows, cols], axis=0), np.float64)


def cut_lines(store: Store, records: Iterable[Record], roofs: Roofs, frame: PageFrame) -> Json:
    """Lines that outlines were cut along, and candidates that were not taken; `heights`: in equal steps from end to end, in the page's frame."""
    made = [(r, p) for r in records for p in r.outputs if p.endswith("split.json")]
    files = dict(store.read_many([p for _, p in made]))
    rows = [row for r, p in made for row in _cut_rows(r, decode_splitting(files[p]), roofs, frame)]
    return {"fields": CUT_FIELDS, "rows": rows}


def _cut_rows(record: Record, splitting: Splitting, roofs: Roofs, frame: PageFrame) -> Iterator[list[Json]]:
    for is_accepted, lines in ((True, splitting.cut_lines), (False, splitting.rejected)):
        for cut in lines:
            places = np.round(frame.local(roofs.along(cut.line)), 2).tolist()
            yield [
                record.unit, cut.kind, is_accepted, places[0], places[-1], *_cut_figures(cut), [up for _, _, up in places]
            ]  # fmt: skip


def _cut_figures(cut: CutLine) -> list[float]:
    return [round(float(np.nan_to_num(getattr(cut, name))), 3) for name in CUT_FIGURES]

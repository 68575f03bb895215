"""A part of the city as it looks from far away: blocks for buildings, a few triangles of terrain, a small picture for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Bounds

Picture = NDArray[np.uint8]
"""(rows, cols, 3) sRGB, north up."""


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Buildings as plans that rise to a level roof.

    Attributes
    ----------
    ids : of the buildings;  status, verdict : of each, empty where there is none
    figures : (N, 2) NMAD and RMSE of the points to the roof, metres; NaN where unknown
    plans : in plan, world metres
    heights : (N, 2) of floor and roof, world metres
    colours : (N, 2, 3) uint8, sRGB, of roof and walls
    """

    ids: tuple[str, ...]
    status: tuple[str, ...]
    verdict: tuple[str, ...]
    figures: FloatArray
    plans: tuple[Polygon, ...]
    heights: FloatArray
    colours: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.ids)

    def some(self, numbers: IntArray) -> Blocks:
        """Those with these numbers."""
        ids, status, verdict = (
            tuple(texts[i] for i in numbers.tolist()) for texts in (self.ids, self.status, self.verdict)
        )
        plans = tuple(self.plans[i] for i in numbers.tolist())
        return Blocks(ids, status, verdict, self.figures[numbers], plans, self.heights[numbers], self.colours[numbers])

    @classmethod
    def joined(cls, several: Sequence[Blocks]) -> Blocks:
        """All of several, one after the other."""
        return cls(
            tuple(i for one in several for i in one.ids),
            tuple(s for one in several for s in one.status),
            tuple(v for one in several for v in one.verdict),
            np.concatenate([np.empty((0, 2)), *(one.figures for one in several)]),
            tuple(p for one in several for p in one.plans),
            np.concatenate([np.empty((0, 2)), *(one.heights for one in several)]),
            np.concatenate([np.empty((0, 2, 3), np.uint8), *(one.colours for one in several)]),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Coarse:
    """What stands within `bounds`, seen from far away.

    Attributes
    ----------
    bounds : world metres
    vertices, triangles : (V, 3) world metres and (T, 3), counter-clockwise seen from above, of the terrain
    picture : of the ground; None where it has one colour.  extent : bounds of its outer edges, world metres
    blocks : the buildings
    error : how far it is from what it stands for, and the size of what has one colour in it, metres
    """

    bounds: Bounds
    vertices: FloatArray
    triangles: IntArray
    picture: Picture | None
    extent: Bounds
    blocks: Blocks
    error: float

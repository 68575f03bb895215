"""Columns of a volume: where they begin and end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.assemble import MIN_HEIGHT

MIN_THICKNESS = 0.5
"""A column thinner than this (m) anywhere stands on the floor; set by hand."""


@dataclass(frozen=True, slots=True)
class Column:
    """What stands on a cell: the number of its top's surface, its plane, and a level underside or None for the floor."""

    surface: int
    top: tuple[float, float, float]
    bottom: float | None = None


def standing_columns(
    division: Subdivision, surface: dict[int, int], ceiling: dict[int, float], planes: FloatArray, floor: float
) -> dict[int, Column]:
    """Columns of all cells; a top too near the floor is laid level, a void under too thin a storey is filled.

    Parameters
    ----------
    surface : of each cell, index into `planes`
    planes : (P, 3) a, b, c of z = a·x + b·y + c, local
    ceiling : local height of the underside of cells over a void
    floor : local height
    """
    columns = {}
    for cell, number in surface.items():
        xy = np.array([division.xy[v] for ring in division.cells[cell] for v in ring])
        a, b, c = (float(v) for v in planes[number])
        z = xy @ (a, b) + c
        if z.min() < floor + MIN_HEIGHT:
            a, b, c, number = 0.0, 0.0, max(float(z.mean()), floor + MIN_HEIGHT), -1
            z = np.full(len(z), c)
        bottom = ceiling.get(cell)
        hollow = bottom is not None and z.min() >= bottom + MIN_THICKNESS
        columns[cell] = Column(number, (a, b, c), bottom if hollow else None)
    return columns

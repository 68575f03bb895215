"""Accuracy of a surface raster against the true surface: on open faces, and around roof edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation, distance_transform_edt, maximum_filter, minimum_filter

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray
from cityflow.evaluation.statistics import error_statistics

STEP_CELLS = 4.0
"""Neighbouring cells whose true heights differ by more than this are a height step: steeper than any roof, cells."""
CLEAR_CELLS = 2
"""Cells nearer to a step of the truth are judged as its rim; as in docs/image_surface.md."""
RIM_M = 1.0
"""What counts as the rim of a roof, to either side of its edge; as in docs/image_surface.md."""
WITHIN_CELLS = 3.0
"""'Within 3' of the tables of docs/image_surface.md, cells."""


@dataclass(frozen=True, slots=True)
class DsmFigures:
    """Differences to the true surface.

    Attributes
    ----------
    nmad, bias, rmse, le95 : metres, on ground and roofs more than 2 cells from a height step
    within : share of the measured cells there that lie within 3 cells of the truth
    completeness : share of the cells there that are measured
    rim : share within 3 cells of the truth, of the measured cells of ground and roof up to 1 m from the edges of roofs
    rim_completeness : share of the rim's cells that are measured
    cells, rim_cells : how many there are of each
    """

    nmad: float
    bias: float
    rmse: float
    le95: float
    within: float
    completeness: float
    rim: float
    rim_completeness: float
    cells: int
    rim_cells: int


def dsm_figures(
    dsm: FloatArray | Float32Array, truth: FloatArray, solid: BoolArray, roof: BoolArray, cell_m: float
) -> DsmFigures:
    """Figures of a surface.

    Parameters
    ----------
    dsm : (rows, cols) metres, NaN in holes
    truth : (rows, cols) true height at the cells' centres, metres
    solid : where the truth is ground or roof;  roof : where it is roof
    cell_m : edge of a cell, which should be the ground sampling distance
    """
    inner, rim = zones(truth, solid, roof, cell_m)
    difference = np.asarray(dsm, np.float64) - truth
    found = error_statistics(difference[inner])
    return DsmFigures(
        found.nmad, found.bias, found.rmse, found.le95,
        _share_within(difference[inner], cell_m), _share(np.isfinite(difference[inner])),
        _share_within(difference[rim], cell_m), _share(np.isfinite(difference[rim])),
        int(inner.sum()), int(rim.sum()),
    )  # fmt: skip


def zones(truth: FloatArray, solid: BoolArray, roof: BoolArray, cell_m: float) -> tuple[BoolArray, BoolArray]:
    """Ground and roof clear of height steps; and ground and roof in the rims of roofs.

    A rim goes along steps that a roof has part in: eaves and gables, but also where a roof meets a higher one.
    """
    known = np.isfinite(truth)
    high = maximum_filter(np.where(known, truth, -np.inf), 3)
    low = minimum_filter(np.where(known, truth, np.inf), 3)
    step = known & (high - low > STEP_CELLS * cell_m)
    square = np.ones((3, 3), bool)
    clear = ~binary_dilation(step, square, iterations=CLEAR_CELLS - 1)
    edge = step & binary_dilation(roof, square)
    near = distance_transform_edt(~edge) * cell_m <= RIM_M if edge.any() else edge
    usable = solid & known
    return usable & clear, np.asarray(usable & near)


def _share_within(difference: FloatArray, cell_m: float) -> float:
    return _share(np.abs(difference[np.isfinite(difference)]) <= WITHIN_CELLS * cell_m)


def _share(mask: BoolArray) -> float:
    return float(mask.mean()) if mask.size else float("nan")

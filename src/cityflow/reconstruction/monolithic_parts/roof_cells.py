"""Roof surfaces as groups of cells: a plane per cell, groups of smooth cells of one direction, gaps grown over.

Frommholz 2017, section 3. The paper groups by normals; here a cell must lie on its group's plane, too, so that two parallel
roofs with a step between them are two groups, and the step is noticed later on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.monolithic_parts.cell_grid import SUMS, CellPoints, plane_of_sums
from cityflow.reconstruction.monolithic_parts.cell_groups import NONE, grow_groups, merged_groups

OUTSIDE = -2
"""Label of a cell whose middle is outside the outline."""
CAP = 4.5
"""Cost of a point that lies at three sigma or more."""
ROUNDS = 3
"""So often surfaces are settled, fitted to their smooth cells and merged again."""
CORE = 0.4
"""Share of the smallest surface that its smooth cells make up before it has grown; not decisive: half and twice gave the same models of 37 units."""
SMOOTH_SIGMAS = 2.5
"""A smooth window's RMS exceeds the noise by so many of its own sigmas; set by hand."""
OFFSET_SIGMAS = 3.0
"""A cell's middle is no farther off its group's plane: the usual three."""
UNEVENNESS_M = 0.03
"""How far a real roof surface departs from a plane (sigma), metres; set by hand."""
SWEEPS = 8
"""Most passes over the cells to settle their labels; half and twice gave the same models of 37 units."""


class RoofCellParameters(Parameters):
    """Which cells are roof, and which belong together."""

    angle_deg: float = Field(
        15.0, gt=0, le=60, description="normals of one surface's cells agree within this (degrees)"
    )
    worse: float = Field(
        1.15,
        gt=1,
        le=5,
        description="groups are merged if their common plane fits neither of them worse by this factor",
    )
    max_slope_deg: float = Field(72.0, gt=45, lt=90, description="steeper cells (degrees) are walls")
    min_area_m2: float = Field(
        1.2, gt=0, le=100, description="smaller groups are roof installations and are grown over"
    )
    smoothness: float = Field(1.0, ge=0, le=20, description="cost of each neighbouring cell with another label")


@dataclass(frozen=True, slots=True)
class RoofCells:
    """Labelled cells.

    Attributes
    ----------
    labels : (rows, cols) int64, index of the surface, `OUTSIDE`
    planes : (P, 3) float64, a, b, c of z = a·x + b·y + c, local
    grown : share of the inner cells that were on no surface and were grown over
    smooth : share of the inner cells with points that were smooth
    """

    labels: IntArray
    planes: FloatArray
    grown: float
    smooth: float


def roof_cells(cells: CellPoints, inside: BoolArray, noise: float, parameters: RoofCellParameters) -> RoofCells:
    """Surfaces of a roof.

    Parameters
    ----------
    cells : roof points in cells
    inside : (rows, cols) bool, cells of the outline
    noise : standard deviation of points across their surface, metres
    """
    sigma = math.hypot(noise, UNEVENNESS_M)
    planes, ratio = _cell_planes(cells.sums, inside.ravel(), cells.grid.cols, sigma, SMOOTH_SIGMAS)
    steep = np.hypot(planes[:, 0], planes[:, 1]) > math.tan(math.radians(parameters.max_slope_deg))
    smooth = ~steep & inside.ravel() & (ratio <= 1.0)
    limits = np.array([math.cos(math.radians(parameters.angle_deg)), OFFSET_SIGMAS * sigma])
    seeds = np.flatnonzero(smooth)
    seeds = seeds[np.argsort(ratio[seeds], kind="stable")]
    labels = grow_groups(cells.sums, planes, smooth, seeds.astype(np.int64), cells.grid.cols, limits)
    alike = float(limits[0]), sigma
    # mixed cells at its rim are not yet a group's own
    least = max(CORE * parameters.min_area_m2 / cells.grid.cell**2, 4.0)
    labels, surfaces = merged_groups(cells, labels, alike, parameters.worse, least)
    grown = float(np.mean(labels[inside.ravel()] == NONE)) if inside.any() else 1.0
    share = float(smooth.sum() / max(np.count_nonzero(inside.ravel() & (cells.sums[:, 0] > 0)), 1))
    image = np.where(inside.ravel(), labels, OUTSIDE)
    for _ in range(ROUNDS):
        if len(surfaces) == 0:
            break
        image = _settled_image(cells, image, surfaces, sigma, parameters)
        labels, fitted = merged_groups(cells, np.where(smooth, image, NONE), alike, parameters.worse, least)
        if len(fitted) == len(surfaces):
            break
        surfaces, image = fitted, np.where(inside.ravel(), labels, OUTSIDE)
    return RoofCells(image.reshape(cells.grid.shape), surfaces, grown, share)


def _settled_image(
    cells: CellPoints, image: IntArray, surfaces: FloatArray, sigma: float, parameters: RoofCellParameters
) -> IntArray:
    """Labels of all cells after surfaces have grown over gaps and agreed on their borders."""
    closed = closed_over(cells, image, surfaces, sigma)
    frame = sigma, parameters.smoothness, SWEEPS
    return np.asarray(_settled(cells.points, cells.starts, closed, surfaces, cells.grid.cols, *frame))


def closed_over(cells: CellPoints, image: IntArray, planes: FloatArray, sigma: float) -> IntArray:
    """The image after surfaces have grown over cells labelled `NONE`."""
    flat = _closed(cells.points, cells.starts, image.ravel(), planes, cells.grid.cols, sigma)
    return np.asarray(flat.reshape(image.shape))


@njit(cache=True, nogil=True)
def _cell_planes(
    sums: FloatArray, inside: BoolArray, cols: int, sigma: float, sigmas: float
) -> tuple[FloatArray, FloatArray]:
    """Plane of each cell with points, and its RMS over what chance allows; infinite where no plane is known.

    Of the four windows of 2×2 cells that hold a cell the flattest speaks for it: beside a ridge that is the one on its own side.
    """
    planes, ratio = np.zeros((len(sums), 4)), np.full(len(sums), np.inf)
    total, plane = np.empty(SUMS), np.empty(4)
    for k in range(len(sums)):
        if not inside[k] or sums[k, 0] < 1:
            continue
        for corner in (-cols - 1, -cols, -1, 0):
            first = k + corner
            total[:] = sums[first] + sums[first + 1] + sums[first + cols] + sums[first + cols + 1]
            if total[0] < 4 or not plane_of_sums(total, plane):
                continue
            allowed = sigma * (1.0 + sigmas / np.sqrt(2.0 * max(total[0] - 3.0, 1.0)))
            if plane[3] / allowed < ratio[k]:
                ratio[k] = plane[3] / allowed
                planes[k] = plane
    return planes, ratio


@njit(cache=True, nogil=True)
def _cost(points: FloatArray, starts: IntArray, cell: int, plane: FloatArray, sigma: float) -> float:
    """Mean cost of a cell's points on a plane, times the votes that they have."""
    n = starts[cell + 1] - starts[cell]
    if n == 0:
        return 0.0
    scale, total = 1.0 / (2.0 * sigma * sigma * (1.0 + plane[0] ** 2 + plane[1] ** 2)), 0.0
    for i in range(starts[cell], starts[cell + 1]):
        off = points[i, 2] - plane[0] * points[i, 0] - plane[1] * points[i, 1] - plane[2]
        total += min(off * off * scale, CAP)
    return total / n * min(float(n), 8.0)


@njit(cache=True, nogil=True)
def _closed(
    points: FloatArray, starts: IntArray, image: IntArray, planes: FloatArray, cols: int, sigma: float
) -> IntArray:
    """Labels after groups have grown, ring by ring, over the cells between them; a cell takes the plane that fits it best."""
    labels = image.copy()
    steps = np.array([-1, 1, -cols, cols])
    while True:
        found = labels.copy()
        changed = False
        for k in range(len(labels)):
            if labels[k] != -1:
                continue
            best, cost = -1, np.inf
            # across sides only: a speck that touches its like by a corner must not come back
            for step in steps:
                other = labels[k + step]
                if other < 0:
                    continue
                own = _cost(points, starts, k, planes[other], sigma)
                if own < cost - 1e-9:
                    best, cost = other, own
            if best >= 0:
                found[k] = best
                changed = True
        labels = found
        if not changed:
            return labels


@njit(cache=True, nogil=True)
def _settled(
    points: FloatArray, starts: IntArray, image: IntArray, planes: FloatArray, cols: int,
    sigma: float, smoothness: float, sweeps: int,
) -> IntArray:  # fmt: skip
    """Labels after each cell has taken, again and again, the plane among its neighbours' that costs least with its borders."""
    labels = image.copy()
    steps = np.array([-1, 1, -cols, cols, -cols - 1, -cols + 1, cols - 1, cols + 1])
    for _ in range(sweeps):
        changed = False
        for k in range(len(labels)):
            if labels[k] < 0:
                continue
            alone = True
            for step in steps:
                if labels[k + step] >= 0 and labels[k + step] != labels[k]:
                    alone = False
            if alone:
                continue
            best, least = labels[k], np.inf
            for m in range(9):
                label = labels[k] if m == 8 else labels[k + steps[m]]
                if label < 0:
                    continue
                borders = 0.0
                for j in range(8):
                    other = labels[k + steps[j]]
                    if other >= 0 and other != label:
                        borders += 1.0 if j < 4 else 0.5
                total = _cost(points, starts, k, planes[label], sigma) + smoothness * borders
                if total < least - 1e-9 or (total < least + 1e-9 and label == labels[k]):
                    best, least = label, total
            if best != labels[k]:
                labels[k] = best
                changed = True
        if not changed:
            break
    return labels

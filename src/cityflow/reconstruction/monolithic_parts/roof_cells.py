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

NONE = -1
"""Label of a cell on no surface."""
OUTSIDE = -2
"""Label of a cell whose middle is outside the outline."""
CAP = 4.5
"""Cost of a point that lies at three sigma or more."""
ROUNDS = 3
"""So often surfaces are settled, fitted to their smooth cells and merged again."""
CORE = 0.4
"""Share of the smallest surface that its smooth cells make up before it has grown."""


class RoofCellParameters(Parameters):
    """Which cells are roof, and which belong together."""

    smooth_sigmas: float = Field(
        2.5, gt=1, le=10, description="a smooth window's RMS exceeds the noise by so many of its own sigmas"
    )
    angle_deg: float = Field(
        15.0, gt=0, le=60, description="normals of one surface's cells agree within this (degrees)"
    )
    unevenness_m: float = Field(
        0.03, ge=0, le=0.5, description="how far a real roof surface departs from a plane (sigma, m)"
    )
    offset_sigmas: float = Field(3.0, gt=0, le=20, description="a cell's middle is no farther off its group's plane")
    worse: float = Field(
        1.15, gt=1, le=5, description="groups are one where neither lies so many times worse on the plane of both"
    )
    max_slope_deg: float = Field(72.0, gt=45, lt=90, description="steeper cells (degrees) are walls")
    min_area_m2: float = Field(
        1.2, gt=0, le=100, description="smaller groups are roof installations and are grown over"
    )
    smoothness: float = Field(1.0, ge=0, le=20, description="cost of each neighbouring cell with another label")
    sweeps: int = Field(8, ge=0, le=100, description="most passes over the cells to settle their labels")


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
    sigma = math.hypot(noise, parameters.unevenness_m)
    planes, ratio = _cell_planes(cells.sums, inside.ravel(), cells.grid.cols, sigma, parameters.smooth_sigmas)
    steep = np.hypot(planes[:, 0], planes[:, 1]) > math.tan(math.radians(parameters.max_slope_deg))
    smooth = ~steep & inside.ravel() & (ratio <= 1.0)
    limits = np.array([math.cos(math.radians(parameters.angle_deg)), parameters.offset_sigmas * sigma])
    seeds = np.flatnonzero(smooth)
    seeds = seeds[np.argsort(ratio[seeds], kind="stable")]
    labels = _grow_groups(cells.sums, planes, smooth, seeds.astype(np.int64), cells.grid.cols, limits)
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
    frame = sigma, parameters.smoothness, parameters.sweeps
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
def _cosine(p: FloatArray, q: FloatArray) -> float:
    dot = p[0] * q[0] + p[1] * q[1] + 1.0
    return dot / np.sqrt((p[0] ** 2 + p[1] ** 2 + 1.0) * (q[0] ** 2 + q[1] ** 2 + 1.0))


@njit(cache=True, nogil=True)
def _offset(row: FloatArray, plane: FloatArray) -> float:
    """Distance (m) of a cell's middle of points across a plane."""
    n = row[0]
    z = plane[0] * row[1] / n + plane[1] * row[2] / n + plane[2]
    return abs(row[3] / n - z) / np.sqrt(1.0 + plane[0] ** 2 + plane[1] ** 2)


@njit(cache=True, nogil=True)
def _grow_groups(
    sums: FloatArray, planes: FloatArray, smooth: BoolArray, seeds: IntArray, cols: int, limits: FloatArray
) -> IntArray:
    """Groups of 8-connected smooth cells on one plane, which is fitted anew each time that the group has doubled."""
    labels, count = np.full(len(sums), -1), 0
    queue = np.empty(len(sums), np.int64)
    total, plane = np.empty(SUMS), np.empty(4)
    steps = np.array([-cols - 1, -cols, -cols + 1, -1, 1, cols - 1, cols, cols + 1])
    for seed in seeds:
        if labels[seed] >= 0:
            continue
        total[:] = sums[seed]
        # a single cell's plane leans with its noise: like neighbours make it steadier
        for step in steps:
            k = seed + step
            if not smooth[k] or labels[k] >= 0:
                continue
            if _cosine(planes[seed], planes[k]) >= limits[0] and _offset(sums[k], planes[seed]) <= limits[1]:
                total += sums[k]
        if not plane_of_sums(total, plane):
            continue
        queue[0], head, tail = seed, 0, 1
        labels[seed] = count
        total[:] = sums[seed]
        fitted = 4
        while head < tail:
            here = queue[head]
            head += 1
            for step in steps:
                k = here + step
                if not smooth[k] or labels[k] >= 0:
                    continue
                if _cosine(plane, planes[k]) < limits[0] or _offset(sums[k], plane) > limits[1]:
                    continue
                labels[k] = count
                total += sums[k]
                queue[tail] = k
                tail += 1
                if tail >= 2 * fitted:
                    plane_of_sums(total, plane)
                    fitted = tail
        count += 1
    return labels


def merged_groups(
    cells: CellPoints, labels: IntArray, limits: tuple[float, float], worse: float, least: float
) -> tuple[IntArray, FloatArray]:
    """Groups after neighbours on one plane have joined and small ones are gone, largest first, and their planes.

    Parameters
    ----------
    limits : cosine between normals, noise (m)
    worse : most by which a group may lie worse on a common plane than on its own
    least : fewest cells of a group
    """
    count = int(labels.max()) + 1 if len(labels) else 0
    if count == 0:
        return labels, np.empty((0, 3))
    sums = np.zeros((count, SUMS))
    np.add.at(sums, labels[labels >= 0], cells.sums[labels >= 0])
    size = np.bincount(labels[labels >= 0], minlength=count)
    leader = np.arange(count)
    wide = _wide_groups(labels.reshape(cells.grid.shape), count)
    pairs = _neighbours(labels.reshape(cells.grid.shape), 2)
    while True:
        gains = [(_joint_misfit(sums, i, j, limits), i, j) for i, j in sorted(pairs)]
        fits = [g for g in gains if g[0] <= worse]
        if not fits:
            break
        _, i, j = min(fits)
        sums[i] += sums[j]
        size[i] += size[j]
        size[j] = 0
        leader[leader == j] = i
        wide[i] |= wide[j]
        pairs = {
            (min(a, b), max(a, b))
            for a, b in (((i if p == j else p), (i if q == j else q)) for p, q in pairs)
            if a != b
        }
    kept = [int(k) for k in np.argsort(-size, kind="stable") if size[k] >= least and wide[k]]
    number = np.full(count + 1, NONE)
    number[kept] = np.arange(len(kept))
    labels = np.where(labels >= 0, number[leader[labels]], NONE)
    planes = np.zeros((len(kept), 4))
    for k, group in enumerate(kept):
        plane_of_sums(sums[group], planes[k])
    return labels, planes[:, :3].copy()


def _wide_groups(image: IntArray, count: int) -> BoolArray:
    """(count,) groups that cover some 2×2 cells: narrower ones are the mixed cells along a ridge or a step."""
    a = image[:-1, :-1]
    square = (a >= 0) & (a == image[:-1, 1:]) & (a == image[1:, :-1]) & (a == image[1:, 1:])
    found = np.zeros(count, bool)
    found[np.unique(a[square])] = True
    return found


def _joint_misfit(sums: FloatArray, i: int, j: int, limits: tuple[float, float]) -> float:
    """How much worse two groups lie on the plane of both than on their own; infinite where their directions differ.

    Limits are the cosine between their normals and the noise (m), below which no plane needs to fit.
    """
    planes = np.zeros((3, 4))
    known = [plane_of_sums(row, planes[k]) for k, row in enumerate((sums[i], sums[j], sums[i] + sums[j]))]
    if not known[2] or (known[0] and known[1] and _cosine(planes[0], planes[1]) < limits[0]):
        return math.inf
    own = [max(limits[1], planes[k, 3] if known[k] else 0.0) for k in range(2)]
    return max(_rms_on(sums[k], planes[2]) / own[m] for m, k in enumerate((i, j)))


def _rms_on(row: FloatArray, plane: FloatArray) -> float:
    """RMS (m) across a plane of the points that make up some sums."""
    a, b, c = plane[:3]
    n, x, y, z, xx, xy, yy, xz, yz, zz = row
    square = (
        zz
        - 2 * (a * xz + b * yz + c * z)
        + a * a * xx
        + b * b * yy
        + 2 * (a * b * xy + a * c * x + b * c * y)
        + n * c * c
    )
    return math.sqrt(max(square, 0.0) / n / (1 + a * a + b * b))


def _neighbours(image: IntArray, reach: int) -> set[tuple[int, int]]:
    """Pairs of labels that lie within some cells of each other along rows, columns or diagonals."""
    pairs: set[tuple[int, int]] = set()
    rows, cols = image.shape
    for r, c in ((0, 1), (1, 0), (1, 1), (1, -1)):
        for k in range(1, reach + 1):
            dr, dc = r * k, c * k
            a = image[: rows - dr, max(-dc, 0) : cols - max(dc, 0)]
            b = image[dr:, max(dc, 0) : cols + min(dc, 0)]
            differ = (a != b) & (a >= 0) & (b >= 0)
            low, high = np.minimum(a[differ], b[differ]), np.maximum(a[differ], b[differ])
            pairs |= {(int(p), int(q)) for p, q in np.unique(np.column_stack([low, high]), axis=0)}
    return pairs


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

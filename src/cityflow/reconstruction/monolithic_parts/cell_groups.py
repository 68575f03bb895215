"""Groups of cells on one plane: grown, and merged as long as one plane serves both."""

from __future__ import annotations

import math

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.reconstruction.monolithic_parts.cell_grid import SUMS, CellPoints, plane_of_sums

NONE = -1
"""Label of a cell on no surface."""


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
def grow_groups(
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

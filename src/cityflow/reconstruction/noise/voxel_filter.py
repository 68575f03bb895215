"""Noise points: far from the surface that the surrounding cubes agree on (Frommholz 2017, section 2).

The bounding box is cut into cubes of edge a. The points of the 3×3×3 cubes around a cube give its surface by principal
component analysis. Where that surface touches the sphere around the cube (radius a√3/2), the distances of the cube's
points from it go into a histogram, and points beyond the class with the largest count are removed.

Three things are added. The surface is fitted a second time to the points near the first one, which a stray point tilts.
The classes are as wide as the noise around the cube asks for, so that the first of them is the largest one for a cloud
of nothing but noise on a surface, and points of such a cloud stay. And the paper leaves alone what its test does not reach:
a cube with next to no points around it, or with few points off the surface that its neighbours agree on; these go here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.noise.cubes import (
    ACROSS,
    BETWEEN,
    COUNT,
    CX,
    CY,
    CZ,
    SUMS,
    A,
    B,
    C,
    add_point,
    cut_in_cubes,
    plane_of,
)

MAX_CLASSES = 64
"""Of the histogram of distances, over the reach of a cube."""
LEAST = 4
"""Fewest points that a plane is fitted to."""
TRIAL_EDGES = (0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2, 4.0)
"""Edges (m) of the dry runs, smallest first; set by hand, as is the next."""
GOOD_ENOUGH = 1.15
"""The smallest edge whose blocks are so many times as thick as the flattest ones will do: small parts stand out from small cubes."""
LEAST_NOISE_M = 0.02
"""Noise is never taken as smaller than this, m; set by hand."""
SPARSE_SHARE = 0.12
"""Cubes with a smaller share of the usual number of points around them are noise; set by hand, as is the next."""
STRAY_SHARE = 0.1
"""Where fewer of the points around a cube lie off the surface, those in it are noise."""
POINTS_AROUND = 12
"""Fewest points that 3×3×3 cubes of a guessed edge hold: four times those of a plane; set by hand."""


class VoxelFilterParameters(Parameters):
    """How far from the local surface a point may be."""

    edge_m: float = Field(0.0, ge=0, le=20, description="edge of a cube (m); 0: estimated from a sample of the cloud")
    class_sigmas: float = Field(
        2.5, ge=0.2, le=10, description="width of a class of the histogram, in standard deviations of the noise there"
    )
    sample: int = Field(
        100, ge=20, le=10_000, description="blocks of cubes in the sample that the edge is estimated from"
    )


class NoiseParameters(VoxelFilterParameters):
    """Whether noise is removed from points of images before façades are looked for in them, and how."""

    remove: bool = Field(
        False,
        description="points far from the surface that those around them agree on are removed before façades are looked for",
    )


@dataclass(frozen=True, slots=True)
class VoxelFiltering:
    """What the filter found.

    Attributes
    ----------
    keep : (N,) bool, points that are no noise, in the order of the input
    edge_m : edge of the cubes used, metres
    noise_m : typical standard deviation of points across their local surface, metres; NaN where nothing is flat
    """

    keep: BoolArray
    edge_m: float
    noise_m: float


def filter_noise(xyz: FloatArray, parameters: VoxelFilterParameters) -> VoxelFiltering:
    """Tell noise from points on surfaces.

    Parameters
    ----------
    xyz : (N, 3) float64, metres, any frame; points that are not finite are noise
    """
    keep = np.all(np.isfinite(xyz), axis=1)
    used = np.ascontiguousarray(xyz[keep], np.float64)
    edge = parameters.edge_m or guess_edge(used, parameters)
    if len(used) < LEAST:
        return VoxelFiltering(keep, edge, float("nan"))
    cubes = cut_in_cubes(used, edge)
    table, sums = cubes.neighbours(), cubes.sums()
    around = _around(sums, table)
    sparse = SPARSE_SHARE * float(np.median(np.repeat(around, np.diff(cubes.starts))))
    limits = np.array([edge, parameters.class_sigmas, LEAST_NOISE_M, max(sparse, LEAST), STRAY_SHARE])
    good, noise = _judge(cubes.points, cubes.starts, table, sums, cubes.centres, limits)
    chosen = np.zeros(len(used), bool)
    chosen[cubes.order] = good
    keep[keep] = chosen
    known = noise[np.isfinite(noise)]
    return VoxelFiltering(keep, edge, float(np.median(known)) if len(known) else float("nan"))


def guess_edge(xyz: FloatArray, parameters: VoxelFilterParameters) -> float:
    """Edge (m) of cubes whose 3×3×3 blocks look most like surfaces, seen around some points at random.

    In small blocks the noise is as thick as the surface is wide, in large ones several surfaces meet. The choice of points
    is fixed by a seed, so that the same cloud always gets the same edge.
    """
    if len(xyz) < LEAST:
        return TRIAL_EDGES[-1]
    chosen = np.sort(np.random.default_rng(0).choice(len(xyz), min(parameters.sample, len(xyz)), replace=False))
    counts, flatness = _dry_run(xyz, xyz[chosen], np.array(TRIAL_EDGES))
    enough = np.median(counts, axis=1) >= POINTS_AROUND
    if not enough.any():
        return TRIAL_EDGES[-1]
    typical = np.where(enough, np.median(flatness, axis=1), np.inf)
    return TRIAL_EDGES[int(np.argmax(typical <= GOOD_ENOUGH * typical.min()))]


@njit(cache=True, nogil=True)
def _dry_run(xyz: FloatArray, sample: FloatArray, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(K, S) points in blocks of three edges around each sample, and their extent across over that between."""
    count, flatness = np.zeros((len(edges), len(sample))), np.ones((len(edges), len(sample)))
    plane, local = np.empty(9), np.empty(3)
    for s in range(len(sample)):
        rows = np.zeros((len(edges), SUMS))
        for i in range(len(xyz)):
            reach = 0.0
            for k in range(3):
                local[k] = xyz[i, k] - sample[s, k]
                reach = max(reach, abs(local[k]))
            if reach <= 1.5 * edges[-1]:
                add_point(rows[np.searchsorted(edges, reach / 1.5)], local)
        row = np.zeros(SUMS)
        for e in range(len(edges)):
            row += rows[e]
            count[e, s] = row[COUNT]
            if row[COUNT] >= LEAST:
                plane_of(row, plane)
                flatness[e, s] = plane[ACROSS] / max(plane[BETWEEN], 1e-9)
    return count, flatness


@njit(cache=True, nogil=True)
def _around(sums: FloatArray, table: IntArray) -> FloatArray:
    """(M,) points in the 3×3×3 cubes around each cube."""
    out = np.zeros(len(table))
    for m in range(len(table)):
        for k in table[m]:
            if k >= 0:
                out[m] += sums[k, COUNT]
    return out


@njit(cache=True, nogil=True)
def _judge(
    points: FloatArray, starts: IntArray, table: IntArray, sums: FloatArray, centres: FloatArray, limits: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """Which points stay, and the noise around each cube; limits: edge, class width in sigmas, least noise,
    least points around, share of strays."""
    edge, class_sigmas, least_noise, sparse, stray_share = limits
    radius = edge / 2 * np.sqrt(3.0)
    keep, noise = np.ones(len(points), np.bool_), np.full(len(table), np.nan)
    plane, row = np.empty(9), np.empty(SUMS)
    for m in range(len(table)):
        row[:] = 0.0
        for k in table[m]:
            if k >= 0:
                row += sums[k]
        if row[COUNT] < sparse:
            keep[starts[m] : starts[m + 1]] = False
            continue
        plane_of(row, plane)
        sigma = _second_fit(points, starts, table[m], plane, least_noise)
        off = 0.0
        for k in range(3):
            off += plane[k] * (centres[m, k] - plane[CX + k])
        if abs(off) > radius:
            # Few points beside a surface that the others agree on: strays. Many: another surface.
            cubes_there = np.count_nonzero(table[m] >= 0)
            few = starts[m + 1] - starts[m] < 0.75 * row[COUNT] / cubes_there
            if few and _off_surface(points, starts, table[m], plane, 3.0 * sigma) < max(
                LEAST, stray_share * row[COUNT]
            ):
                keep[starts[m] : starts[m + 1]] = False
            continue
        noise[m] = sigma
        _beyond_fullest_class(points, starts[m], starts[m + 1], plane, class_sigmas * sigma, keep)
    return keep, noise


@njit(cache=True, nogil=True)
def _off_surface(points: FloatArray, starts: IntArray, around: IntArray, plane: FloatArray, reach: float) -> int:
    count = 0
    for k in around:
        if k < 0:
            continue
        for i in range(starts[k], starts[k + 1]):
            if _distance(points[i], plane) > reach:
                count += 1
    return count


@njit(cache=True, nogil=True)
def _second_fit(points: FloatArray, starts: IntArray, around: IntArray, plane: FloatArray, least_noise: float) -> float:
    """Fit the plane again to the points near it; how far these scatter (m)."""
    sigma = max(_scatter(points, starts, around, plane), least_noise)
    row = np.zeros(SUMS)
    for k in around:
        if k < 0:
            continue
        for i in range(starts[k], starts[k + 1]):
            if _distance(points[i], plane) <= 2.5 * sigma:
                add_point(row, points[i])
    if row[COUNT] >= LEAST:
        plane_of(row, plane)
        sigma = max(_scatter(points, starts, around, plane), least_noise)
    return sigma


@njit(cache=True, nogil=True)
def _distance(point: FloatArray, plane: FloatArray) -> float:
    return abs(
        plane[A] * (point[0] - plane[CX]) + plane[B] * (point[1] - plane[CY]) + plane[C] * (point[2] - plane[CZ])
    )


@njit(cache=True, nogil=True)
def _scatter(points: FloatArray, starts: IntArray, around: IntArray, plane: FloatArray) -> float:
    """Normalised median of the distances of all points around from the plane, to a sixty-fourth of its range."""
    reach = max(3.0 * plane[ACROSS], 1e-6)
    count, total = np.zeros(MAX_CLASSES), 0
    for k in around:
        if k < 0:
            continue
        for i in range(starts[k], starts[k + 1]):
            place = int(_distance(points[i], plane) / reach * MAX_CLASSES)
            count[min(place, MAX_CLASSES - 1)] += 1
            total += 1
    seen = 0.0
    for place in range(MAX_CLASSES):
        if seen + count[place] >= total / 2:
            part = (total / 2 - seen) / max(count[place], 1.0)
            return 1.4826 * reach * (place + part) / MAX_CLASSES
        seen += count[place]
    return 1.4826 * reach


@njit(cache=True, nogil=True)
def _beyond_fullest_class(
    points: FloatArray, first: int, last: int, plane: FloatArray, width: float, keep: BoolArray
) -> None:
    count = np.zeros(MAX_CLASSES, np.int64)
    for i in range(first, last):
        count[min(int(_distance(points[i], plane) / width), MAX_CLASSES - 1)] += 1
    fullest = np.argmax(count)
    for i in range(first, last):
        if _distance(points[i], plane) > (fullest + 1) * width:
            keep[i] = False

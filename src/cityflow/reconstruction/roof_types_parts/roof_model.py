"""Skeletons to a solid: the highest of all parts at every place, cut into roof polygons, assembled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.roof_types_parts.skeletons import Skeleton, plane_groups

BESIDE_M, ALONG_M = 0.015, 0.12
"""How far beside a line its two sides are looked at, and how densely along it; set by hand."""
SHORT_M = 0.1
"""Shorter pieces of an edge are left out; set by hand."""
SAME_SLOPE, SAME_M = 1e-4, 2e-3
"""Planes of several parts that differ by less are one; set by hand."""
MOST_CELLS = 400
"""Bounds time."""
LATTICE_M, MOST_PLACES = 0.2, 40_000
"""Spacing of the places at which the highest part is asked for, and their number at most; set by hand."""


@dataclass(frozen=True, slots=True)
class PlaneGroup:
    """Planes over a convex region, the lowest (or highest) of which counts.

    Attributes
    ----------
    region : (H, 3) float64, nx, ny, c of half planes nx·x + ny·y >= c
    planes : (P,) int64, rows of the model's planes
    highest : the highest counts, not the lowest
    """

    region: FloatArray
    planes: IntArray
    highest: bool


@dataclass(frozen=True, slots=True)
class RoofModel:
    """Plane groups, of which the highest counts at every place; where none reaches, the nearest does.

    Attributes
    ----------
    planes : (P, 3) float64, a, b, c of z = a·x + b·y + c, local
    groups : tuple of PlaneGroup
    part : (G,) number of the part that each group belongs to
    """

    planes: FloatArray
    groups: tuple[PlaneGroup, ...]
    part: tuple[int, ...] = field(default=())

    def labels(self, xy: FloatArray) -> IntArray:
        """(N,) plane that counts at each place."""
        return self._winners(xy)[0]

    def _winners(self, xy: FloatArray) -> tuple[IntArray, IntArray]:
        """(N,) plane and (N,) group that count at each place."""
        best = np.full(len(xy), -math.inf)
        nearest = np.full(len(xy), -math.inf)
        label, winner = np.zeros(len(xy), np.int64), np.zeros(len(xy), np.int64)
        for number, group in enumerate(self.groups):
            z = xy @ self.planes[group.planes, :2].T + self.planes[group.planes, 2]
            which = z.argmax(axis=1) if group.highest else z.argmin(axis=1)
            height = z[np.arange(len(xy)), which]
            depth = _depth(group.region, xy)
            inside = depth >= -1e-6
            wins = np.where(inside, (height > best + 1e-9) | ~np.isfinite(best), ~np.isfinite(best) & (depth > nearest))
            nearest = np.where(wins & ~inside, depth, nearest)
            best = np.where(wins & inside, height, best)
            label, winner = np.where(wins, group.planes[which], label), np.where(wins, number, winner)
        return label, winner

    def owners(self, xy: FloatArray) -> IntArray:
        """(N,) part that counts at each place."""
        return np.asarray(np.array(self.part)[self._winners(xy)[1]])

    def heights(self, xy: FloatArray) -> FloatArray:
        """(N,) height that counts at each place."""
        planes = self.planes[self.labels(xy)]
        return np.asarray(np.sum(planes[:, :2] * xy, axis=1) + planes[:, 2])


def _depth(region: FloatArray, xy: FloatArray) -> FloatArray:
    if len(region) == 0:
        return np.full(len(xy), 1e6)
    return np.asarray((xy @ region[:, :2].T - region[:, 2]).min(axis=1))


@dataclass(frozen=True, slots=True)
class PlacedSkeleton:
    """A skeleton and the convex region where it stands: half planes (H, 3); none: everywhere."""

    skeleton: Skeleton
    region: FloatArray


def roof_model(parts: Sequence[PlacedSkeleton]) -> RoofModel:
    """All skeletons as plane groups."""
    planes: list[FloatArray] = []
    groups, owner = [], []
    for number, part in enumerate(parts):
        for rows, region, highest in plane_groups(part.skeleton):
            index = np.array([_index_of(row, planes) for row in rows], np.int64)
            reach = (
                part.region if region is None else np.concatenate([part.region.reshape(-1, 3), region.reshape(-1, 3)])
            )
            groups.append(PlaneGroup(reach, index, highest))
            owner.append(number)
    return RoofModel(np.array(planes), tuple(groups), tuple(owner))


def _index_of(row: FloatArray, planes: list[FloatArray]) -> int:
    """Number of the plane in the list, at its end where it is new."""
    for k, plane in enumerate(planes):
        if np.abs(plane[:2] - row[:2]).max() < SAME_SLOPE and abs(plane[2] - row[2]) < SAME_M:
            return k
    planes.append(row)
    return len(planes) - 1


def partition_of(model: RoofModel, outline: Polygon) -> RoofPartition:
    """The outline (local) cut along the model's edges; each cell has one plane."""
    division = Subdivision.of_polygon(outline)
    for line in _edge_lines(model, outline):
        for number in list(division.cells):
            if len(division.cells) >= MOST_CELLS:
                break
            division.cut(number, line)
    labels = _cell_labels(division, model)
    labels = division.merge(labels)
    division.dissolve()
    return RoofPartition.of_subdivision(division, labels)


def _cell_labels(division: Subdivision, model: RoofModel) -> dict[int, int]:
    numbers = sorted(division.cells)
    polygons = np.array([division.polygon(n) for n in numbers], dtype=object)
    places = shapely.get_coordinates(shapely.point_on_surface(polygons))
    return {n: int(label) for n, label in zip(numbers, model.labels(places), strict=True)}


def _edge_lines(model: RoofModel, outline: Polygon) -> list[CutLine]:
    """Lines along which the plane that counts changes, with the stretches where it does, the longest first."""
    found: list[CutLine] = []
    for nx, ny, offset in _unlike(_candidates(model, outline)):
        for start, end in _stretches(model, outline, (nx, ny, offset)):
            found.append(CutLine(nx, ny, offset, start, end, end - start, True))
    return sorted(found, key=lambda line: (-round(line.support, 6), line.nx, line.ny, line.offset))


def _candidates(model: RoofModel, outline: Polygon) -> FloatArray:
    """(K, 3) unit normal and offset of every crossing of planes that are neighbours somewhere, and of borders of regions."""
    i, k = _neighbours(model, outline).T
    crossing = (model.planes[i] - model.planes[k]) * np.array([1.0, 1.0, -1.0])
    borders = [g.region for g in model.groups if len(g.region)]
    lines = np.concatenate([crossing, *borders])
    steep = np.hypot(lines[:, 0], lines[:, 1])
    lines = lines[steep > 1e-4] / steep[steep > 1e-4, None]
    back = (lines[:, 0] < 0) | ((lines[:, 0] == 0) & (lines[:, 1] < 0))
    return np.where(back[:, None], -lines, lines)


def _neighbours(model: RoofModel, outline: Polygon) -> IntArray:
    """(K, 2) pairs of planes that count side by side on a lattice."""
    x0, y0, x1, y1 = outline.bounds
    step = max(LATTICE_M, math.sqrt((x1 - x0) * (y1 - y0) / MOST_PLACES))
    x, y = np.meshgrid(np.arange(x0 - step, x1 + 2 * step, step), np.arange(y0 - step, y1 + 2 * step, step))
    label = model.labels(np.column_stack([x.ravel(), y.ravel()])).reshape(x.shape)
    pairs = [
        (label[:-1], label[1:]),
        (label[:, :-1], label[:, 1:]),
        (label[:-1, :-1], label[1:, 1:]),
        (label[:-1, 1:], label[1:, :-1]),
    ]
    both = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in pairs])
    unlike: IntArray = both[both[:, 0] != both[:, 1]]
    return np.unique(np.sort(unlike, axis=1), axis=0).reshape(-1, 2)


def _unlike(lines: FloatArray) -> list[tuple[float, float, float]]:
    """Each line once."""
    kept: list[FloatArray] = []
    for line in lines:
        if not kept or np.abs(np.array(kept) - line).max(axis=1).min() > 1e-7:
            kept.append(line)
    return [(float(a), float(b), float(c)) for a, b, c in kept]


def _stretches(model: RoofModel, outline: Polygon, line: tuple[float, float, float]) -> list[tuple[float, float]]:
    """Where along a line the planes on its two sides differ, inside the outline."""
    nx, ny, offset = line
    corners = np.asarray(outline.exterior.coords)
    side, along = corners @ (nx, ny) - offset, corners @ (-ny, nx)
    if side.min() >= -1e-9 or side.max() <= 1e-9:
        return []
    t = np.arange(along.min() + ALONG_M / 2, along.max(), ALONG_M)
    middle = np.column_stack([nx * offset - ny * t, ny * offset + nx * t])
    left, right = (model.labels(middle + sign * BESIDE_M * np.array([nx, ny])) for sign in (1, -1))
    active = (left != right) & shapely.contains_xy(outline, middle[:, 0], middle[:, 1])
    return _runs(t, active)


def _runs(t: FloatArray, active: BoolArray) -> list[tuple[float, float]]:
    edge = np.flatnonzero(np.diff(np.concatenate([[0], active.astype(np.int8), [0]])))
    runs = [(float(t[a]), float(t[b - 1])) for a, b in edge.reshape(-1, 2)]
    return [(a - ALONG_M, b + ALONG_M) for a, b in runs if b - a >= SHORT_M]

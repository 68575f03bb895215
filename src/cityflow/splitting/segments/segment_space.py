"""Converts lines in a raster to segments in the world, where their course is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.splitting import ORTHO, FrameRasters, Segments
from cityflow.splitting.segments.line_repeats import without_repeats
from cityflow.splitting.segments.segment_heights import Courses, courses, unbroken
from cityflow.splitting.segments.segment_lines import lengths

SAME_CELLS, SAME_DEG = 1.6, 8.0
"""Lines that are nearer to one another, and turned by less, repeat one another."""
SURE = 3.0
"""Standard deviations that a step or a bend must be above zero."""
LEAST_PIECE_M = 1.5
AWAY_CELLS = 4.5
"""A line found in a picture of the surface may be so far from its crease: what is bent is bent on both flanks."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What a segment must keep to.

    Attributes
    ----------
    near : both ends and the middle lie in it, world metres
    lowest : none lies lower, world metres
    step_m : sides that differ by more are a step, and the upper one carries the segment
    scatter_m : standard deviation of heights along it that is borne
    sigma_m : expected standard deviation of its own heights that is borne
    least_length_m : in space
    least_bend_deg : a surface that bends by less has no crease
    """

    near: Polygon
    lowest: float
    step_m: float
    scatter_m: float
    sigma_m: float
    least_length_m: float
    least_bend_deg: float = 7.0


def segments_in_space(
    lines: FloatArray, raster: FrameRasters, index: int, layer: int, names: tuple[str, ...], limits: Limits
) -> Segments:
    """Lines whose course is known, inside the outline, in the world.

    Parameters
    ----------
    raster : its surface tells the heights
    lines : as `segment_lines` finds them
    index, names : number of the local frame, and names of all of them
    """
    cell = raster.grid.cell
    lines = unbroken(raster.dsm, lines, limits.step_m, LEAST_PIECE_M / cell)
    course = courses(raster.dsm, lines, cell, limits.step_m)
    known = (course.scatter <= limits.scatter_m) & (course.sigma <= limits.sigma_m)
    z = course.z
    if layer != ORTHO:
        step, crease = _seen_in_surface(course, limits)
        known &= step | crease
        lines, z = _at_creases(raster, lines, course, limits)
    first = without_repeats(lines, _trust(lines, known, layer), SAME_CELLS, SAME_DEG)
    lines, z = lines[known & first], z[known & first]
    start, end = (raster.frame.to_world(_frame_xyz(raster, lines[:, i], z[:, i])) for i in (0, 1))
    found = Segments(start, end, np.full(len(start), index, np.int64), np.full(len(start), layer, np.uint8), names)
    return found.take((found.length >= limits.least_length_m) & within(found, limits.near, limits.lowest))


def _trust(lines: FloatArray, known: BoolArray, layer: int) -> IntArray:
    """Those of a known course, in an ortho as they come (grey before colour), in a surface the longest first."""
    order = np.arange(len(lines)) if layer == ORTHO else np.argsort(-lengths(lines), kind="stable")
    return order[known[order]]


def _at_creases(
    raster: FrameRasters, lines: FloatArray, course: Courses, limits: Limits
) -> tuple[FloatArray, FloatArray]:
    """Lines moved to where the planes of both sides meet, with the heights there, if the surface is a crease there indeed.

    If it was a step after all, one of the sides has the step in its midst now, and scatters.
    """
    d = lines[:, 1] - lines[:, 0]
    left = np.column_stack([-d[:, 1], d[:, 0]]) / np.maximum(np.linalg.norm(d, axis=1), 1e-9)[:, None]
    with np.errstate(invalid="ignore"):
        bends = course.bend_deg >= np.maximum(limits.least_bend_deg, SURE * course.bend_sigma_deg)
        meets = np.flatnonzero(bends & (np.abs(course.meet) <= AWAY_CELLS).all(axis=1))
    there = lines[meets] + course.meet[meets, :, None] * left[meets, None]
    again = courses(raster.dsm, there, raster.grid.cell, limits.step_m)
    with np.errstate(invalid="ignore"):
        better = (again.step <= 0.5 * limits.step_m) & (again.scatter <= 1.1 * course.scatter[meets])
    ends, z = lines.copy(), course.z.copy()
    ends[meets[better]], z[meets[better]] = there[better], again.z[better]
    return ends, z


def _seen_in_surface(course: Courses, limits: Limits) -> tuple[BoolArray, BoolArray]:
    """Whether the surface has a step and a crease there: its pictures also show edges where a local mean meets a step from afar."""
    step = course.step >= np.maximum(0.6 * limits.step_m, SURE * course.step_sigma)
    flush = course.step <= np.maximum(limits.step_m, SURE * course.step_sigma)
    bend = course.bend_deg >= np.maximum(limits.least_bend_deg, SURE * course.bend_sigma_deg)
    return np.asarray(step), np.asarray(flush & bend)


def within(segments: Segments, near: Polygon, lowest: float) -> BoolArray:
    """(N,) segments of which both ends and the middle stand inside, above a height."""
    shapely.prepare(near)
    start, end = segments.start, segments.end
    inside = np.minimum(start[:, 2], end[:, 2]) >= lowest
    for share in (0.02, 0.5, 0.98):
        xy = start[:, :2] + share * (end - start)[:, :2]
        inside &= shapely.contains_xy(near, xy[:, 0], xy[:, 1])
    return np.asarray(inside)


def _frame_xyz(raster: FrameRasters, places: FloatArray, z: FloatArray) -> FloatArray:
    grid = raster.grid
    x = grid.x_min + (places[:, 0] + 0.5) * grid.cell
    return np.column_stack([x, grid.y_max - (places[:, 1] + 0.5) * grid.cell, z])

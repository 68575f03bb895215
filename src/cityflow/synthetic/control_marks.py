"""Control and check points of a synthetic flight: places on open ground, and where photographs show them, both with errors of measuring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.control_points import ControlPoint, ControlPoints, Mark, Role
from cityflow.core.grid import Bounds, grown
from cityflow.core.parameters import Parameters
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town

CANDIDATES = 2000
AROUND_M = 60.0
"""What stands this far around the area may hide a point in it."""
ABOVE_M = 0.02
"""Rays start this far above the ground, so that they do not meet it."""
MARGIN_PX = 5.0
LEAST_VIEWS = 3
"""A point that fewer images show is of no use."""
UP = np.array([0.0, 0.0, 1.0])


class ControlParameters(Parameters):
    """Points that a surveyor measures on the ground, and somebody marks in the photographs."""

    points: int = Field(5, ge=0, le=1000, description="control points, in the corners and between them")
    checks: int = Field(10, ge=0, le=1000, description="check points")
    sigma_m: float = Field(
        0.01, ge=0, le=10, description="errors of measured coordinates, per axis, metres (standard deviation)"
    )
    sigma_px: float = Field(
        0.3, ge=0, le=20, description="errors of marks in images, per axis, pixels (standard deviation)"
    )


def true_control(
    town: Town, area: Bounds, images: Sequence[OrientedImage], parameters: ControlParameters, seed: int
) -> ControlPoints:
    """Points on open ground of the area that three images or more show, far from each other, with exact coordinates and exact marks.

    Names are ``C01`` … for control and ``K01`` … for check points; there are fewer where there is no such ground.
    """
    rng = np.random.default_rng([seed, 41])
    low, high = np.array(area[:2]), np.array(area[2:])
    xy = low + rng.random((CANDIDATES, 2)) * (high - low)
    xyz = np.column_stack([xy, town.dtm(xy[:, 0], xy[:, 1])])
    scene = Scene(town.mesh(grown(area, AROUND_M)))
    above = xyz + ABOVE_M * UP - scene.origin
    hit, _ = scene.first_hits(above + 200.0 * UP, np.tile(-UP, (len(xyz), 1)))
    ground = np.isin(scene.surfaces.part[hit], (int(Part.GROUND), int(Part.STREET))) & (hit >= 0)
    seen = np.array([_shows(image, xyz, above, scene) for image in images]).reshape(len(images), len(xyz)) & ground
    usable = np.flatnonzero(seen.sum(axis=0) >= LEAST_VIEWS)
    chosen = usable[_spread(xy[usable], low, high, parameters.points + parameters.checks)]
    control = _roles(len(chosen), parameters)
    numbers = {Role.CONTROL: 0, Role.CHECK: 0}
    points = []
    for k, role in zip(chosen.tolist(), control, strict=True):
        numbers[role] += 1
        name = f"{'C' if role is Role.CONTROL else 'K'}{numbers[role]:02d}"
        marks = tuple(_mark(images[i], xyz[k]) for i in np.flatnonzero(seen[:, k]).tolist())
        points.append(ControlPoint(name, xyz[k], None, role, tuple(sorted(marks, key=lambda m: m.image))))
    return ControlPoints(tuple(sorted(points, key=lambda p: p.name)))


def measured_control(truth: ControlPoints, parameters: ControlParameters, seed: int) -> ControlPoints:
    """The same with errors of surveying and marking, and their standard deviations; a point's errors do not depend on the other points."""
    return replace(truth, points=tuple(_measured(p, parameters, seed) for p in truth.points))


def _shows(image: OrientedImage, xyz: FloatArray, above: FloatArray, scene: Scene) -> BoolArray:
    uv, depth = image.project(xyz)
    found = image.holds(uv, MARGIN_PX) & (depth > 0)
    near = np.flatnonzero(found)
    if near.size:
        found[near] = ~scene.occluded(above[near], image.centre - scene.origin - above[near])
    return found


def _spread(xy: FloatArray, low: FloatArray, high: FloatArray, count: int) -> list[int]:
    """First what is nearest to the four corners and the centre, then always what is farthest from all that is chosen."""
    x, y = np.array([low, high]).T
    wanted = [(x[0], y[0]), (x[1], y[1]), (x[0], y[1]), (x[1], y[0]), (x.mean(), y.mean())]
    chosen: list[int] = []
    for k in range(min(count, len(xy))):
        if k < len(wanted):
            order = np.argsort(np.hypot(*(xy - wanted[k]).T), kind="stable")
            chosen.append(next(i for i in order.tolist() if i not in chosen))
        else:
            apart = np.hypot(*(xy[:, None] - xy[chosen][None]).transpose(2, 0, 1)).min(axis=1)
            chosen.append(int(np.argmax(apart)))
    return chosen


def _roles(count: int, p: ControlParameters) -> list[Role]:
    """Control points come first: they are those in the corners."""
    return [Role.CONTROL if k < p.points else Role.CHECK for k in range(count)]


def _mark(image: OrientedImage, xyz: FloatArray) -> Mark:
    col, row = image.project(xyz[None])[0][0].tolist()
    return Mark(image.name, col, row)


def _measured(point: ControlPoint, p: ControlParameters, seed: int) -> ControlPoint:
    rng = np.random.default_rng([seed, 42, *point.name.encode()])
    xyz = point.xyz + rng.normal(0.0, 1.0, 3) * p.sigma_m
    off = rng.normal(0.0, 1.0, (len(point.marks), 2)) * p.sigma_px
    marks = tuple(
        Mark(m.image, m.col + float(dx), m.row + float(dy), p.sigma_px or None)
        for m, (dx, dy) in zip(point.marks, off, strict=True)
    )
    sigmas = (p.sigma_m,) * 3 if p.sigma_m else None
    return ControlPoint(point.name, xyz, sigmas, point.role, marks)

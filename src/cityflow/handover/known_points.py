"""Control points in the inputs of tasks: plain values that JSON says exactly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isnan, nan

import numpy as np

from cityflow.core.control_points import ControlPoint, Mark, Role
from cityflow.flow.typed import TaskInputs


@dataclass(frozen=True, slots=True)
class KnownMark(TaskInputs):
    """Where an image of the catalog shows a point: columns and rows in pixels, standard deviation where it is stated."""

    image: str
    col: float
    row: float
    sigma_px: float | None


@dataclass(frozen=True, slots=True)
class KnownPoint(TaskInputs):
    """A point in the catalog's CRS: metres; `height` is None where it is unknown."""

    name: str
    east: float
    north: float
    height: float | None
    sigmas_m: tuple[float, float, float] | None
    holds: bool
    marks: tuple[KnownMark, ...]


def known_points(points: Iterable[ControlPoint]) -> tuple[KnownPoint, ...]:
    """Points as inputs of a task."""
    return tuple(
        KnownPoint(
            p.name, float(p.xyz[0]), float(p.xyz[1]), None if isnan(p.xyz[2]) else float(p.xyz[2]), p.sigmas_m,
            p.role is Role.CONTROL, tuple(KnownMark(m.image, m.col, m.row, m.sigma_px) for m in p.marks),
        )
        for p in points
    )  # fmt: skip


def control_points(points: Iterable[KnownPoint]) -> tuple[ControlPoint, ...]:
    """What `known_points` made inputs of."""
    return tuple(
        ControlPoint(
            p.name, np.array([p.east, p.north, nan if p.height is None else p.height]), p.sigmas_m,
            Role.CONTROL if p.holds else Role.CHECK, tuple(Mark(m.image, m.col, m.row, m.sigma_px) for m in p.marks),
        )
        for p in points
    )  # fmt: skip

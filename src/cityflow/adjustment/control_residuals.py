"""How far known points lie from where an adjusted block has them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.adjustment.block import Block
from cityflow.adjustment.control import Control, mark_residuals, seen_places
from cityflow.adjustment.control_check import Doubt
from cityflow.core.arrays import BoolArray, FloatArray

OFF = 4.0
"""Standard deviations from which on a point is named; set by hand, as is the next."""
WORST_MARK = 5.0
"""Standard deviations from which on a single mark is."""


@dataclass(frozen=True, slots=True)
class PointResidual:
    """One point.

    Attributes
    ----------
    name : of the point;  holds : whether it is a control point;  used : not left out
    marks : images that show it
    off : (3,) where the images have it less where it is known to be, metres; NaN in height where that is unknown
    sigmas : (3,) what that may be by its marks and its own coordinates, metres
    mark_px : root mean square distance of its marks from where the block has it, per axis, pixels
    problem, remedy : empty where nothing is wrong
    """

    name: str
    holds: bool
    used: bool
    marks: int
    off: FloatArray
    sigmas: FloatArray
    mark_px: float
    problem: str = ""
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class ControlFigures:
    """All points.

    Attributes
    ----------
    points : in the order of their names
    shift : (3,) by which all given positions lie off the control points together, metres; zeros where nothing tells
    shift_known : whether there were control points enough to tell
    """

    points: tuple[PointResidual, ...]
    shift: FloatArray
    shift_known: bool

    def rms(self, *, holds: bool) -> tuple[float, float] | None:
        """Root mean square residuals in plan (both axes together) and in height of those used; None where there are none."""
        off = np.array([p.off for p in self.points if p.used and p.holds is holds]).reshape(-1, 3)
        if not len(off):
            return None
        up = off[np.isfinite(off[:, 2]), 2]
        return float(np.sqrt(np.mean(np.sum(off[:, :2] ** 2, axis=1)))), float(np.sqrt(np.mean(up**2))) if len(
            up
        ) else 0.0


def point_residuals(
    control: Control, used: BoolArray, block: Block, doubts: Sequence[Doubt], images: Sequence[str]
) -> tuple[PointResidual, ...]:
    """All points against an adjusted block.

    Parameters
    ----------
    used : (C,) which points are not left out
    doubts : of those that are
    images : names by number
    """
    seen, sigmas = seen_places(block, control)
    left = mark_residuals(block, control, seen) if len(seen) else np.empty((0, 2))
    known = {d.name: d for d in doubts}
    total = np.sqrt(sigmas**2 + np.where(np.isfinite(control.sigmas), control.sigmas, 0.0) ** 2)
    found = []
    for k, name in enumerate(control.names):
        rows = control.marks.point == k
        off = seen[k] - control.xyz[k]
        normed = np.linalg.norm(left[rows], axis=1) / control.marks.sigma[rows]
        problem, remedy = _problem(off, total[k])
        if name in known:
            problem, remedy = known[name].problem, known[name].remedy
        elif rows.sum() > 2 and normed.max() > WORST_MARK:
            image = images[int(control.marks.image[rows][int(np.argmax(normed))])]
            far = float(np.linalg.norm(left[rows], axis=1).max())
            problem, remedy = (
                f"its mark in {image} is {far:.1f} px off where the other images have it",
                "mark it again there",
            )
        found.append(
            PointResidual(
                name, bool(control.holds[k]), bool(used[k]), int(rows.sum()), off, total[k],
                float(np.sqrt(np.mean(left[rows] ** 2))), problem, remedy,
            )
        )  # fmt: skip
    return tuple(found)


def _problem(off: FloatArray, sigmas: FloatArray) -> tuple[str, str]:
    normed = np.abs(np.where(np.isfinite(off), off, 0.0)) / sigmas
    if normed.max() <= OFF:
        return "", ""
    plan = float(np.hypot(off[0], off[1]))
    up = f", {off[2] * 100:+.1f} cm in height" if np.isfinite(off[2]) else ""
    return (
        f"the images have it {plan * 100:.1f} cm off in plan{up}, more than its standard deviations say",
        "check its marks and coordinates",
    )

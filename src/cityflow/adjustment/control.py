"""Control points in a block: known places, and the marks that show them, as observations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cityflow.adjustment.block import Block, residuals, slopes
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import summed, triangulated
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.control_points import ControlPoint, Role

MARK_PX = 0.5
"""Of a mark whose standard deviation is not stated, per axis: what a person reaches; set by hand, as is the next."""
PLACE_M = 0.02
"""Of a point whose standard deviations are not stated, per axis: what RTK reaches."""
LEAST_MARKS = 2
"""Fewer leave the point's place in the block open."""


@dataclass(frozen=True, slots=True)
class Control:
    """Points with known places.

    Attributes
    ----------
    names : of C points, each with two marks at least
    holds : (C,) whether a point is for control; others are for checks
    xyz : (C, 3) known places, metres from the block's origin; NaN where a height is unknown
    sigmas : (C, 3) their standard deviations, metres; infinite where a height is unknown
    marks : where images show them; `sigma` in pixels
    """

    names: tuple[str, ...]
    holds: BoolArray
    xyz: FloatArray
    sigmas: FloatArray
    marks: Ties

    def of_points(self, which: BoolArray) -> Control:
        """Some of the (C,) points."""
        names = tuple(n for n, kept in zip(self.names, which, strict=True) if kept)
        return Control(names, self.holds[which], self.xyz[which], self.sigmas[which], self.marks.of_points(which))

    @property
    def weights(self) -> FloatArray:
        """(C, 3) 1 / variance of the known places; 0 where nothing is known."""
        return np.asarray(1.0 / self.sigmas**2)


def control_of(points: Sequence[ControlPoint], number: Mapping[str, int], origin: FloatArray) -> Control:
    """The points that two images of a block show at least.

    Parameters
    ----------
    points : their marks name images as `number` does
    number : image's name → its number in the block
    origin : (3,) of the block's coordinates, world metres
    """
    rows: list[tuple[int, int, float, float, float]] = []
    kept: list[ControlPoint] = []
    for point in sorted(points, key=lambda p: p.name):
        marks = sorted((number[m.image], m) for m in point.marks if m.image in number)
        if len(marks) < LEAST_MARKS:
            continue
        rows += [(len(kept), image, m.col, m.row, m.sigma_px or MARK_PX) for image, m in marks]
        kept.append(point)
    table = np.array(rows, np.float64).reshape(-1, 5)
    whole = table[:, :2].astype(np.int64)
    marks_of = Ties(whole[:, 0], whole[:, 1], np.full(len(table), -1), table[:, 2:4], table[:, 4])
    xyz = np.array([p.xyz - origin for p in kept], np.float64).reshape(-1, 3)
    sigmas = np.array([p.sigmas_m or (PLACE_M,) * 3 for p in kept], np.float64).reshape(-1, 3)
    holds = np.array([p.role is Role.CONTROL for p in kept], bool)
    return Control(tuple(p.name for p in kept), holds, xyz, np.where(np.isfinite(xyz), sigmas, np.inf), marks_of)


def joined(ties: Ties, control: Control | None) -> Ties:
    """Tie points, then the known ones."""
    if control is None:
        return ties
    marks = control.marks
    return Ties(
        np.concatenate([ties.point, ties.points + marks.point]), np.concatenate([ties.image, marks.image]),
        np.concatenate([ties.feature, marks.feature]), np.concatenate([ties.uv, marks.uv]), np.concatenate([ties.sigma, marks.sigma]),
    )  # fmt: skip


def mark_weights(left: FloatArray, sigma: FloatArray) -> FloatArray:
    """(M,) weights of marks, 1 / px²: Cauchy's loss about what most of them are off, so that a block that is far off at first loses none.

    Parameters
    ----------
    left : (M, 2) residuals, pixels;  sigma : (M,) standard deviations, pixels
    """
    normed = np.sum(left**2, axis=1) / sigma**2
    scale = max(float(np.median(normed)) / 1.386, 1.0) if len(normed) else 1.0
    return np.asarray(1.0 / (sigma**2 * scale) / (1.0 + normed / scale / 8.0))


def place_weights(away: FloatArray, control: Control) -> FloatArray:
    """(C, 3) weights of known places, 1 / m²: points that are off by more than three standard deviations lose theirs."""
    known = np.where(np.isfinite(control.xyz), away, 0.0)
    normed = np.sum(known**2 * control.weights, axis=1) / 3.0
    return np.asarray(control.weights / np.maximum(normed / 9.0, 1.0)[:, None])


def seen_places(block: Block, control: Control) -> tuple[FloatArray, FloatArray]:
    """(C, 3) where the images have the points, poses being held; (C, 3) its standard deviations, metres."""
    found = triangulated(replace(block, xyz=np.empty((0, 3))), control.marks)
    of_point = slopes(found, control.marks)[1]
    normal = summed(np.einsum("mki,mkj,m->mij", of_point, of_point, 1.0 / control.marks.sigma**2), control.marks)
    normal += 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    return found.xyz, np.sqrt(np.einsum("cii->ci", np.linalg.inv(normal)))


def mark_residuals(block: Block, control: Control, xyz: FloatArray) -> FloatArray:
    """(M, 2) where marks are less where the block has points at (C, 3) `xyz`, pixels."""
    return residuals(replace(block, xyz=xyz), control.marks)[0]

"""Known points against the block before they hold it: what most of them agree on, and which ones are swapped, of another datum or simply wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations, islice

import numpy as np

from cityflow.adjustment.block import Block
from cityflow.adjustment.control import Control, seen_places
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.geometry.similarity import Similarity, similarity_between

MOST_TRIPLES = 500
"""Of points, from which similarities are tried; bounds time."""
TO_CHECK = 3
"""Control points from which on one of them can be found to be wrong, and the shift of all given positions is known."""


class ContradictionError(ValueError):
    """No more than half of the control points agree with one another."""


@dataclass(frozen=True, slots=True)
class Doubt:
    """A point that is not used: its name, why, and what to do."""

    name: str
    problem: str
    remedy: str


@dataclass(frozen=True, slots=True)
class Agreement:
    """What most control points agree on.

    Attributes
    ----------
    similarity : leads the block to the points
    good : (C,) which points lie where the block has them after it
    doubts : of the others
    """

    similarity: Similarity
    good: BoolArray
    doubts: tuple[Doubt, ...]


def agreement(control: Control, block: Block, tolerance_m: float) -> Agreement:
    """Compare the points with a block that only given positions have placed.

    Parameters
    ----------
    tolerance_m : what points may be off, because the block is not yet better

    Raises
    ------
    ContradictionError
        No more than half of the control points agree with one another.
    """
    seen = seen_places(block, control)[0]
    known = np.where(np.isfinite(control.xyz), control.xyz, np.nan)
    usable = np.flatnonzero(control.holds & np.isfinite(known).all(axis=1))
    if not len(usable):
        unmoved = Similarity(1.0, np.eye(3), np.zeros(3))
        return Agreement(unmoved, np.ones(len(known), bool), ())
    best, most = None, -1.0
    for candidate, unknowns in _candidates(seen[usable], known[usable]):
        left = known[usable] - candidate.moved(seen[usable])
        near = np.linalg.norm(left, axis=1) < tolerance_m
        spare = (
            3.0 * int(near.sum()) - unknowns - float(np.sum(left[near] ** 2)) / (tolerance_m**2 * len(usable) + 1e-300)
        )
        if spare > most:
            best, most = near, spare
    if best is None or (len(usable) > 1 and best.sum() <= len(usable) / 2):
        raise ContradictionError(_contradiction(control, seen, known, usable, tolerance_m))
    similarity = _fitted(seen[usable[best]], known[usable[best]])
    moved = similarity.moved(seen)
    left = np.where(np.isfinite(known), known - moved, 0.0)
    good = np.linalg.norm(left, axis=1) < tolerance_m
    doubts = tuple(_doubt(k, control, moved, known, tolerance_m) for k in np.flatnonzero(~good).tolist())
    return Agreement(similarity, good, doubts)


def placed(block: Block, similarity: Similarity) -> Block:
    """The block, moved as a whole."""
    return replace(
        block, rotations=block.rotations @ similarity.rotation.T, centres=similarity.moved(block.centres), xyz=similarity.moved(block.xyz)
    )  # fmt: skip


def _candidates(seen: FloatArray, known: FloatArray) -> Iterator[tuple[Similarity, int]]:
    """Shifts by each point, similarities by three; and their unknowns."""
    for one, other in zip(seen, known, strict=True):
        yield Similarity(1.0, np.eye(3), other - one), 3
    for three in islice(combinations(range(len(seen)), 3), MOST_TRIPLES if len(seen) > TO_CHECK else 0):
        try:
            yield similarity_between(seen[list(three)], known[list(three)]), 7
        except ValueError:
            continue


def _fitted(seen: FloatArray, known: FloatArray) -> Similarity:
    """Of more than three points a similarity; of fewer, or points on a line, a shift."""
    shift = Similarity(1.0, np.eye(3), np.asarray((known - seen).mean(axis=0)))
    if len(seen) <= TO_CHECK:
        return shift
    try:
        return similarity_between(seen, known)
    except ValueError:
        return shift


def _doubt(k: int, control: Control, moved: FloatArray, known: FloatArray, tolerance_m: float) -> Doubt:
    name, off = control.names[k], known[k] - moved[k]
    others = [j for j in range(len(known)) if j != k and _near(moved[k], known[j], tolerance_m)]
    if others:
        other = control.names[others[0]]
        if _near(moved[others[0]], known[k], tolerance_m):
            return Doubt(
                name, f"it is exchanged with {other}: each is marked where the other one lies", "exchange their names"
            )
        return Doubt(name, f"it is marked where {other} lies", "mark it again")
    if _near(moved[k], known[k][[1, 0, 2]], tolerance_m):
        return Doubt(name, "its x and y are exchanged", "exchange them")
    plan = float(np.hypot(off[0], off[1]))
    if plan < tolerance_m:
        return Doubt(
            name, f"its height is {off[2]:+.2f} m off where the images have it: a wrong height, or one of another datum", "check its height"
        )  # fmt: skip
    up = f" and {off[2]:+.2f} m in height" if np.isfinite(off[2]) else ""
    return Doubt(
        name, f"it is {plan:.2f} m off in plan{up} where the images have it: another point is marked, or its coordinates are wrong",
        "check its marks and coordinates",
    )  # fmt: skip


def _contradiction(control: Control, seen: FloatArray, known: FloatArray, usable: object, tolerance_m: float) -> str:
    rows = np.asarray(usable, np.int64)
    if len(rows) == 2 and all(
        _near(known[a] - known[b], seen[b] - seen[a], tolerance_m) for a, b in (rows, rows[::-1])
    ):
        a, b = (control.names[k] for k in rows)
        return f"control points {a} and {b} are exchanged"
    listed = ", ".join(f"{control.names[k]} {_vector(known[k] - seen[k])}" for k in rows.tolist()[:12])
    return f"the control points contradict one another; they lie off the images by (east, north, up) {listed} m"


def _near(one: FloatArray, other: FloatArray, tolerance_m: float) -> bool:
    off = (one - other)[np.isfinite(one - other)]
    return bool(np.linalg.norm(off) < tolerance_m)


def _vector(off: FloatArray) -> str:
    return "(" + ", ".join(f"{v:.2f}" for v in off.tolist()) + ")"

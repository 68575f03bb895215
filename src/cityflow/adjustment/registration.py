"""Tie points of photographs, led onto a survey: coarsely by what stands over the ground, finely onto planes; refused where the place is ambiguous."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from cityflow.adjustment.coarse_registration import (
    Candidate,
    Patch,
    Search,
    candidates,
    cell_of,
    patch_of,
)
from cityflow.adjustment.height_images import HeightImage, height_image, is_raised, local_ground
from cityflow.adjustment.point_to_plane import PlaneFit, fitted, planes_of
from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.geometry.similarity import Similarity

MOST_POINTS = 40_000
"""Tie points that are used; of more, every n-th; bounds time."""
REACH_M = 4.0
"""Planes are made of the reference within this of where a coarse place has the tie points."""
MOST_OF_PATCH, WORTH_A_FIT = 3000, 0.5
"""Tie points of the patch that decide between places; places whose height images correlate by less than this share of the best one are not fitted."""
GROWTH, WIDENED_GATE = 1.6, 2
"""The fit of the patch is widened to all tie points by this factor of its radius, step by step, from this gate on."""
AGREE_M, IN_PLAN_M = 0.5, 1.5
"""A tie point agrees with a reference that is so near to it; it lies over the reference where this has a point so near in plan."""
LEAST_OVERLAP, LEAST_POINTS = 0.1, 60
"""Share and number of the tie points that must lie over the reference."""
LEAST_AGREE = 0.5
"""Share of the tie points on buildings and trees that must agree. Measured: docs/results.md, registration."""
CLEARLY = 0.85
"""The second place must agree less than this share of what the first one does."""
MOST_OPEN_M = 0.3
"""What planes may leave the place open by (one standard deviation at the radius of the tie points)."""
ELSEWHERE_M = 1.0
"""Two fits that differ by more than this are two places."""


class RegistrationError(ValueError):
    """No place, or no single one; `remedy` says what to do."""

    def __init__(self, problem: str, remedy: str) -> None:
        super().__init__(problem)
        self.remedy = remedy


@dataclass(frozen=True, slots=True)
class Registration:
    """Where tie points lie on a reference.

    Attributes
    ----------
    fit : with the similarity from the tie points as given
    overlap : share of the tie points that lie over the reference
    raised : tie points on buildings and trees, of these;  agreement : share of them that agree
    second : agreement of the next best place; 0 where there is none
    coarse : correlation of the height images at the place
    """

    fit: PlaneFit
    overlap: float
    raised: int
    agreement: float
    second: float
    coarse: float

    @property
    def similarity(self) -> Similarity:
        """From the tie points as given to the reference."""
        return self.fit.similarity


@dataclass(frozen=True, slots=True)
class LevelTies:
    """(N, 3) tie points and (N,) the height of the ground under each."""

    xyz: FloatArray
    ground: FloatArray

    def some(self, chosen: BoolArray) -> LevelTies:
        return LevelTies(self.xyz[chosen], self.ground[chosen])


@dataclass(frozen=True, slots=True)
class Place:
    """As `Registration`."""

    fit: PlaneFit
    overlap: float
    raised: int
    agreement: float
    coarse: float


def registered(xyz: FloatArray, reference: FloatArray, search: Search) -> Registration:
    """Lead tie points onto a survey.

    Parameters
    ----------
    xyz : (N, 3) tie points, metres; level but for a few degrees, and as near to their place as `search` says
    reference : (M, 3) points of a scan or a DSM

    Raises
    ------
    RegistrationError
        The points do not lie over the reference, agree with it nowhere or in several places, or it leaves the place open.
    """
    if len(xyz) < LEAST_POINTS:
        raise RegistrationError(f"{len(xyz)} tie points are too few, {LEAST_POINTS} are needed", "use more photographs")
    xyz = xyz[:: -(-len(xyz) // MOST_POINTS)]
    ties = LevelTies(xyz, local_ground(xyz))
    near = _may_lie_over(xyz, reference, search)
    if near.sum() < LEAST_POINTS:
        raise RegistrationError(
            f"{100.0 * float(near.mean()):.0f} % of the tie points lie within {search.shift_m:.0f} m of the reference",
            "check that both are of one place and in one CRS; what lies further off needs GNSS positions or control points",
        )
    patch = patch_of(xyz, ties.ground, near)
    found = candidates(xyz, ties.ground, patch, _image_of(reference, search), search)
    found = [c for c in found if c.score >= WORTH_A_FIT * found[0].score]
    places = _fits(ties.some(patch.chosen), reference, found)
    if not places:
        best = found[0].score if found else 0.0
        raise RegistrationError(
            f"the tie points fit the reference nowhere (height images correlate by {best:.2f} at most)",
            "check that both are of one place, and of about one time",
        )
    first, second = places[0], next((p for p in places[1:] if differ(places[0], p, xyz[patch.chosen])), None)
    refuse_weak(first)
    refuse_ambiguous(first, second, xyz[patch.chosen])
    whole = _widened(ties, patch, reference, first)
    refuse_weak(whole)
    refuse_open(whole)
    return Registration(
        whole.fit, whole.overlap, whole.raised, whole.agreement, second.agreement if second is not None else 0.0, first.coarse
    )  # fmt: skip


def _fits(ties: LevelTies, reference: FloatArray, found: list[Candidate]) -> list[Place]:
    """Fits of the patch from all coarse places, the one that agrees best first."""
    if not found:
        return []
    # what decides between places needs no more
    ties = ties.some(np.arange(len(ties.xyz)) % -(-len(ties.xyz) // MOST_OF_PATCH) == 0)
    places = np.concatenate([c.similarity.moved(ties.xyz) for c in found])
    around = _clip(reference, places)
    if len(around) < LEAST_POINTS:
        return []
    planes = planes_of(around, places, REACH_M)
    made = []
    for each in found:
        fit = fitted(ties.xyz, planes, each.similarity) if len(planes.xyz) >= LEAST_POINTS else None
        if fit is not None:
            made.append(_place(ties, around, fit, each.score))
    return sorted(made, key=lambda p: -p.agreement * min(1.0, p.overlap / LEAST_OVERLAP))


def _widened(ties: LevelTies, patch: Patch, reference: FloatArray, place: Place) -> Place:
    """The fit of the patch, widened to all tie points."""
    away = np.hypot(*(ties.xyz[:, :2] - patch.middle[:2]).T)
    radius, fit = patch.radius, place.fit
    while True:
        chosen = ties.xyz[away <= radius]
        moved = fit.similarity.moved(chosen)
        wider = fitted(chosen, planes_of(_clip(reference, moved), moved, REACH_M), fit.similarity, WIDENED_GATE)
        fit = wider if wider is not None else fit
        if radius >= away.max() or wider is None:
            break
        radius *= GROWTH
    return _place(ties.some(away <= radius), _clip(reference, fit.similarity.moved(ties.xyz)), fit, place.coarse)


def _place(ties: LevelTies, around: FloatArray, fit: PlaneFit, coarse: float) -> Place:
    """How far tie points agree with the reference after a fit; `fit.distances` are of these points."""
    moved = fit.similarity.moved(ties.xyz)
    over = np.isfinite(cKDTree(around[:, :2]).query(moved[:, :2], distance_upper_bound=IN_PLAN_M)[0])
    raised = over & is_raised(ties.xyz * fit.similarity.scale, ties.ground * fit.similarity.scale)
    if not raised.any():
        return Place(fit, float(over.mean()), 0, 0.0, coarse)
    away = cKDTree(around).query(moved[raised], distance_upper_bound=2 * IN_PLAN_M)[0]
    agrees = (away < AGREE_M) | ((away < IN_PLAN_M) & (np.abs(fit.distances[raised]) < AGREE_M))
    return Place(fit, float(over.mean()), int(raised.sum()), float(agrees.mean()), coarse)


def _image_of(reference: FloatArray, search: Search) -> HeightImage:
    cell = cell_of(float(np.ptp(reference[:, :2], axis=0).max()), search)
    thin = _lowest_and_highest(reference, cell)
    return height_image(thin, local_ground(thin), cell, highest=True)


def _lowest_and_highest(xyz: FloatArray, cell: float) -> FloatArray:
    """Two points of each cell."""
    key = np.floor((xyz[:, :2] - xyz[:, :2].min(axis=0)) / cell).astype(np.int64)
    flat = key[:, 1] * (int(key[:, 0].max()) + 1) + key[:, 0]
    order = np.lexsort((xyz[:, 2], flat))
    starts = np.flatnonzero(np.diff(flat[order], prepend=-1))
    ends = np.append(starts[1:], len(order)) - 1
    return np.asarray(xyz[np.unique(order[np.concatenate([starts, ends])])])


def _may_lie_over(xyz: FloatArray, reference: FloatArray, search: Search) -> BoolArray:
    """(N,) which tie points may lie over the reference's box."""
    if not np.isfinite(search.shift_m):
        return np.ones(len(xyz), bool)
    low, high = reference[:, :2].min(axis=0) - search.shift_m, reference[:, :2].max(axis=0) + search.shift_m
    return np.asarray(((xyz[:, :2] >= low) & (xyz[:, :2] <= high)).all(axis=1))


def _clip(reference: FloatArray, moved: FloatArray) -> FloatArray:
    low, high = moved[:, :2].min(axis=0) - REACH_M, moved[:, :2].max(axis=0) + REACH_M
    return reference[((reference[:, :2] >= low) & (reference[:, :2] <= high)).all(axis=1)]


def differ(one: Place, other: Place, xyz: FloatArray) -> bool:
    off = one.fit.similarity.moved(xyz) - other.fit.similarity.moved(xyz)
    return bool(np.sqrt(np.mean(np.sum(off**2, axis=1))) > ELSEWHERE_M)


def refuse_weak(place: Place) -> None:
    if place.overlap < LEAST_OVERLAP:
        raise RegistrationError(
            f"{100 * place.overlap:.0f} % of the tie points lie over the reference, {100 * LEAST_OVERLAP:.0f} % are needed",
            "give a reference that covers more of the photographs",
        )
    if place.raised < LEAST_POINTS:
        raise RegistrationError(
            f"{place.raised} tie points stand over the ground where the reference is, {LEAST_POINTS} are needed: level ground leaves the place open",
            "check that both are of one place; else give control points (--control)",
        )
    if place.agreement < LEAST_AGREE:
        raise RegistrationError(
            f"{100 * place.agreement:.0f} % of the tie points on buildings and trees agree with the reference at the best place, "
            f"{100 * LEAST_AGREE:.0f} % are needed: the photographs show another place, or it has changed",
            "check that both are of one place, and of about one time; else give control points (--control)",
        )


def refuse_ambiguous(first: Place, second: Place | None, xyz: FloatArray) -> None:
    if second is None or second.agreement <= CLEARLY * first.agreement:
        return
    off = second.fit.similarity.moved(xyz) - first.fit.similarity.moved(xyz)
    raise RegistrationError(
        f"ambiguous: {100 * first.agreement:.0f} % of the tie points on buildings and trees agree at one place, and {100 * second.agreement:.0f} % "
        f"at another one, {float(np.median(np.linalg.norm(off, axis=1))):.1f} m off",
        "give a nearer place (GNSS positions, --scale), or control points (--control)",
    )


def refuse_open(place: Place) -> None:
    if (open_m := float(place.fit.openness_m[0])) > MOST_OPEN_M:
        raise RegistrationError(
            f"walls and sloping roofs are too few to hold the place: it stays open by {open_m:.2f} m, {MOST_OPEN_M} m are allowed",
            "give a reference with more buildings, or control points (--control)",
        )

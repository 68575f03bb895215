"""Figures of a model for its verdict: shares of its roof in plan, and of points that were held back from the fit."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Polyhedron, Semantic
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import NEAR, distances_to_roof, roof_hits
from cityflow.reconstruction.verdicts.beside_outline import Borders, borders_of
from cityflow.reconstruction.verdicts.lacked_steps import lacked_share
from cityflow.reconstruction.verdicts.no_roof import Kind
from cityflow.reconstruction.verdicts.placement import placement_of
from cityflow.reconstruction.verdicts.roof_fit import RoofFit
from cityflow.reconstruction.verdicts.roof_parts import plane_count, slight_share, step_length
from cityflow.reconstruction.verdicts.seen_elsewhere import probability_of_harm, seen_elsewhere
from cityflow.reconstruction.verdicts.sides import Sides, sides_of
from cityflow.reconstruction.verdicts.surroundings import SEEN_M, SEEN_SPACINGS, beside_of, surroundings_of
from cityflow.reconstruction.verdicts.traces import traces_of

PLACES, STEP_M = 1200, (0.2, 1.0)
"""Of the lattice on an outline, and its least and greatest step; bounds time."""
VOTERS = 3
"""The nearest points decide whether a place of the roof is right; more of them outvote a dormer that has three; set by hand."""
SIGMAS = 3.0
"""The usual three."""
FEW_POINTS = 3.0
"""So many points that are right are added to those of each plane: one point off of two is no half of a plane; set by hand."""


@dataclass(frozen=True, slots=True)
class Figures:
    """Figures of one unit; all shares 0 to 1, more is worse.

    Attributes
    ----------
    off : of the roof's area, where the points around say that it is off by more than 20 cm and more than noise does
    worst : of the points on one plane, those more than 20 cm off, less what noise does; the worst plane
    unseen : of the roof's area, with no roof point near
    loose : of the points held back, more than 20 cm off
    strange : of the points held back, further off than three standard deviations of the noise
    unsure : of the roof's area, where models from other points differ from this one by more than 20 cm; 0 where there were points enough
    missed : of the roof's area, what the outline misses or adds, by the ends of the roof and by façades, in the mean over what is likely
    misplaced : probability that this is more than a good model can bear
    astray : probability that single sides of the outline, each by itself, miss or add more than a good model can bear; of matched surfaces
    beside : points per square metre that go on beyond the outline, by those on the roof
    error_m : metres, what the model claims of itself
    few : one by the root of the number of points on the plane, in the mean over the roof
    noise : metres, robust standard deviation of the points that the roof explains
    steps : metres of walls within the outline, by the roof's area, times the spacing of points: where a step stands is known no better
    shared : share of the outline that touches other units, times `few`: what hangs over from there is seen by points alone
    divided : number of planes times `noise`, by the root of the roof's area: of many small planes under noisy points some are wrong
    slight : of the roof's area, planes that depart from a larger one by more than 20 cm, but by little more than noise; of matched surfaces
    faceted : number of roof faces by the root of the roof's area, one by metres: of many parts one is wrong sooner
    lacked : of the roof's area, where the surface has a step that the model lacks; of matched surfaces
    holed : of the outline's free rim, beside which surface and façade are unknown: the roof may go on there; of matched surfaces
    ramped : of the roof's area, beside other units, where the model leaves its plane towards their roofs: matching draws such slopes; of matched surfaces
    stepped : of the roof's area, within 20 cm of a unit whose roof is at another height; of matched surfaces
    points : number of roof points
    held : number of roof points held back
    matched : points are of a surface that was matched or given, not a scanner's
    worst_side : the side of the outline that is most in doubt, in words
    elsewhere : probability that photographs show steps and borders elsewhere, with more of the roof between than a good model can bear
    """

    off: float
    worst: float
    unseen: float
    loose: float
    strange: float
    unsure: float
    missed: float
    misplaced: float
    astray: float
    beside: float
    error_m: float
    few: float
    noise: float
    steps: float
    shared: float
    divided: float
    slight: float
    faceted: float
    lacked: float
    holed: float
    ramped: float
    stepped: float
    points: int
    held: int
    matched: bool = False
    worst_side: str = ""
    elsewhere: float = 0.0


@dataclass(frozen=True, slots=True)
class HeldBack:
    """Points that a fit did not see.

    Attributes
    ----------
    points : (N,) which of the unit's points
    distance : (N,) from the model that was made without them, metres; read where `points`
    others : models from other points, to hold against the one that is kept
    """

    points: BoolArray
    distance: FloatArray
    others: tuple[Polyhedron, ...] = ()


def figures_of(solid: Polyhedron, evidence: Evidence, fit: RoofFit, held: HeldBack, claim: float | None) -> Figures:
    """All figures of one unit. `claim`: error that the model expects, metres."""
    xy, roof = evidence.points.xyz[:, :2], fit.roof
    judged = held.points & roof
    distance = np.abs(np.where(np.isfinite(held.distance), held.distance, np.inf))[judged]
    places = roof_places(evidence.outline)
    face, own = roof_hits(solid, np.column_stack([places, np.zeros(len(places))]))
    around = surroundings_of(solid, evidence, fit)
    traces = traces_of(evidence, around, fit.density)
    placement = placement_of(evidence.outline, traces)
    sides = sides_of(evidence.outline, traces) if evidence.matched else Sides()
    few = _few(solid, face, fit)
    borders = borders_of(solid, evidence, face, places) if evidence.matched else Borders()
    return Figures(
        off=_off(places, xy, fit),
        worst=_worst(solid, fit),
        unseen=_unseen(places, xy[roof], fit.density),
        loose=_share(distance > NEAR),
        strange=_share(distance > SIGMAS * fit.noise),
        unsure=_unsure(own, held.others, places),
        missed=placement.missed,
        misplaced=placement.misplaced,
        astray=sides.astray,
        beside=beside_of(evidence, around, fit.density),
        error_m=float(claim) if claim is not None and math.isfinite(claim) else 1.0,
        few=few,
        noise=fit.noise,
        steps=step_length(solid, evidence.outline) / evidence.outline.area / math.sqrt(fit.density),
        shared=sum(p.length for p in evidence.party) / evidence.outline.length * few,
        divided=plane_count(solid) * fit.noise / math.sqrt(evidence.outline.area),
        slight=slight_share(solid, face, places, fit.noise) if evidence.matched else 0.0,
        faceted=len(solid.of_semantic(Semantic.ROOF)) / math.sqrt(evidence.outline.area),
        lacked=lacked_share(solid, evidence.outline, evidence.heights)
        if evidence.matched and evidence.heights
        else 0.0,
        holed=borders.holed,
        ramped=borders.ramped,
        stepped=borders.stepped,
        points=int(roof.sum()),
        held=int(judged.sum()),
        matched=evidence.matched,
        worst_side=sides.worst,
        elsewhere=probability_of_harm(seen_elsewhere(solid, evidence), evidence.outline.area),
    )


def _share(mask: BoolArray) -> float:
    """Share of what is true; of nothing, one."""
    return float(np.mean(mask)) if len(mask) else 1.0


def roof_places(outline: Polygon) -> FloatArray:
    """(P, 2) places all over the outline in plan, evenly spaced."""
    step = float(np.clip(math.sqrt(outline.area / PLACES), *STEP_M))
    x_0, y_0, x_1, y_1 = outline.bounds
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x_0 + step / 2, x_1, step), np.arange(y_0 + step / 2, y_1, step)))
    inside = shapely.contains_xy(outline, x, y)
    found = np.column_stack([x[inside], y[inside]])
    return found if len(found) else shapely.get_coordinates(outline.representative_point())


def _off(places: FloatArray, xy: FloatArray, fit: RoofFit) -> float:
    """Share of places where most of the nearest points are off; lone points above or below a roof count, echoes of façades do not."""
    counted = fit.kinds != Kind.FACADE
    if not counted.any():
        return 0.0
    off = ~(np.abs(fit.distance[counted]) <= max(NEAR, SIGMAS * fit.noise))
    voters = min(VOTERS, len(off))
    who = cKDTree(xy[counted]).query(places, voters)[1].reshape(len(places), voters)
    return float(np.mean(off[who].mean(axis=1) > 0.5))


def _worst(solid: Polyhedron, fit: RoofFit) -> float:
    """Points off, of those on one plane, beyond what noise does; the worst of all planes."""
    on = fit.roof & (fit.face >= 0)
    plane = _planes_of(solid, fit.face[on])
    count = np.bincount(plane)
    off = np.bincount(plane, np.abs(fit.distance[on]) > NEAR)
    return max(0.0, float(((off - count * fit.by_chance) / (count + FEW_POINTS)).max(initial=0.0)))


def _few(solid: Polyhedron, face: IntArray, fit: RoofFit) -> float:
    """One by the root of the number of points that support the plane, in the mean over the places of the roof."""
    on = fit.explained
    count = np.bincount(_planes_of(solid, fit.face[on]), minlength=len(solid.faces) + 1)
    here = np.where(face >= 0, count[_planes_of(solid, face)], 0)
    return float(np.mean(1.0 / np.sqrt(np.maximum(here, 1))))


def _planes_of(solid: Polyhedron, face: IntArray) -> IntArray:
    """(N,) number of the plane of each face, from 1 on; 0 for faces of no plane."""
    plane = np.array([f.plane for f in solid.faces], np.int64) + 1
    return np.asarray(np.where(face >= 0, plane[face], 0))


def _unseen(places: FloatArray, xy: FloatArray, density: float) -> float:
    """Share of places that no roof point is near."""
    if not len(xy):
        return 1.0
    near = float(np.clip(SEEN_SPACINGS / math.sqrt(density), *SEEN_M))
    return float(np.mean(cKDTree(xy).query(places)[0] > near))


def _unsure(own: FloatArray, others: tuple[Polyhedron, ...], places: FloatArray) -> float:
    """Share of places where the other models stand elsewhere, in the mean over them; `own`: of places at height 0."""
    if not others:
        return 0.0
    spots = np.column_stack([places, np.zeros(len(places))])
    return float(np.mean([~(np.abs(distances_to_roof(other, spots) - own) <= NEAR) for other in others]))

"""What the points say of a model, as figures that a verdict is made from: shares of its roof in plan, and of points that the fit did not see."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Polyhedron
from cityflow.core.points import BUILDING
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import NEAR, distances_to_roof, roof_hits
from cityflow.reconstruction.verdicts.no_roof import Kind, kinds_of

PLACES, STEP_M = 1200, (0.2, 1.0)
VOTERS = 5
"""The nearest points decide whether a place of the roof is right."""
SEEN_SPACINGS, SEEN_M = 1.2, (0.3, 3.0)
"""A place is seen where a roof point is within this many spacings of points, within bounds; evenly strewn points leave out one place of a hundred."""
NEIGHBOURS = 4
"""The distance to this neighbour tells the density where points are."""
LEAST_NOISE_M = 0.02
BESIDE_M = (1.0, 2.0)
"""Where a roof that goes on beyond the outline would have points; nearer are eaves."""
RIM_STEP_M, RIM_SPACINGS = 0.5, 1.5
"""At an edge only half of the surroundings can hold points."""
LEAST_UPWARD = 1e-3
FROM_CLOUD = 1.4826


@dataclass(frozen=True, slots=True)
class RoofFit:
    """The points of a unit against its model.

    Attributes
    ----------
    distance : (N,) above the topmost roof, metres, NaN where there is none
    kinds : (N,) `no_roof.Kind`
    noise : metres, robust standard deviation of the points that the roof explains
    """

    distance: FloatArray
    kinds: IntArray
    noise: float

    @property
    def roof(self) -> BoolArray:
        """(N,) the points that are of the roof, or of a structure that the model lacks."""
        return np.asarray(self.kinds == Kind.ROOF)


def fit_of(solid: Polyhedron, evidence: Evidence) -> RoofFit:
    """Distances and kinds of all points of the unit."""
    xyz = evidence.points.xyz
    distance = distances_to_roof(solid, xyz)
    near = distance[np.abs(distance) <= NEAR]
    noise = FROM_CLOUD * float(np.median(np.abs(near - np.median(near)))) if len(near) else NEAR
    density = density_of(xyz)
    kinds = kinds_of(solid, xyz, distance, float(solid.vertices[:, 2].min()), density, noise)
    return RoofFit(distance, kinds, max(noise, LEAST_NOISE_M))


@dataclass(frozen=True, slots=True)
class Figures:
    """Figures of one unit; all shares 0 to 1, more is worse.

    Attributes
    ----------
    off : of the roof's area, where the points around say that it is more than 20 cm off
    unseen : of the roof's area, with no roof point near
    loose : of the points held back, more than 20 cm off
    strange : of the points held back, further off than three standard deviations of the noise
    unsure : of the roof's area, where models from other points differ from this one by more than 20 cm; 0 where there were points enough
    no_roof : of all points, those that are no roof
    foreign : of the points that the roof explains, those that the survey does not call building, or behind which the pulse went on
    rim : of the outline where no other unit stands, stretches with no roof point near: the roof ends before it
    beside : points per square metre that go on beyond the outline, by those on the roof
    error_m : metres, what the model claims of itself
    few : one by the root of the number of roof points
    held : number of roof points held back
    """

    off: float
    unseen: float
    loose: float
    strange: float
    unsure: float
    no_roof: float
    foreign: float
    rim: float
    beside: float
    error_m: float
    few: float
    held: int


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


def figures_of(
    solid: Polyhedron, evidence: Evidence, fit: RoofFit, held: HeldBack, claim: float | None, classified: bool
) -> Figures:
    """All figures of one unit. `classified`: the survey says which points are buildings."""
    xyz, roof = evidence.points.xyz, fit.roof
    judged = held.points & roof
    distance = np.abs(np.where(np.isfinite(held.distance), held.distance, np.inf))[judged]
    on = roof & (np.abs(fit.distance) <= NEAR)
    places = roof_places(evidence.outline)
    off, unseen = _by_place(places, xyz[roof, :2], fit.distance[roof], density_of(xyz[roof]))
    return Figures(
        off=off,
        unseen=unseen,
        loose=_share(distance > NEAR),
        strange=_share(distance > 3 * fit.noise),
        unsure=_unsure(solid, held.others, places),
        no_roof=1.0 - _share(roof) if len(roof) else 1.0,
        foreign=_foreign(evidence, on, classified),
        rim=_rim(evidence, xyz[roof, :2]),
        beside=_beside(solid, evidence, on),
        error_m=float(claim) if claim is not None and math.isfinite(claim) else 1.0,
        few=1.0 / math.sqrt(max(int(roof.sum()), 1)),
        held=int(judged.sum()),
    )


def density_of(xyz: FloatArray) -> float:
    """Points per square metre in plan where there are points; 1 where there are too few to tell."""
    if len(xyz) <= NEIGHBOURS:
        return 1.0
    far = cKDTree(xyz[:, :2]).query(xyz[:, :2], NEIGHBOURS + 1)[0][:, -1]
    return NEIGHBOURS / (math.pi * max(float(np.median(far)), 0.01) ** 2)


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


def _by_place(places: FloatArray, xy: FloatArray, distance: FloatArray, density: float) -> tuple[float, float]:
    """Shares of places that the nearest points say are off, and that no point is near."""
    if not len(xy):
        return 0.0, 1.0
    spacing = 1.0 / math.sqrt(max(density, 1e-6))
    near = float(np.clip(SEEN_SPACINGS * spacing, *SEEN_M))
    count = min(VOTERS, len(xy))
    far, who = cKDTree(xy).query(places, count)
    far, who = far.reshape(len(places), count), who.reshape(len(places), count)
    votes = np.abs(distance[who]) > NEAR
    votes |= ~np.isfinite(distance[who])
    counted = far <= max(2 * near, SEEN_M[0])
    share = (votes & counted).sum(axis=1) / np.maximum(counted.sum(axis=1), 1)
    seen = far[:, 0] <= near
    return float(np.mean(seen & (share > 0.5))), float(np.mean(~seen))


def _unsure(solid: Polyhedron, others: tuple[Polyhedron, ...], places: FloatArray) -> float:
    """Share of places where the other models stand elsewhere, in the mean over them."""
    if not others:
        return 0.0
    spots = np.column_stack([places, np.zeros(len(places))])
    own = distances_to_roof(solid, spots)
    apart = [~(np.abs(distances_to_roof(other, spots) - own) <= NEAR) for other in others]
    return float(np.mean(apart))


def _foreign(evidence: Evidence, on: BoolArray, classified: bool) -> float:
    """Share of the explained points that are hardly a roof's: leaves let pulses through, and surveys know their buildings."""
    points = evidence.points
    if not on.any():
        return 1.0
    through = points.return_number < points.number_of_returns
    other = points.classification != BUILDING if classified else np.zeros(len(points), bool)
    return float(np.mean((through | other)[on]))


def _rim(evidence: Evidence, xy: FloatArray) -> float:
    """Share of the free edges along which no roof point is near."""
    edge = evidence.outline.boundary
    if evidence.party:
        edge = edge.difference(shapely.union_all([p.buffer(SEEN_M[0]) for p in evidence.party]))
    if edge.length < 1.0 or not len(xy):
        return 0.0
    places = shapely.get_coordinates(shapely.segmentize(edge, RIM_STEP_M))
    far = cKDTree(xy).query(places)[0]
    return float(np.mean(far > float(np.clip(RIM_SPACINGS / math.sqrt(density_of(xy)), *SEEN_M))))


def _beside(solid: Polyhedron, evidence: Evidence, on: BoolArray) -> float:
    """Density of points that continue the roof beyond the outline, where no other unit stands, by that of the roof's."""
    around = evidence.around.xyz
    if not len(around) or not on.any():
        return 0.0
    ring = evidence.outline.buffer(BESIDE_M[1]).difference(evidence.outline.buffer(BESIDE_M[0]))
    if evidence.party:
        ring = ring.difference(shapely.union_all([p.buffer(BESIDE_M[1] + 1.0) for p in evidence.party]))
    if ring.area < 1.0:
        return 0.0
    roof, spacing = evidence.points.xyz[on], 1.0 / math.sqrt(density_of(evidence.points.xyz[on]))
    near = shapely.dwithin(shapely.points(around[:, :2]), evidence.outline, BESIDE_M[0])
    bridge = _continuing(solid, roof, around[near & ~shapely.contains_xy(evidence.outline, *around[:, :2].T)])
    outside = _continuing(solid, roof, around[shapely.contains_xy(ring, around[:, 0], around[:, 1])])
    if not len(bridge) or not len(outside):
        return 0.0
    # what goes on without a gap; a neighbour across a gap of the same shape does not
    joined = cKDTree(bridge[:, :2]).query(outside[:, :2])[0] <= max(BESIDE_M[1] - BESIDE_M[0], SEEN_SPACINGS * spacing)
    return min(float(joined.sum()) / ring.area * spacing**2, 2.0)


def _continuing(solid: Polyhedron, roof: FloatArray, xyz: FloatArray) -> FloatArray:
    """Those of some points beyond the outline that lie in the plane of the nearest roof."""
    if not len(xyz):
        return xyz
    face = roof_hits(solid, roof[cKDTree(roof[:, :2]).query(xyz[:, :2])[1]])[0]
    return np.asarray(xyz[np.abs(xyz[:, 2] - _planes_at(solid, face, xyz[:, :2])) <= NEAR])


def _planes_at(solid: Polyhedron, faces: IntArray, xy: FloatArray) -> FloatArray:
    """(N,) heights of the planes of some faces at places that may lie beyond them, metres."""
    z = np.full(len(xy), np.nan)
    for face in np.unique(faces[faces >= 0]):
        corners = solid.ring(solid.faces[face].rings[0])
        middle = corners.mean(axis=0)
        normal = np.linalg.svd(corners - middle, full_matrices=False)[2][-1]
        here = faces == face
        if abs(normal[2]) > LEAST_UPWARD:
            z[here] = middle[2] - ((xy[here] - middle[:2]) @ normal[:2]) / normal[2]
    return z

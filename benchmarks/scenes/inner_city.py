"""Old inner-city roofs under a laser scanner: storeys, terraces, upper storeys and stair houses on one crooked outline, and what stands upon them.

A row of houses shares one street front. Each outline is cut into parts of different storeys; a part is a terrace or a low tiled roof. Clutter
(chimneys, parapets, machines, plants, antennas) reflects as on a real roof and is no part of the truth that models are asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import shapely
from pydantic import Field
from shapely import LineString, Polygon
from shapely.geometry.polygon import orient
from shapely.ops import split

from cityflow.core.arrays import FloatArray
from cityflow.core.parameters import Parameters
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.synthetic.known_terrain import plane
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.roofs import CHIMNEY, DORMER, MAIN, LocalFace, Placement, visible_faces
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from scenes.prism_scene import PrismScene, TruthBuilding

STOREY_M = 3.1
LEAST_PART_M2 = 6.0
LEAST_PLANE_M2 = 1.5
FLOOR_M = 20.0
WEST_M, SOUTH_M = 11060.0, 12060.0
"""In the middle of a tile of the scanner."""
PARAPET_M = 0.25
WAVES = 12


class InnerCityParameters(Parameters):
    """A row of old houses, and how it was scanned."""

    houses: int = Field(8, ge=1, le=100, description="houses in the row")
    density_m2: float = Field(15.0, gt=0.2, le=100, description="pulses per square metre, all strips together")
    flying_height_m: float = Field(600.0, ge=150, le=5000, description="above ground, metres")
    sigma_z_m: float = Field(0.03, ge=0, le=1, description="ranging noise, metres (standard deviation)")
    sigma_xy_m: float = Field(0.08, ge=0, le=1, description="planimetric noise per axis, metres (standard deviation)")
    unevenness_m: float = Field(
        0.04, ge=0, le=0.5, description="waves of old roofs, 1 to 5 m long, metres (standard deviation)"
    )
    clutter: float = Field(
        1.0, ge=0, le=5, description="chimneys, parapets, machines, plants and antennas; 0: bare roofs"
    )


@dataclass(frozen=True, slots=True)
class Clutter:
    """What stands on a roof: solid things as faces; loose ones as plan, height above the roof (m) and share of pulses that they stop."""

    solid: tuple[LocalFace, ...]
    loose: tuple[tuple[Polygon, float, float], ...]


@dataclass(frozen=True, slots=True)
class OldHouse:
    """A house as it was built and as it was scanned.

    Attributes
    ----------
    evidence : what reconstruction is given: outline, points of roof, walls and clutter above it, floor
    building : faces without clutter
    """

    evidence: Evidence
    building: TruthBuilding

    @property
    def planes(self) -> int:
        """Number of different planes with at least `LEAST_PLANE_M2`."""
        at = np.asarray(self.building.outline.centroid.coords[0])
        area: dict[tuple[float, float, float], float] = {}
        for face in self.building.faces:
            p = face.plane
            key = round(p.slope_x, 3), round(p.slope_y, 3), round(float(p.z(at[:1], at[1:])[0]), 2)
            area[key] = area.get(key, 0.0) + face.polygon.area
        return sum(a >= LEAST_PLANE_M2 for a in area.values())

    def roof_points(self, spacing_m: float = 0.4, margin_m: float = 0.3) -> FloatArray:
        """(N, 3) places of the true roof, on a lattice, away from the outline; under clutter, too."""
        x_0, y_0, x_1, y_1 = self.building.outline.bounds
        x, y = (a.ravel() for a in np.meshgrid(np.arange(x_0, x_1, spacing_m), np.arange(y_0, y_1, spacing_m)))
        inside = shapely.contains_xy(self.building.outline.buffer(-margin_m), x, y)
        return np.column_stack([x[inside], y[inside], self.building.z(x[inside], y[inside])])


def inner_city(seed: int, parameters: InnerCityParameters | None = None) -> tuple[OldHouse, ...]:
    """A row of old houses from one seed: the same seed and parameters give the same bytes."""
    p = parameters or InnerCityParameters()
    town, flight = (np.random.default_rng([seed, 71, k]) for k in range(2))
    heading, at = town.uniform(0, np.pi), 0.0
    drafts = []
    for _ in range(p.houses):
        plot = _crooked(town)
        faces = _roof(town, plot)
        where = Placement(WEST_M + at * np.cos(heading), SOUTH_M + at * np.sin(heading), heading, FLOOR_M)
        drafts.append(Draft(where, plot, faces, _clutter(town, faces, p.clutter)))
        at += plot.bounds[2] + town.uniform(1.5, 4.0)
    return _scanned((seed, flight), drafts, p)


@dataclass(frozen=True, slots=True)
class Draft:
    """A house in its own frame, and where that lies."""

    where: Placement
    plot: Polygon
    faces: list[LocalFace]
    clutter: Clutter

    def building(self, number: int, faces: Sequence[LocalFace]) -> TruthBuilding:
        prisms = tuple(self.where.face(f) for f in faces)
        outline = orient(Polygon(self.where.to_world(self.plot.exterior.coords[:-1])))
        return TruthBuilding(f"h{number:02d}", "old", outline, visible_faces(prisms), prisms, FLOOR_M)

    def in_world(self, plan: Polygon) -> Polygon:
        return Polygon(self.where.to_world(plan.exterior.coords[:-1]))


def _crooked(rng: np.random.Generator) -> Polygon:
    """A four-sided plot with sides of 9 to 18 m without right angles; some have a court cut into a side."""
    length, depth = rng.uniform(9, 18), rng.uniform(9, 18)
    corners = np.array([(0.0, 0.0), (length, 0.0), (length, depth), (0.0, depth)])
    corners += rng.uniform(0, 0.09, (4, 2)) * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (length, depth)
    plot = Polygon(corners)
    if rng.random() < 0.4:
        width, reach, u = rng.uniform(2.5, 4.0), rng.uniform(2.5, 5.0), rng.uniform(2.5, length - 6.5)
        plot = plot.difference(shapely.box(u, depth - reach, u + width, depth + 1))
    return orient(plot)


def _roof(rng: np.random.Generator, plot: Polygon) -> list[LocalFace]:
    """Faces of the parts of a plot, each with its own storeys, and what rises above them."""
    faces: list[LocalFace] = []
    base = int(rng.integers(3, 6)) * STOREY_M
    for part in _parts(rng, plot, int(rng.integers(3, 9))):
        eave = base + int(rng.integers(-2, 2)) * STOREY_M + rng.uniform(-0.5, 0.5)
        if rng.random() < 0.35:
            faces += _tiled(rng, part, eave)
            continue
        faces += _face(part, (0.0, 0.0), eave, MAIN)
        upper = part.buffer(-rng.uniform(1.3, 2.2), join_style="mitre")
        if upper.geom_type == "Polygon" and upper.area > 12 and rng.random() < 0.5:
            slopes = (0.0, rng.uniform(-0.1, 0.1)) if rng.random() < 0.5 else (0.0, 0.0)
            faces += _face(upper, slopes, eave + rng.uniform(2.5, 3.2), MAIN)
        elif part.area > 25:
            stair = _within(rng, part, (rng.uniform(2.0, 3.2), rng.uniform(2.4, 4.2)))
            faces += _face(stair, (0.0, 0.0), eave + rng.uniform(2.1, 2.7), DORMER)
    return faces


def _parts(rng: np.random.Generator, plot: Polygon, count: int) -> list[Polygon]:
    """A plot cut across its longer side, again and again, by lines that are nearly parallel to the other one."""
    parts = [plot]
    while len(parts) < count:
        largest = max(range(len(parts)), key=lambda k: parts[k].area)
        u_0, v_0, u_1, v_1 = parts[largest].bounds
        share, tilt = rng.uniform(0.3, 0.7), rng.normal(0, 0.06)
        if u_1 - u_0 > v_1 - v_0:
            u = u_0 + share * (u_1 - u_0)
            line = LineString([(u - 50 * tilt, v_0 - 50), (u + 50 * tilt, v_1 + 50)])
        else:
            v = v_0 + share * (v_1 - v_0)
            line = LineString([(u_0 - 50, v - 50 * tilt), (u_1 + 50, v + 50 * tilt)])
        cut = [orient(g) for g in split(parts[largest], line).geoms]
        if min(g.area for g in cut) < LEAST_PART_M2:
            break
        parts[largest : largest + 1] = cut
    return parts


def _tiled(rng: np.random.Generator, part: Polygon, eave: float) -> list[LocalFace]:
    """A shed, or a gable with its ridge along u, over any plan."""
    slope, (u_0, v_0, u_1, v_1) = float(np.tan(np.radians(rng.uniform(10, 28)))), part.bounds
    if rng.random() < 0.5:
        return _face(part, (0.0, slope), eave - slope * v_0, MAIN)
    middle = (v_0 + v_1) / 2
    low, high = shapely.box(u_0, v_0, u_1, middle), shapely.box(u_0, middle, u_1, v_1)
    return [
        *_face(part.intersection(low), (0.0, slope), eave - slope * v_0, MAIN),
        *_face(part.intersection(high), (0.0, -slope), eave + slope * v_1, MAIN),
    ]


def _face(plan: shapely.Geometry, slopes: tuple[float, float], height: float, kind: str) -> list[LocalFace]:
    return [LocalFace(tuple(g.exterior.coords)[:-1], *slopes, height, kind) for g in _polygons(plan)]


def _polygons(plan: shapely.Geometry) -> list[Polygon]:
    parts = shapely.get_parts(shapely.simplify(plan, 1e-3))
    return [g for g in parts if isinstance(g, Polygon) and g.area > 0.05]


def _within(rng: np.random.Generator, part: Polygon, size: tuple[float, float]) -> Polygon:
    """A box of some size somewhere on a part, at one of its sides as often as not."""
    u_0, v_0, u_1, v_1 = part.bounds
    u = u_0 if rng.random() < 0.3 else rng.uniform(u_0, max(u_1 - size[0], u_0))
    v = v_0 if rng.random() < 0.3 else rng.uniform(v_0, max(v_1 - size[1], v_0))
    return part.intersection(shapely.box(u, v, u + size[0], v + size[1]))


def _clutter(rng: np.random.Generator, faces: Sequence[LocalFace], amount: float) -> Clutter:
    """Parapets, chimneys and machines; plants, pergolas and antennas."""
    solid: list[LocalFace] = []
    loose: list[tuple[Polygon, float, float]] = []
    for face in faces:
        plan, level = Polygon(face.ring), face.slope_u == face.slope_v == 0
        if level and rng.random() < 0.6 * amount:
            solid += _parapet(plan, face.height + rng.uniform(0.3, 1.0))
        for _ in range(rng.poisson(amount * plan.area / (14.0 if level else 40.0))):
            thing = _within(rng, plan, (rng.uniform(0.4, 1.3), rng.uniform(0.4, 1.3)))
            solid += _face(thing, (0.0, 0.0), _top(face, thing) + rng.uniform(0.3, 1.6), CHIMNEY)
        for _ in range(rng.poisson(amount * plan.area / 40.0)):
            thing = _within(rng, plan, (rng.uniform(0.5, 3.0), rng.uniform(0.5, 3.0)) if level else (0.5, 0.5))
            loose += [(g, rng.uniform(0.5, 2.5), rng.uniform(0.3, 0.8)) for g in _polygons(thing)]
    return Clutter(tuple(solid), tuple(loose))


def _parapet(plan: Polygon, top: float) -> list[LocalFace]:
    rim = plan.difference(plan.buffer(-PARAPET_M, join_style="mitre"))
    sides = [LineString(ends).buffer(PARAPET_M, cap_style="square") for ends in pairwise(plan.exterior.coords)]
    return [f for side in sides for f in _face(rim.intersection(side), (0.0, 0.0), top, CHIMNEY)]


def _top(face: LocalFace, plan: shapely.Geometry) -> float:
    """Height of a face in the middle of a plan."""
    if plan.is_empty:
        return face.height
    u, v = plan.centroid.coords[0]
    return face.slope_u * u + face.slope_v * v + face.height


def _scanned(
    draws: tuple[int, np.random.Generator], drafts: Sequence[Draft], p: InnerCityParameters
) -> tuple[OldHouse, ...]:
    """All houses under one scanner; each gets the echoes inside its outline. A pulse has one echo, noise comes with the waves and the clutter."""
    seed, rng = draws
    bare = [d.building(k, d.faces) for k, d in enumerate(drafts)]
    full = [
        replace(b, prisms=d.building(k, [*d.faces, *d.clutter.solid]).prisms)
        for k, (b, d) in enumerate(zip(bare, drafts, strict=True))
    ]
    x_0, y_0, x_1, y_1 = shapely.union_all([b.outline for b in bare]).bounds
    bounds = (x_0 - 5, y_0 - 5, x_1 + 5, y_1 + 5)
    scan = TownLidarParameters(
        density_m2=p.density_m2, flying_height_m=p.flying_height_m, spot_radius_m=0, sigma_z_m=0, sigma_xy_m=0,
        sigma_strip_m=0, low_outliers_per_ha=0, high_outliers_per_ha=0,
    )  # fmt: skip
    hits = town_lidar(PrismScene(bounds, plane(bounds[:2], FLOOR_M), tuple(full)), seed, scan)
    xyz = hits.points.xyz.copy()
    x, y = xyz[:, 0].copy(), xyz[:, 1].copy()
    xyz[:, 2] += _waves(rng, x, y, p.unevenness_m)
    of_house = np.isin(hits.truth_part, (Part.ROOF, Part.WALL))
    for draft in drafts:
        for plan, height, share in draft.clutter.loose:
            on = np.flatnonzero(shapely.contains_xy(draft.in_world(plan), x, y) & (rng.random(len(x)) < share))
            xyz[on, 2] += rng.uniform(0.05, height, len(on))
    xyz += rng.normal(0, 1, xyz.shape) * np.array([p.sigma_xy_m, p.sigma_xy_m, p.sigma_z_m])
    millimetres = np.asarray(xyz[of_house].round(3), np.float64)
    return tuple(_house(b, millimetres) for b in bare)


def _house(building: TruthBuilding, xyz: FloatArray) -> OldHouse:
    inside = xyz[shapely.contains_xy(building.outline, xyz[:, 0], xyz[:, 1])]
    inside = inside[inside[:, 2] > FLOOR_M + 1.5]
    evidence = Evidence(building.id, building.outline, PointCloud.of(inside, BUILDING), FLOOR_M)
    return OldHouse(evidence, building)


def _waves(rng: np.random.Generator, x: FloatArray, y: FloatArray, sigma: float) -> FloatArray:
    """(N,) how far a roof departs from its plane: waves of all directions, 1 to 5 m long, metres."""
    length, angle = np.geomspace(1.0, 5.0, WAVES), rng.uniform(0, 2 * np.pi, WAVES)
    phase = np.outer(x, np.cos(angle) / length) + np.outer(y, np.sin(angle) / length)
    return np.asarray(np.sin(2 * np.pi * (phase + rng.random(WAVES))).sum(axis=1) * sigma * np.sqrt(2 / WAVES))

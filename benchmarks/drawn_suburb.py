"""Suburbs drawn by seed, as a scanner sees them: terraces with annexes and dormers, outbuildings, detached houses, level blocks; and drawn towns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.synthetic import roofs
from cityflow.synthetic.roofs import LocalFace, Placement, TruthFace
from cityflow.synthetic.town import TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from scenes import simple_roofs
from verdict_cases import EDGE_M, SCAN_M2, true_places

FULL_M2, HOUSES = 16.0, 60
SIGMA_Z_M, SIGMA_XY_M, CLUTTER = 0.03, 0.08, 0.02
Drawn = tuple[tuple[tuple[float, float], ...], list[LocalFace]]
"""Outline and faces in a frame of their own; the highest face counts."""
KINDS, SHARES = ("outbuilding", "terrace", "detached", "level"), (0.25, 0.5, 0.1, 0.15)


@dataclass(frozen=True)
class Roof:
    """A unit: what is known of it at full density, and places of its true roof."""

    kind: str
    evidence: Evidence
    truth: FloatArray

    def thinned(self, per_m2: float) -> Evidence:
        """So many points per m², the same ones whatever else is asked."""
        draw = np.random.default_rng([len(self.evidence.points), 5]).random(len(self.evidence.points))
        kept = np.flatnonzero(draw < per_m2 * self.evidence.outline.area / max(len(draw), 1))
        e = self.evidence
        return Evidence(e.id, e.outline, e.points.take(kept), e.ground_height)


def suburb(seed: int) -> Iterator[Roof]:
    """Houses of one seed."""
    rng = np.random.default_rng([seed, 93])
    for k in range(HOUSES):
        kind = str(rng.choice(KINDS, p=SHARES))
        ring, faces = DRAWN[kind](rng)
        place = Placement(1000.0 + 40 * k, 2000.0, float(rng.uniform(0, np.pi)), 5.0)
        outline = orient(Polygon(place.to_world(ring)))
        world = [place.face(f) for f in faces]
        yield Roof(kind, _scanned(rng, f"{seed}/{k}", outline, world), _places(outline, world))


def _outbuilding(rng: np.random.Generator) -> Drawn:
    w, d, h = float(rng.uniform(2.2, 4.2)), float(rng.uniform(2.8, 6.0)), float(rng.uniform(2.2, 3.0))
    ring, kind = roofs.rectangle(0, 0, w, d), rng.random()
    if kind < 0.7:
        return ring, [LocalFace(ring, 0, 0, h)]
    if kind < 0.85:
        return ring, [LocalFace(ring, float(rng.uniform(0.1, 0.4)), 0, h)]
    return ring, simple_roofs.gable_across((0, w), 0, d, h, float(rng.uniform(0.4, 1.0)))


def _terrace(rng: np.random.Generator) -> Drawn:
    w, d = float(rng.uniform(4.8, 6.8)), float(rng.uniform(7.5, 10.5))
    eave, slope = float(rng.uniform(4.8, 7.5)), float(np.tan(np.radians(rng.uniform(28, 50))))
    house = Polygon(roofs.rectangle(0, 0, w, d))
    if rng.random() < 0.85:
        ridge = d * (0.5 if rng.random() < 0.7 else float(rng.uniform(0.36, 0.64)))
        top = eave + slope * min(ridge, d - ridge)
        faces = [
            LocalFace(roofs.rectangle(0, 0, w, ridge), 0, slope, top - slope * ridge),
            LocalFace(roofs.rectangle(0, ridge, w, d), 0, -slope, top + slope * ridge),
        ]
        if rng.random() < 0.4:
            u, wide = float(rng.uniform(0.4, 1.5)), float(rng.uniform(1.8, w - 1.8))
            height = min(top - 0.3, top - slope * min(ridge, d - ridge) * 0.3)
            v = (0.8, ridge) if rng.random() < 0.5 else (ridge, d - 0.8)
            faces.append(LocalFace(roofs.rectangle(u, v[0], u + wide, v[1]), 0, 0, height, roofs.DORMER))
    else:
        faces = simple_roofs.gable_across((0, w), 0, d, eave, slope)
    plan = house
    if rng.random() < 0.5:
        deep, wide = float(rng.uniform(1.8, 4.0)), w if rng.random() < 0.5 else float(rng.uniform(2.2, w - 1.0))
        ring = roofs.rectangle(0, d, wide, d + deep)
        rise = float(rng.uniform(-0.4, -0.15)) if rng.random() < 0.2 else 0.0
        faces.append(LocalFace(ring, 0, rise, float(rng.uniform(2.6, 3.2)) - rise * (d + deep)))
        plan = shapely.union(plan, Polygon(ring))
    if rng.random() < 0.25:
        ring = roofs.rectangle(w - 2.4, -float(rng.uniform(1.0, 2.0)), w, 0)
        faces.append(LocalFace(ring, 0, 0, float(rng.uniform(2.4, 3.0))))
        plan = shapely.union(plan, Polygon(ring))
    return _ring(plan), faces


def _detached(rng: np.random.Generator) -> Drawn:
    w, d = float(rng.uniform(7, 10)), float(rng.uniform(9, 13))
    eave, slope = float(rng.uniform(2.8, 6.0)), float(np.tan(np.radians(rng.uniform(25, 45))))
    run = w / 2 if rng.random() < 0.5 else float(rng.uniform(0.3, 0.45)) * w
    full = roofs.rectangle(0, 0, w, d)
    top = eave + slope * w / 2
    steep = (top - eave) / run
    faces = [
        LocalFace(((0, 0), (w / 2, run), (w / 2, d - run), (0, d)), slope, 0, eave),
        LocalFace(((w, 0), (w, d), (w / 2, d - run), (w / 2, run)), -slope, 0, eave + slope * w),
        LocalFace(((0, 0), (w, 0), (w / 2, run)), 0, steep, eave),
        LocalFace(((0, d), (w / 2, d - run), (w, d)), 0, -steep, eave + steep * d),
    ]
    plan = Polygon(full)
    if rng.random() < 0.6:
        long, at = float(rng.uniform(5, 7)), float(rng.uniform(0, 4))
        ring = roofs.rectangle(w, at, w + 3.0, at + long)
        faces.append(LocalFace(ring, 0, 0, 2.6))
        plan = shapely.union(plan, Polygon(ring))
    return _ring(plan), faces


def _level(rng: np.random.Generator) -> Drawn:
    w, d, h = float(rng.uniform(6, 16)), float(rng.uniform(8, 24)), float(rng.uniform(3, 12))
    ring = roofs.rectangle(0, 0, w, d)
    faces = [LocalFace(ring, 0, 0, h)]
    if rng.random() < 0.7:
        cut = float(rng.uniform(0.3, 0.7)) * d
        faces = [
            LocalFace(roofs.rectangle(0, 0, w, cut), 0, 0, h),
            LocalFace(roofs.rectangle(0, cut, w, d), 0, 0, h + float(rng.uniform(0.6, 3))),
        ]
    if rng.random() < 0.4:
        u, v = float(rng.uniform(0.5, w - 4)), float(rng.uniform(0.5, d - 4.5))
        faces.append(LocalFace(roofs.rectangle(u, v, u + 3, v + 3.5), 0, 0, h + 5.4, roofs.DORMER))
    return ring, faces


DRAWN = {"outbuilding": _outbuilding, "terrace": _terrace, "detached": _detached, "level": _level}


def _ring(plan: Polygon) -> tuple[tuple[float, float], ...]:
    return tuple(map(tuple, shapely.get_coordinates(orient(plan.simplify(1e-6)).exterior)[:-1].tolist()))


def _top(faces: list[TruthFace], x: FloatArray, y: FloatArray) -> FloatArray:
    z = np.full(len(x), np.nan)
    for face in faces:
        inside = shapely.intersects_xy(face.polygon, x, y)
        z[inside] = np.fmax(z[inside], face.plane.z(x[inside], y[inside]))
    return z


def _scanned(rng: np.random.Generator, name: str, outline: Polygon, faces: list[TruthFace]) -> Evidence:
    x_0, y_0, x_1, y_1 = outline.bounds
    n = int(rng.poisson(FULL_M2 * (x_1 - x_0) * (y_1 - y_0)))
    xy = rng.uniform((x_0, y_0), (x_1, y_1), (n, 2))
    z = _top(faces, xy[:, 0], xy[:, 1]) + rng.normal(0, SIGMA_Z_M, n)
    loose = rng.random(n) < CLUTTER
    z[loose] += rng.uniform(-2.0, 2.0, int(loose.sum()))
    xy = xy + rng.normal(0, SIGMA_XY_M, (n, 2))
    kept = np.isfinite(z) & shapely.contains_xy(outline, *xy.T)
    return Evidence(name, outline, PointCloud.of(np.column_stack([xy, z])[kept], BUILDING), 5.0)


def _places(outline: Polygon, faces: list[TruthFace]) -> FloatArray:
    x_0, y_0, x_1, y_1 = outline.bounds
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x_0 + 0.1, x_1, 0.25), np.arange(y_0 + 0.1, y_1, 0.25)))
    inside = shapely.contains_xy(outline.buffer(-0.3), x, y)
    return np.column_stack([x[inside], y[inside], _top(faces, x[inside], y[inside])])


def town(seed: int) -> Iterator[Roof]:
    """Units of a drawn town as a scanner sees them."""
    made = make_town(seed, TownParameters(width_m=EDGE_M, height_m=EDGE_M))
    scan = town_lidar(made, seed, TownLidarParameters(density_m2=SCAN_M2))
    building = scan.points.take(np.flatnonzero(scan.truth_class == BUILDING))
    tree = shapely.STRtree(shapely.points(building.xyz[:, :2]))
    for unit in made.units:
        inside = np.sort(tree.query(unit.wall_outline, predicate="contains"))
        places = true_places([unit], unit.wall_outline, [])
        places = places[np.isfinite(places[:, 2])]
        floor = float(np.floor(unit.floor_m * 100)) / 100
        yield Roof(unit.shape, Evidence(unit.id, unit.wall_outline, building.take(inside), floor), places)

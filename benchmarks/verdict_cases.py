"""Cases for verdicts: units of synthetic towns whose truth is known, sound ones and spoilt ones.

A unit is what a scan of its town gives, thinned to one of several densities, and then, by a random number of its own, left alone or spoilt: its outline, its
points, its classes, its terrain, or its model. The truth is the share of its roof that the model meets.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from shapely import Polygon
from shapely.affinity import rotate, scale, translate

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Grid
from cityflow.core.points import BUILDING, GROUND, HIGH_VEGETATION, UNCLASSIFIED, PointCloud
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.reconstruction.choose import ReconstructParameters
from cityflow.reconstruction.model import ModelParameters
from cityflow.synthetic.roofs import CHIMNEY
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from cityflow.synthetic.town_units import Unit
from scenes.drawn_houses import disturbed
from scenes.inner_city import InnerCityParameters, OldHouse, inner_city

EDGE_M, SCAN_M2 = 220.0, 20.0
DENSITIES = (0.7, 1.4, 2.5, 4.0, 8.0, 8.0, 20.0)
"""Points per square metre, each as often as the others; airborne surveys of towns have about eight."""
SPOILS = (
    "outline moved", "outline turned", "outline too large", "outline too small", "two in one", "flattened", "few planes",
    "crown over it", "crown only", "ground for roof", "shadow", "rough", "waves", "no classes",
)  # fmt: skip
SOUND = 0.5
"""Share of the units that are left alone."""
RELIEFS, STREET_TREES, OLD_HOUSES, OLD_CLUTTER = (0.0, 0.4, 1.0), (0.4, 0.8), 8, (0.5, 1.5)
"""Polders and slopes, few trees and many; old houses of an inner city beside each town, with this much clutter on their roofs."""
AROUND_M, RASTER_M, HIGH_M, WITHIN_M, GOOD_SHARE = 2.0, 4.0, 1.5, 0.2, 0.95
INSIDE_RIM_M = 1e-3
PLACES, STEP_M = 5000, (0.1, 0.5)
EAVES_M = 0.6
"""A model may stand this far out from the true walls: what is there is an overhang or an outline's error, and not judged."""


@dataclass(frozen=True)
class Survey:
    """What a survey has of a town.

    Attributes
    ----------
    points, truth_class : all of them, and their ASPRS classes (N,)
    density_m2, densities : points per square metre, and those that units may be thinned to
    outline_sigma_m : error of the corners of free-standing units' outlines (of their distance), at most
    walls : points on façades, of images
    matched : points are of images, not of a scanner
    heights : surface and terrain, where there are rasters
    """

    points: PointCloud
    truth_class: np.ndarray
    density_m2: float
    densities: tuple[float, ...]
    outline_sigma_m: float = 0.0
    walls: WallPoints = field(default_factory=lambda: joined_walls(()))
    matched: bool = False
    heights: HeightRaster | None = None


@dataclass(frozen=True)
class Case:
    """One unit as the project sees it, and what is true there."""

    name: str
    spoil: str
    density: float
    evidence: Evidence
    parameters: ModelParameters
    places: FloatArray


@dataclass(frozen=True)
class Faults:
    """What is wrong with a case: its outline, the name of what was spoilt; points per square metre."""

    outline: Polygon
    spoil: str
    density: float


def cases_of(seed: int) -> Iterator[Case]:
    """The cases of a town and of some old houses, the same for the same seed."""
    land = np.random.default_rng([seed, 92])
    relief, trees = float(land.choice(RELIEFS)), float(land.choice(STREET_TREES))
    town = make_town(seed, TownParameters(width_m=EDGE_M, height_m=EDGE_M, relief=relief, street_tree_share=trees))
    scan = town_lidar(town, seed, TownLidarParameters(density_m2=SCAN_M2))
    yield from town_cases(town, seed, Survey(scan.points, scan.truth_class, SCAN_M2, DENSITIES))
    yield from _old_houses(seed, land)


def town_cases(town: Town, seed: int, survey: Survey) -> Iterator[Case]:
    """Every unit of a town, sound or spoilt."""
    tree = shapely.STRtree([u.roof_outline for u in town.units])
    rng = np.random.default_rng([seed, 91])
    for unit in town.units:
        yield _case(town, survey, tree, unit, np.random.default_rng([seed, unit.index, int(rng.integers(1 << 30))]))


def _old_houses(seed: int, rng: np.random.Generator) -> Iterator[Case]:
    """Cluttered roofs of many levels, each row of houses at a density of its own; the truth is without the clutter."""
    for row in range(OLD_HOUSES // 4):
        density = float(rng.choice(DENSITIES))
        how = InnerCityParameters(houses=4, density_m2=density, clutter=float(rng.uniform(*OLD_CLUTTER)))
        for house in inner_city(1000 * seed + row, how):
            yield _old_house(house, f"{row}_{house.evidence.id}", density)


def _old_house(house: OldHouse, name: str, density: float) -> Case:
    points = _ordered(house.evidence.points)
    evidence = replace(house.evidence, points=points, around=points)
    usual = ModelParameters(with_overhangs=False)
    return Case(name, "old and cluttered", density, evidence, usual, house.roof_points(STEP_M[1] / 2, 0.0))


def _case(town: Town, survey: Survey, tree: shapely.STRtree, unit: Unit, rng: np.random.Generator) -> Case:
    density = float(rng.choice(survey.densities))
    spoil = "sound" if rng.random() < SOUND else str(rng.choice(SPOILS))
    near = [town.units[k] for k in np.sort(tree.query(unit.wall_outline, predicate="dwithin", distance=4.0))]
    outline = _outline(unit, near, spoil, rng)
    if survey.outline_sigma_m and not _party(outline, [u for u in near if u is not unit]):
        outline = disturbed(outline, rng, float(rng.uniform(0.0, survey.outline_sigma_m)))
    return case_of(town, survey, unit, near, Faults(outline, spoil, density), rng)


def case_of(town: Town, survey: Survey, unit: Unit, near: list[Unit], faults: Faults, rng: np.random.Generator) -> Case:
    """A unit as it is surveyed with such faults. `near`: the units around, and itself."""
    outline, spoil, density = faults.outline, faults.spoil, faults.density
    xyz = survey.points.xyz
    x_0, y_0, x_1, y_1 = shapely.box(*outline.bounds).union(shapely.box(*unit.bounds)).buffer(AROUND_M).bounds
    there = (xyz[:, 0] > x_0) & (xyz[:, 0] < x_1) & (xyz[:, 1] > y_0) & (xyz[:, 1] < y_1)
    there &= rng.random(len(xyz)) < density / survey.density_m2
    cloud = replace(survey.points.take(there), classification=_classes(survey, there))
    lift = 0.0
    if spoil == "ground for roof":
        lift = float(rng.uniform(2.0, 4.0))
    classified = spoil not in ("no classes", "ground for roof") and (spoil != "crown only" or rng.random() < 0.5)
    cloud = _spoilt(cloud, outline, unit, spoil, rng)
    ground = town.dtm(cloud.xyz[:, 0], cloud.xyz[:, 1]) - lift
    points = _roof_points(cloud, ground, classified, spoil)
    inside = shapely.contains_xy(outline, *points.xyz[:, :2].T)
    beside = shapely.dwithin(shapely.points(points.xyz[:, :2]), outline, AROUND_M)
    party = _party(outline, [u for u in near if u is not unit])
    floor = float(np.floor((unit.floor_m - lift) * 100)) / 100
    walls = survey.walls.within((x_0, y_0, x_1, y_1))
    evidence = Evidence(
        unit.id, outline, _ordered(points.take(inside)), floor, around=_ordered(points.take(beside)), party=party,
        matched=survey.matched, heights=survey.heights and _window(survey.heights, outline),
        walls=walls.take(shapely.dwithin(shapely.points(walls.xyz[:, :2]), outline, AROUND_M)),
    )  # fmt: skip
    truth = [] if spoil in ("crown only", "ground for roof") else [unit]
    return Case(unit.id, spoil, density, evidence, parameters_of_spoil(spoil, rng), true_places(truth, outline, near))


def _window(heights: HeightRaster, outline: Polygon) -> HeightRaster:
    """What is within a few metres of an outline, and on the grid."""
    whole = heights.grid
    x_0, y_0, x_1, y_1 = outline.buffer(RASTER_M).bounds
    (top, bottom), (left, right) = whole.indices(np.array([x_0, x_1]), np.array([y_1, y_0]))
    top, bottom = (int(np.clip(row, 0, whole.rows - 1)) for row in (top, bottom))
    left, right = (int(np.clip(col, 0, whole.cols - 1)) for col in (left, right))
    there = slice(top, bottom + 1), slice(left, right + 1)
    corner = whole.x_min + left * whole.cell, whole.y_max - top * whole.cell
    part = Grid(*corner, whole.cell, bottom + 1 - top, right + 1 - left)
    return HeightRaster(part, heights.dsm[there], heights.dtm[there])


def _classes(survey: Survey, there: BoolArray) -> np.ndarray:
    """What a provider delivers: façades are building, leaves are not told from other things."""
    classes = survey.truth_class[there].copy()
    classes[classes == HIGH_VEGETATION] = UNCLASSIFIED
    return classes


def _outline(unit: Unit, near: list[Unit], spoil: str, rng: np.random.Generator) -> Polygon:
    walls = unit.wall_outline
    angle = float(rng.uniform(0, 2 * np.pi))
    if spoil == "outline moved":
        reach = float(rng.uniform(0.2, 2.5))
        return translate(walls, reach * np.cos(angle), reach * np.sin(angle))
    if spoil == "outline turned":
        return rotate(walls, float(rng.uniform(2, 15)))
    if spoil == "outline too large":
        return scale(walls, *rng.uniform(1.05, 1.4, 2))
    if spoil == "outline too small":
        return scale(walls, *rng.uniform(0.6, 0.95, 2))
    beside = [u.wall_outline for u in near if u is not unit]
    if spoil == "two in one" and beside:
        whole = (
            shapely.union(walls, beside[int(rng.integers(len(beside)))])
            .buffer(1.0, join_style="mitre")
            .buffer(-1.0, join_style="mitre")
        )
        if isinstance(whole, Polygon):
            return whole
    if spoil == "crown only":
        return translate(walls, *rng.uniform(-1, 1, 2))
    return walls


def _spoilt(cloud: PointCloud, outline: Polygon, unit: Unit, spoil: str, rng: np.random.Generator) -> PointCloud:
    """The cloud, its points disturbed."""
    xyz = cloud.xyz.copy()
    middle, angle = np.array(outline.centroid.coords[0]), float(rng.uniform(0, 2 * np.pi))
    along = (xyz[:, :2] - middle) @ np.array([np.cos(angle), np.sin(angle)])
    inside = shapely.contains_xy(outline, xyz[:, 0], xyz[:, 1])
    if spoil == "shadow":
        share = float(rng.uniform(0.1, 0.6))
        limit = np.quantile(along[inside], share) if inside.any() else 0.0
        return cloud.take(~(inside & (along < limit)))
    if spoil == "rough":
        xyz[:, 2] += rng.normal(0, float(rng.uniform(0.05, 0.15)), len(xyz))
    if spoil == "waves":
        xyz[:, 2] += _waves(xyz[:, :2], float(rng.uniform(0.05, 0.25)), float(rng.uniform(1.0, 4.0)), rng)
    if spoil == "crown over it":
        return _crown(replace(cloud, xyz=xyz), middle, float(np.sqrt(outline.area) * rng.uniform(0.2, 0.6)), unit, rng)
    if spoil == "crown only":
        bare = cloud.take(~(np.isin(cloud.classification, (BUILDING,)) & (cloud.xyz[:, 2] > unit.floor_m + HIGH_M)))
        return _crown(bare, middle, float(np.sqrt(outline.area) * rng.uniform(0.5, 0.9)), unit, rng)
    if spoil == "ground for roof":
        return cloud.take(cloud.classification == GROUND) if (cloud.classification == GROUND).sum() > 20 else cloud
    return replace(cloud, xyz=xyz)


def _waves(xy: FloatArray, height: float, length: float, rng: np.random.Generator) -> FloatArray:
    """Errors that neighbours share, as those of matched images."""
    found = np.zeros(len(xy))
    for _ in range(12):
        a, k, phase = rng.uniform(0, 2 * np.pi), 2 * np.pi / (length * rng.uniform(0.7, 2.0)), rng.uniform(0, 2 * np.pi)
        found += np.cos(k * (xy @ np.array([np.cos(a), np.sin(a)])) + phase)
    return np.asarray(height * found / np.sqrt(6.0))


def _crown(cloud: PointCloud, middle: FloatArray, radius: float, unit: Unit, rng: np.random.Generator) -> PointCloud:
    """Leaves over a part of the outline, which most pulses do not pass."""
    at = middle + rng.uniform(-0.5, 0.5, 2) * radius
    covered = np.hypot(*(cloud.xyz[:, :2] - at).T) < radius
    leaves = np.flatnonzero(covered & (rng.random(len(cloud)) < 0.9))
    top = max(unit.ridge_m, unit.floor_m + 4.0) + rng.uniform(0.0, 5.0)
    xyz = cloud.xyz.copy()
    dome = np.sqrt(np.maximum(radius**2 - ((xyz[leaves, :2] - at) ** 2).sum(axis=1), 0.0))
    xyz[leaves, 2] = top - radius + dome - rng.exponential(0.5, len(leaves))
    classes, of = cloud.classification.copy(), cloud.number_of_returns.copy()
    classes[leaves] = BUILDING if rng.random() < 0.3 else UNCLASSIFIED
    of[leaves] = np.maximum(of[leaves], 1 + (rng.random(len(leaves)) < 0.5))
    return PointCloud(xyz, classes, cloud.return_number, of)


def _roof_points(cloud: PointCloud, ground: FloatArray, classified: bool, spoil: str) -> PointCloud:
    """As the stage takes them: of the class, or high; where a survey's classes give nothing, high points."""
    high = cloud.xyz[:, 2] - ground > HIGH_M
    building = cloud.classification == BUILDING
    return cloud.take(
        high & (building if classified and spoil != "crown only" else cloud.classification != HIGH_VEGETATION)
    )


def _ordered(cloud: PointCloud) -> PointCloud:
    return cloud.take(np.lexsort(cloud.xyz.T[::-1]))


def _party(outline: Polygon, others: list[Unit]) -> tuple[shapely.LineString, ...]:
    lines = [shapely.intersection(outline.boundary, u.wall_outline.buffer(0.05)) for u in others]
    return tuple(p for g in lines for p in shapely.get_parts(g) if isinstance(p, shapely.LineString) and p.length > 0.5)


def parameters_of_spoil(spoil: str, rng: np.random.Generator) -> ModelParameters:
    """What a model is made with, so that it is flattened or lacks planes; else as usual."""
    usual = ModelParameters(with_overhangs=False)
    if spoil == "flattened":
        return usual.model_copy(update={"methods": ("extruded",)})
    if spoil == "few planes":
        plain = ReconstructParameters().orientation_histogram.model_copy(update={"max_planes": int(rng.integers(1, 4))})
        return usual.model_copy(update={"orientation_histogram": plain})
    return usual


def true_places(own: Sequence[Unit], outline: Polygon, near: Sequence[Unit]) -> FloatArray:
    """(P, 3) places over the walls of some units and an outline with the true height there; NaN where the outline holds no building."""
    walls = shapely.union_all([u.wall_outline for u in own])
    whole = shapely.union(walls, outline)
    step = float(np.clip(np.sqrt(whole.area / PLACES), *STEP_M))
    x_0, y_0, x_1, y_1 = whole.bounds
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x_0 + step / 2, x_1, step), np.arange(y_0 + step / 2, y_1, step)))
    inside = shapely.contains_xy(whole, x, y)
    x, y = x[inside], y[inside]
    if not own:
        return np.column_stack([x, y, np.full(len(x), np.nan)])
    z = np.fmax.reduce([height_of(u, x, y) for u in (*own, *near)])
    all_walls = shapely.union_all([u.wall_outline for u in (*own, *near)])
    built = shapely.contains_xy(all_walls, x, y)
    judged = built | ~shapely.contains_xy(all_walls.buffer(EAVES_M), x, y)
    chimney = np.any(
        [shapely.contains_xy(f.polygon.buffer(0.1), x, y) for u in own for f in u.prisms if f.kind == CHIMNEY]
        or [np.zeros(len(x), bool)],
        axis=0,
    )
    judged &= ~chimney
    return np.asarray(np.column_stack([x, y, np.where(built, z, np.nan)])[judged])


def height_of(unit: Unit, x: FloatArray, y: FloatArray) -> FloatArray:
    z = np.full(len(x), np.nan)
    for face in unit.prisms:
        if face.kind != CHIMNEY:
            inside = shapely.intersects_xy(face.polygon, x, y)
            z[inside] = np.fmax(z[inside], face.plane.z(x[inside], y[inside]))
    return z


def true_share(solid: Polyhedron, places: FloatArray, outline: Polygon) -> float:
    """Share of the true places that are within 20 cm of the model: above or below it, or, beside its outline, of its rim."""
    return float(np.mean(distances_of_truth(solid, places, outline) <= WITHIN_M)) if len(places) else 0.0


def distances_of_truth(solid: Polyhedron, places: FloatArray, outline: Polygon) -> FloatArray:
    """(P,) metres from true places to the model: upwards or downwards, or, beside its outline, to its rim; NaN where there is no building."""
    near, away = places.copy(), np.zeros(len(places))
    outside = ~shapely.contains_xy(outline, places[:, 0], places[:, 1])
    rim = shapely.buffer(outline, -INSIDE_RIM_M)
    to_rim = shapely.shortest_line(shapely.points(places[outside, :2]), rim)
    away[outside] = shapely.length(to_rim)
    near[outside, :2] = shapely.get_coordinates(to_rim).reshape(-1, 2, 2)[:, 1]
    return np.asarray(np.hypot(distances_to_roof(solid, near), away))

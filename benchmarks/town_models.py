"""Buildings of synthetic towns as reconstruction sees them, beside the truth; kept unit by unit.

python benchmarks/town_models.py --seeds 7 11 13 --towns FOLDER --cache FOLDER        # makes both kinds of evidence for all units
"""

from __future__ import annotations

import argparse
import itertools
import json
import pickle
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, OutlineEdge
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Grid
from cityflow.core.points import BUILDING, HIGH_VEGETATION, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence, HeightRaster, Picture
from cityflow.core.roof_type_names import RoofType
from cityflow.evaluation.models import Model, TrueModel
from cityflow.geometry.roof_type import roof_type
from cityflow.geometry.straight_edges import wall_edges
from cityflow.io.city_models.cityjson import Transform, read_feature
from cityflow.outlines.from_walls.wall_points import WallPointParameters
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.surface.sample import sample
from cityflow.synthetic.roofs import CHIMNEY, visible_faces
from cityflow.synthetic.town import make_town
from cityflow.synthetic.town_units import Unit
from drawn_town import SEEDS, DrawnTown, drawn_town
from scenes.drawn_evidence import split_evidence
from scenes.drawn_points import drawn_wall_points

CACHE = Path(tempfile.gettempdir()) / "cityflow_units"
KINDS = ("exact", "drawn")
SURVEYED_M = 0.03
"""Standard deviation that is said of the true outlines."""
AROUND_M, MARGIN_M, NEAR_WALL_M = 2.0, 1.5, 2.0
LOWEST_ROOF_M, LOWEST_M = 1.5, 0.3
EXACT_PER_M2, EXACT_SIGMA_M, WALL_PER_M2 = 60.0, 0.03, 25.0
OUTLIERS, OUTLIER_SIGMA_M = 0.02, 0.8
PYRAMID_RIDGE_M = 1.0
SEEN = 0.3
SLIVER_M, LEAST_M2 = 1e-3, 0.01

TRUE_TYPES = {
    "gable": RoofType.GABLE, "terrace gable": RoofType.GABLE, "curved gable": RoofType.GABLE, "hall": RoofType.GABLE, "L": RoofType.GABLE, "T": RoofType.GABLE,
    "hip": RoofType.HIP, "half-hip": RoofType.HALF_HIP, "pyramid": RoofType.PYRAMID, "corner pyramid": RoofType.PYRAMID, "shed": RoofType.SHED,
    "flat": RoofType.FLAT, "terrace flat": RoofType.FLAT, "corner flat": RoofType.FLAT, "curved flat": RoofType.FLAT, "round flat": RoofType.FLAT,
    "tower": RoofType.FLAT, "slab": RoofType.FLAT, "garage": RoofType.FLAT, "stepped": RoofType.STEPPED_FLAT, "hall saw-tooth": RoofType.SAWTOOTH,
    "round cone": RoofType.CONE, "church": RoofType.COMPLEX,
}  # fmt: skip
"""L- and T-shaped houses, and those with annexes or lift houses, bear the type of their main body."""


def true_types(unit: Unit) -> tuple[RoofType, ...]:
    """What may be said of a unit: a hip roof whose ridge is nearly a point may pass for a pyramid, a church may be called by its nave."""
    best = TRUE_TYPES[unit.shape]
    if unit.shape == "church":
        return best, RoofType.GABLE
    if best is RoofType.HIP:
        sides = np.hypot(*np.diff(shapely.get_coordinates(unit.wall_outline.minimum_rotated_rectangle), axis=0).T)
        if np.ptp(sides) < PYRAMID_RIDGE_M:
            return best, RoofType.PYRAMID
    return (best,)


def true_model(unit: Unit) -> TrueModel:
    chimneys = tuple(f.polygon for f in unit.prisms if f.kind == CHIMNEY)
    faces = visible_faces([f for f in unit.prisms if f.kind != CHIMNEY])
    surfaces = tuple((part, f.plane) for f in faces for part in _without_slivers(f.polygon))
    return TrueModel(unit.id, unit.shape, unit.wall_outline, unit.roof_outline, surfaces, true_types(unit), chimneys)


def _without_slivers(polygon: Polygon) -> list[Polygon]:
    """Parts left when spikes that cutting leaves are gone."""
    slim = shapely.buffer(polygon, -SLIVER_M, join_style="mitre")
    whole = shapely.simplify(shapely.buffer(slim, SLIVER_M, join_style="mitre"), SLIVER_M / 10)
    return [p for p in shapely.get_parts(whole) if isinstance(p, Polygon) and p.area > LEAST_M2]


def model_of(candidate: Candidate) -> Model:
    """A candidate as it is judged: without a type of its own, that of its planes; its claim, or the residuals of its planes."""
    kind, solid = candidate.roof_type, candidate.solid
    if not kind and solid is not None:
        kind = str(roof_type(solid, candidate.planes))
    claim = candidate.notes.get("claimed_rmse_m")
    return Model(
        solid, candidate.planes, kind, candidate.overhangs, _planes_rmse(candidate) if claim is None else float(claim)
    )


def _planes_rmse(candidate: Candidate) -> float:
    known = [(p.points, p.rmse**2) for p in candidate.planes if p.points and np.isfinite(p.rmse)]
    return float(np.sqrt(sum(n * s for n, s in known) / sum(n for n, _ in known))) if known else float("nan")


@dataclass(frozen=True)
class Neighbourhood:
    """A drawn town with its units at hand."""

    made: DrawnTown

    @cached_property
    def walls(self) -> WallPoints:
        return self.made.wall_points(WallPointParameters())

    @cached_property
    def units(self) -> tuple[Unit, ...]:
        return self.made.town.units

    @cached_property
    def tree(self) -> shapely.STRtree:
        return shapely.STRtree([u.roof_outline for u in self.units])

    def beside(self, unit: Unit, reach: float) -> list[Unit]:
        """Units within reach of a unit's walls, without itself."""
        near = np.sort(self.tree.query(unit.wall_outline, predicate="dwithin", distance=reach))
        return [self.units[k] for k in near if self.units[k].id != unit.id]

    def roof_z(self, units: Sequence[Unit], x: FloatArray, y: FloatArray) -> FloatArray:
        """Height of the highest roof of some units; NaN beside them."""
        heights = [u.z(x, y) for u in units]
        return np.fmax.reduce(heights) if heights else np.full(len(x), np.nan)

    def evidence(self, unit: Unit, kind: str) -> Evidence:
        cut = split_evidence(unit.id, shapely.buffer(unit.wall_outline, MARGIN_M), self.made.frames, self.made.terrain)
        nadir = cut.frames[0]
        g, origin = nadir.grid, nadir.frame.origin
        grid = Grid(g.x_min + origin[0], g.y_max + origin[1], g.cell, g.rows, g.cols)
        x, y = (a.ravel() for a in np.meshgrid(grid.x_centres(), grid.y_centres()))
        dtm = sample(*self.made.terrain, x, y)
        rng = np.random.default_rng([self.made.seed, unit.index])
        if kind == "exact":
            points, around, walls = self._exact(unit, rng)
            dsm = np.fmax(self.roof_z([unit, *self.beside(unit, 6.0)], x, y), dtm)
            dsm = dsm + rng.normal(0, EXACT_SIGMA_M, dsm.shape)
        else:
            points, around, walls = self._drawn(unit, drawn_wall_points(cut.frames, self.made.seed).xyz)
            dsm = nadir.dsm.astype(np.float64).ravel() + origin[2]
        assert nadir.ortho is not None
        return Evidence(
            unit.id, unit.wall_outline, points, float(np.floor(unit.floor_m * 100)) / 100, (), (), around, walls,
            HeightRaster(grid, dsm.reshape(grid.shape), dtm.reshape(grid.shape)), (Picture(grid, nadir.ortho, True, "nadir"),),
            self._party(unit), edges=tuple(OutlineEdge(e.line, "given", SURVEYED_M) for e in wall_edges(unit.wall_outline, ())),
        )  # fmt: skip

    def _party(self, unit: Unit) -> tuple[LineString, ...]:
        lines = []
        for other in self.beside(unit, 1e-6):
            common = shapely.line_merge(shapely.intersection(unit.wall_outline, other.wall_outline))
            lines += [p for p in shapely.get_parts(common) if isinstance(p, LineString) and p.length > 0]
        return tuple(lines)

    def _drawn(self, unit: Unit, xyz: FloatArray) -> tuple[PointCloud, PointCloud, WallPoints]:
        x, y, z = xyz.T
        surface = self.made.surface
        above = z - sample(*self.made.terrain, x, y)
        row, col = (np.clip(i, 0, n - 1) for i, n in zip(surface.grid.indices(x, y), surface.grid.shape, strict=True))
        bare = surface.klass[row, col] != HIGH_VEGETATION
        roof = shapely.contains_xy(unit.wall_outline, x, y) & (above > LOWEST_ROOF_M) & bare
        near = shapely.contains_xy(shapely.buffer(unit.wall_outline, AROUND_M), x, y) & (above > LOWEST_M) & bare
        w = self.walls
        beside = shapely.contains_xy(shapely.buffer(unit.wall_outline, NEAR_WALL_M), w.xyz[:, 0], w.xyz[:, 1])
        return PointCloud.of(xyz[roof], BUILDING), PointCloud.of(xyz[near], BUILDING), w.take(beside)

    def _exact(self, unit: Unit, rng: np.random.Generator) -> tuple[PointCloud, PointCloud, WallPoints]:
        """Samples of the true roofs and façades with noise; a few are far off."""
        area = shapely.buffer(unit.wall_outline, AROUND_M)
        x_0, y_0, x_1, y_1 = area.bounds
        count = int((x_1 - x_0) * (y_1 - y_0) * EXACT_PER_M2)
        x, y = rng.uniform(x_0, x_1, count), rng.uniform(y_0, y_1, count)
        z = self.roof_z([unit, *self.beside(unit, AROUND_M + 1.0)], x, y)
        keep = np.isfinite(z) & shapely.contains_xy(area, x, y)
        xyz = np.column_stack([x, y, z])[keep] + rng.normal(0, EXACT_SIGMA_M, (np.count_nonzero(keep), 3))
        astray = rng.random(len(xyz)) < OUTLIERS
        xyz[astray, 2] += rng.normal(0, OUTLIER_SIGMA_M, np.count_nonzero(astray))
        inside = shapely.contains_xy(unit.wall_outline, xyz[:, 0], xyz[:, 1])
        walls = self._facades(unit, rng)
        around = np.concatenate([xyz, walls.xyz])
        return PointCloud.of(xyz[inside], BUILDING), PointCloud.of(around, BUILDING), walls

    def _facades(self, unit: Unit, rng: np.random.Generator) -> WallPoints:
        """Where a wall rises above what stands beside it."""
        spots, normals = [], []
        others = self.beside(unit, 0.5)
        ring = shapely.get_coordinates(unit.wall_outline.exterior)
        for a, b in itertools.pairwise(ring):
            along = (b - a) / np.hypot(*(b - a))
            outward = np.array([along[1], -along[0]])
            count = int(np.hypot(*(b - a)) * (unit.ridge_m - unit.floor_m) * WALL_PER_M2)
            at = a + rng.uniform(0, 1, count)[:, None] * (b - a)
            z = rng.uniform(unit.floor_m, unit.ridge_m, count)
            top = unit.z(*(at - 0.02 * outward).T)
            beside = self.roof_z(others, *(at + 0.02 * outward).T)
            free = (z < top) & ~(z < beside)
            spots.append(np.column_stack([at, z])[free])
            normals.append(np.tile(outward, (int(np.count_nonzero(free)), 1)))
        xyz = np.concatenate(spots)
        xyz = xyz + rng.normal(0, EXACT_SIGMA_M, xyz.shape)
        sigma, views = np.full(len(xyz), EXACT_SIGMA_M, np.float32), np.full(len(xyz), 3, np.uint8)
        return WallPoints(xyz, np.concatenate(normals).astype(np.float32), sigma, views)


def unit_names(seed: int, kind: str, size: int, cache: Path, towns: Path | None) -> list[tuple[str, str]]:
    """Ids and shapes of a town's units; their evidence is made where it is not there yet."""
    folder = cache / f"s{seed}_{size}_{kind}"
    index = folder / "index.json"
    if not index.exists():
        make(seed, size, cache, towns, (kind,))
    return [(name, shape) for name, shape in json.loads(index.read_text())]


def unit_of(seed: int, kind: str, name: str, size: int, cache: Path, towns: Path | None) -> tuple[Evidence, TrueModel]:
    path = cache / f"s{seed}_{size}_{kind}" / f"{name}.pkl"
    if not path.exists():
        make(seed, size, cache, towns, (kind,))
    evidence, truth = pickle.loads(path.read_bytes())
    return _of_today(evidence), truth


def _of_today(evidence: Evidence) -> Evidence:
    """Fields that are younger than what was kept have their defaults."""
    known = {f.name: getattr(evidence, f.name) for f in fields(Evidence) if hasattr(evidence, f.name)}
    return Evidence(**known)


def make(seed: int, size: int, cache: Path, towns: Path | None, kinds: Sequence[str] = KINDS) -> None:
    around = Neighbourhood(drawn_town(seed, size, towns))
    for kind in kinds:
        folder = cache / f"s{seed}_{size}_{kind}"
        folder.mkdir(parents=True, exist_ok=True)
        for unit in around.units:
            kept = around.evidence(unit, kind), true_model(unit)
            (folder / f"{unit.id}.pkl").write_bytes(pickle.dumps(kept, protocol=5))
        (folder / "index.json").write_text(json.dumps([(u.id, u.shape) for u in around.units]))


def of_run(run: Path, truth: Path) -> list[tuple[TrueModel, Model]]:
    """The units of a synthetic survey inside its area, each with the model that overlaps it most; none where it is nobody's."""
    p = SynthParameters.model_validate(json.loads((truth / "synth.json").read_text())["parameters"])
    area = shapely.box(*p.area)
    units = [u for u in make_town(p.seed, p.whole_town).units if area.contains(u.wall_outline)]
    buildings = buildings_of(run)
    tree = shapely.STRtree([b.footprint for b in buildings])
    pairs = []
    for unit in units:
        near = np.sort(tree.query(unit.wall_outline, predicate="intersects"))
        common = [shapely.intersection(unit.wall_outline, buildings[k].footprint).area for k in near]
        model = Model(None)
        if common and max(common) > SEEN * unit.wall_outline.area:
            model = _model(buildings[near[int(np.argmax(common))]])
        pairs.append((true_model(unit), model))
    return pairs


def _model(building: Building) -> Model:
    claim = building.attributes.get("claimed_rmse_m", building.attributes.get("rmse"))
    kind = str(building.attributes.get("roof_type") or "")
    return Model(
        building.solids.get(Lod.LOD22), building.planes, kind, building.overhangs, float("nan") if claim is None else float(claim)
    )  # fmt: skip


def buildings_of(run: Path) -> list[Building]:
    """All that a run exported."""
    with (run / "products" / "city.city.jsonl").open() as file:
        transform = Transform.of_header(json.loads(next(file)))
        lines = [line for line in file if '"Building"' in line]
    return [read_feature(line, transform) for line in lines]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--size", type=int, default=200)
    parser.add_argument("--cache", type=Path, default=CACHE)
    parser.add_argument("--towns", type=Path)
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    asked = parser.parse_args()
    for seed in asked.seeds:
        make(seed, asked.size, asked.cache, asked.towns, asked.kinds)
        print(seed, flush=True)


if __name__ == "__main__":
    main()

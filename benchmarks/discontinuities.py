"""Discontinuities, walls and corners of models against the truth of a synthetic town, floor by floor.

python benchmarks/discontinuities.py --seeds 41 --methods choose volumetric      # exact points of five heads with noise, true outlines
python benchmarks/discontinuities.py --run RUN --survey SURVEY                   # what a run exported
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Lod, OutlineEdge, Polyhedron
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Grid
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.evaluation.discontinuities import Discontinuity, Judged, SolidHull, compare_discontinuities
from cityflow.evaluation.storey_walls import StoreyWalls, compare_storeys, together
from cityflow.geometry.straight_edges import wall_edges
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.caster import NOTHING, Scene
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_hulls import UnitHull, region_of
from cityflow.synthetic.town_units import Unit
from reconstruct_methods import method_of
from town_models import buildings_of

APART_M, NOISE_M, CELL_M = 0.12, 0.03, 0.25
AROUND_M, HIGH_M = 4.0, 80.0
TILTS_DEG = (45.0, 54.0)
"""Of the oblique heads of `five_cameras`: the middle of their pictures, and what neighbouring strips see at their edges."""
UPRIGHT, LOWEST_M = 0.3, 0.3
SAME_VERTEX_M, LEAST_HOLE_M2 = 0.005, 0.1
"""Vertices of true outlines nearer to each other are one, and smaller holes are none."""
LEVEL, COVERED_M = 0.95, 1.8
"""Normals of level surfaces, and how far below the highest surface they are covered."""
BUILT = (Part.ROOF, Part.WALL, Part.OVERHANG, Part.WINDOW, Part.DOOR, Part.PIPE, Part.CHIMNEY)
DEPTH_KINDS = ("set-back", "arcade")
"""Kinds that the target for depths is stated for."""
OTHERS_M = 1.0
NEAR_M = 0.2


@dataclass
class Tally:
    """What one method made of some units."""

    judged: list[tuple[str, Judged]] = field(default_factory=list)
    invented: list[tuple[str, Discontinuity]] = field(default_factory=list)
    walls: list[StoreyWalls] = field(default_factory=list)
    units: int = 0
    without: int = 0
    seconds: list[float] = field(default_factory=list)

    def add(self, unit: Unit, solids: Sequence[Polyhedron], area: shapely.Geometry) -> None:
        truth, model = UnitHull(unit), SolidHull(tuple(solids), area)
        accuracy = compare_discontinuities(truth, model, truth.levels)
        self.judged += [(kind_of(unit, j.true), j) for j in accuracy.judged]
        self.invented += [(unit.id, d) for d in accuracy.invented]
        self.walls.append(compare_storeys(truth, model, truth.levels))
        self.units += 1
        self.without += not solids

    def report(self, name: str) -> None:
        found = [(k, j) for k, j in self.judged if j.found]
        walls = together(self.walls)
        made = len(found) + len(self.invented)
        print(f"\n{name}: {self.units} units, {self.without} without a model")
        print(
            f"discontinuities: {len(found)} of {len(self.judged)} found, {len(self.invented)} of {made} of the model's invented"
        )
        for under, title in ((False, "set back"), (True, "standing out")):
            of = [j for _, j in self.judged if j.true.under == under]
            print(f"  {title}: {sum(j.found for j in of)} of {len(of)}")
        kinds: dict[str, list[Judged]] = defaultdict(list)
        for kind, j in self.judged:
            kinds[kind].append(j)
        for kind in sorted(kinds):
            of = kinds[kind]
            depth, height = _cm([j.depth_m for j in of]), _cm([j.height_m for j in of])
            print(f"    {kind}: {sum(j.found for j in of)} of {len(of)}, depth {depth}, height {height}")
        depths = [j.depth_m for k, j in found if k in DEPTH_KINDS]
        soffits = [j.height_m for _, j in found if j.true.under]
        print(
            f"  depth of set-backs and arcades, median: {_cm(depths)} of {len(depths)}; soffits, median: {_cm(soffits)} of {len(soffits)}"
        )
        w, b = walls.wall_m, walls.beyond_m
        near, true = 100 * np.mean(w <= NEAR_M), 100 * np.mean(b <= NEAR_M) if len(b) else float("nan")
        print(
            f"walls: {100 * np.median(w):.1f} cm in the median, {near:.1f} % within 20 cm; of the found {true:.1f} % beside a true one"
        )
        c = walls.corner_m
        if len(c):
            every, all_found = len(c) + walls.missed, len(c) + walls.invented
            missed, invented = (
                f"{n} of {of} ({100 * n / of:.1f} %)" for n, of in ((walls.missed, every), (walls.invented, all_found))
            )
            print(
                f"corners: {100 * np.median(c):.1f} cm in the median, {100 * c.mean():.1f} in the mean, of {len(c)}",
                end="; ",
            )
            print(f"missed {missed}, invented {invented}")
        if self.seconds:
            print(
                f"seconds of processor time a unit: {np.median(self.seconds):.2f} in the median, {max(self.seconds):.2f} at most"
            )
        print("invented in", dict(Counter(unit for unit, _ in self.invented)), flush=True)


def _cm(values: Sequence[float]) -> str:
    known = np.abs([v for v in values if np.isfinite(v)])
    return f"{100 * np.median(known):.1f} cm" if len(known) else "-"


def kind_of(unit: Unit, found: Discontinuity) -> str:
    """What the discontinuity was made as: what ends or begins between these storeys, by the largest common share of plan; a height where nothing does."""
    low, high = UnitHull(unit).levels[found.level : found.level + 2, 0] - unit.base_m
    shares = [(0.5, "height")]
    for b in unit.breaks:
        out = b.depth_m < 0
        at = b.soffit_m if found.under else b.high_m if out else b.low_m
        region = region_of(unit, b)
        if at is not None and low < at < high:
            shares.append((region.intersection(found.region).area / min(region.area, found.region.area), b.kind))
    return max(shares)[1]


class Views:
    """Points of a town where the views of five heads meet it: straight down, and from four sides."""

    def __init__(self, town: Town) -> None:
        self.town, self.scene = town, Scene(town.mesh())
        self.views = [np.array([0.0, 0.0, -1.0])]
        for tilt in np.radians(TILTS_DEG):
            for turn in town.net.heading + 0.35 + np.arange(4) * np.pi / 2:
                flat = np.sin(tilt) * np.array([np.cos(turn), np.sin(turn)])
                self.views.append(np.array([*flat, -np.cos(tilt)]))

    def met(self, unit: Unit, view: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, IntArray]:
        """World points, and their triangles."""
        x_0, y_0, x_1, y_1 = shapely.buffer(unit.roof_outline, AROUND_M).bounds
        # rays that meet the highest wall come down beyond it
        beyond = view[:2] / -view[2] * (unit.ridge_m - unit.floor_m + 2.0)
        (u_0, v_0), (u_1, v_1) = np.minimum(0.0, beyond), np.maximum(0.0, beyond)
        x, y = np.meshgrid(np.arange(x_0 + u_0, x_1 + u_1, APART_M), np.arange(y_0 + v_0, y_1 + v_1, APART_M))
        low = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, unit.floor_m)])
        low[:, :2] += rng.uniform(-0.5, 0.5, (x.size, 2)) * APART_M
        start = low - view * (HIGH_M / -view[2])
        triangle, length = self.scene.first_hits(start - self.scene.origin, np.broadcast_to(view, start.shape))
        met = (triangle != NOTHING) & np.isfinite(length)
        xyz = start[met] + length[met, None] * view
        near = (xyz[:, 0] > x_0) & (xyz[:, 0] < x_1) & (xyz[:, 1] > y_0) & (xyz[:, 1] < y_1)
        return xyz[near], triangle[met][near]

    def evidence(self, unit: Unit, seed: int) -> Evidence:
        """What exact depth maps with noise along the normal give for one unit; its outline is the true one."""
        rng = np.random.default_rng([seed, unit.index])
        parts = [self.met(unit, view, rng) for view in self.views]
        mesh, surfaces = self.scene.mesh, self.scene.surfaces
        xyz, triangle = np.concatenate([p for p, _ in parts]), np.concatenate([t for _, t in parts])
        nadir = np.arange(len(xyz)) < len(parts[0][0])
        normal = surfaces.normal[triangle]
        xyz = xyz + normal * rng.normal(0, NOISE_M, (len(xyz), 1))
        built = np.isin(mesh.part[triangle], BUILT)
        grid = _grid(unit)
        x, y = (a.ravel() for a in np.meshgrid(grid.x_centres(), grid.y_centres()))
        dtm = self.town.dtm(x, y).reshape(grid.shape)
        dsm = _highest(grid, xyz[nadir], dtm)
        inside = shapely.contains_xy(unit.wall_outline, xyz[:, 0], xyz[:, 1])
        near = shapely.contains_xy(shapely.buffer(unit.wall_outline, 2.0), xyz[:, 0], xyz[:, 1])
        wall = built & near & (np.abs(normal[:, 2]) < UPRIGHT)
        flat = normal[wall, :2] / np.linalg.norm(normal[wall, :2], axis=1)[:, None]
        count = int(wall.sum())
        walls = WallPoints(
            xyz[wall], flat.astype(np.float32), np.full(count, NOISE_M, np.float32), np.full(count, 3, np.uint8)
        )
        roof = built & inside & ~wall & (xyz[:, 2] > unit.floor_m + LOWEST_M)
        row, col = grid.indices(xyz[:, 0], xyz[:, 1])
        top = dsm[np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1)]
        covered = inside & (normal[:, 2] > LEVEL) & (xyz[:, 2] < top - COVERED_M)
        outline = cleaned(unit.wall_outline)
        return Evidence(
            unit.id, outline, PointCloud.of(xyz[roof], BUILDING), float(np.floor(unit.floor_m * 100)) / 100,
            around=PointCloud.of(xyz[built & near], BUILDING), walls=walls, heights=HeightRaster(grid, dsm, dtm), matched=True,
            covered=xyz[covered], edges=tuple(OutlineEdge(e.line, "given", NOISE_M) for e in wall_edges(outline, ())),
        )  # fmt: skip


def cleaned(outline: Polygon) -> Polygon:
    """A true outline without what the union of its volumes leaves: slivers of holes, and vertices next to each other."""
    holes = [ring for ring in outline.interiors if Polygon(ring).area > LEAST_HOLE_M2]
    return shapely.remove_repeated_points(Polygon(outline.exterior, holes), SAME_VERTEX_M)


def _grid(unit: Unit) -> Grid:
    x_0, y_0, x_1, y_1 = shapely.buffer(unit.roof_outline, AROUND_M).bounds
    west, north = np.floor(x_0 / CELL_M) * CELL_M, np.ceil(y_1 / CELL_M) * CELL_M
    return Grid(float(west), float(north), CELL_M, int((north - y_0) / CELL_M), int((x_1 - west) / CELL_M))


def _highest(grid: Grid, xyz: FloatArray, dtm: FloatArray) -> FloatArray:
    """The highest point in each cell; the ground where there is none."""
    row, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = (row >= 0) & (row < grid.rows) & (col >= 0) & (col < grid.cols)
    dsm = np.full(grid.shape, -np.inf)
    np.maximum.at(dsm, (row[inside], col[inside]), xyz[inside, 2])
    return np.where(np.isfinite(dsm), dsm, dtm)


def area_of(unit: Unit, units: Sequence[Unit]) -> shapely.Geometry:
    """Where a model counts as that of the unit: around it, not where others stand."""
    area = shapely.buffer(unit.wall_outline, AROUND_M)
    others = [
        shapely.buffer(u.wall_outline, OTHERS_M)
        for u in units
        if u.index != unit.index and u.wall_outline.intersects(area)
    ]
    return shapely.union(shapely.difference(area, shapely.union_all(others)), unit.wall_outline)


def of_points(seed: int, of: TownParameters, names: Sequence[str], tallies: dict[str, Tally]) -> None:
    """Every method on each unit with discontinuities of a town."""
    town = make_town(seed, of)
    views = Views(town)
    for unit in town.units:
        if not unit.breaks:
            continue
        evidence = views.evidence(unit, seed)
        for name in names:
            start = time.process_time()
            candidate = method_of(name)(evidence)
            tallies[name].seconds.append(time.process_time() - start)
            tallies[name].add(unit, () if candidate.solid is None else (candidate.solid,), area_of(unit, town.units))
        print(unit.id, unit.shape, len(evidence.points), len(evidence.walls), flush=True)


def of_run(run: Path, survey: Path, around_m: float, tally: Tally) -> None:
    """What a run exported, for each unit that stands as a whole in the surveyed area and so far around it."""
    p = SynthParameters.model_validate(json.loads((survey / "synth.json").read_text())["parameters"])
    town, area = make_town(p.seed, p.whole_town), shapely.box(*p.area).buffer(around_m)
    buildings = buildings_of(run)
    for unit in town.units:
        if area.contains(unit.wall_outline):
            mine = area_of(unit, town.units)
            near = [b.solids[Lod.LOD22] for b in buildings if Lod.LOD22 in b.solids and b.footprint.intersects(mine)]
            tally.add(unit, near, mine)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[41])
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--eaves", type=float, default=0.0, help="`town.eaves`")
    parser.add_argument("--size", type=int, default=250)
    parser.add_argument("--methods", nargs="+", default=["choose", "volumetric"])
    parser.add_argument("--run", type=Path)
    parser.add_argument("--survey", type=Path)
    parser.add_argument(
        "--around", type=float, default=0.0, help="units so far beyond the surveyed area count, too, metres"
    )
    asked = parser.parse_args()
    tallies: dict[str, Tally] = defaultdict(Tally)
    if asked.run is not None:
        of_run(asked.run, asked.survey, asked.around, tallies["run"])
    for seed in asked.seeds if asked.run is None else ():
        of = TownParameters(width_m=asked.size, height_m=asked.size, level=asked.level, eaves=asked.eaves, relief=0.2)
        of_points(seed, of, asked.methods, tallies)
    for name, tally in tallies.items():
        if tally.units:
            tally.report(name)
        else:
            print(f"{name}: no unit stands in the area as a whole")


if __name__ == "__main__":
    main()

"""What the voxel filter of Frommholz 2017 does to points of images before anything is made of them: strays, good points and façades, with and without it.

    cp -r RUN COPY; python benchmarks/noise_filter.py COPY --survey SURVEY --catalog SURVEY/catalog --aoi 84955,446955,85095,447095

Points that images have left after they were compared, around each unit of a synthetic town: what the filter would get. Truth is the distance to the town's
own surfaces. Listing the tasks of a run may write into it, so give it a copy.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.grid import Bounds, grown
from cityflow.flow.store import Store
from cityflow.handover.depth_reader import checked_points
from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from cityflow.reconstruction.noise.voxel_filter import VoxelFilterParameters, filter_noise
from cityflow.runs.prepare import prepared
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.stages.walls import WallInputs
from cityflow.survey.survey_parameters import WallParameters
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.town import make_town
from cityflow.synthetic.town_units import Unit
from stages_again import records_of, tasks_of

WORKFLOW = Path(__file__).parents[1] / "workflows" / "demo_flight.yaml"
AROUND_M, RIM_M, ABOVE_M = 2.0, 1.5, 0.5
"""Points around a unit that are its own; more around it, so that surroundings are whole; and least height over its floor."""
BESIDE_M = 20.0
"""Units that stand as a whole so far around the surveyed area count."""
STRAY_GSD, FAR_GSD = 3.0, 8.0
"""Farther from all true surfaces a point is a stray, and a far one, ground sampling distances."""
CELL_M, UPRIGHT = 0.5, 0.1
WALL_M = 0.3
"""Façade points farther from true surfaces are wrong; cells of true walls with a façade point nearer than this are seen."""


@dataclass
class Tally:
    """Points around units, with one setting."""

    distance: list[FloatArray] = field(default_factory=list)
    kept: list[BoolArray] = field(default_factory=list)
    walls: list[FloatArray] = field(default_factory=list)
    seen: list[BoolArray] = field(default_factory=list)
    seconds: float = 0.0

    def report(self, name: str, gsd: float) -> None:
        d, kept = np.concatenate(self.distance), np.concatenate(self.kept)
        good, far = d <= STRAY_GSD * gsd, d > FAR_GSD * gsd
        walls, seen = np.concatenate(self.walls), np.concatenate(self.seen)
        left = d[kept & good]
        print(
            f"{name}: {len(d)} points, strays {100 * (~good).mean():.1f} % -> {100 * (~good[kept]).mean():.1f} %; removed of strays"
            f" {100 * (~kept[~good]).mean():.1f} %, of far ones {100 * (~kept[far]).mean():.1f} %, of good ones {100 * (~kept[good]).mean():.1f} %;"
            f" RMS of good ones {100 * np.sqrt(np.mean(d[good] ** 2)):.2f} -> {100 * np.sqrt(np.mean(left**2)):.2f} cm"
        )
        print(
            f"    façades: {len(walls)} points, {100 * np.median(walls):.1f} cm off in the median, {100 * np.mean(walls > WALL_M):.1f} % farther than"
            f" {WALL_M} m; {100 * seen.mean():.1f} % of {len(seen)} cells of true walls seen; {self.seconds:.1f} s of processor time",
            flush=True,
        )


class Truth:
    """True surfaces of a town."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def distance(self, xyz: FloatArray) -> FloatArray:
        """(N,) metres to the nearest surface."""
        local = np.ascontiguousarray(xyz - self.scene.origin, np.float32)
        found = self.scene._tree.compute_distance(self.scene._tensor(local), nthreads=1)
        return np.asarray(found.numpy(), np.float64)


def wall_cells(unit: Unit) -> FloatArray:
    """(N, 3) places on the unit's outer walls, from half a metre over its floor up to its ridge: gables are walls, too."""
    ring = shapely.segmentize(unit.wall_outline.exterior, CELL_M)
    plan = shapely.get_coordinates(ring)[:-1]
    heights = np.arange(unit.floor_m + ABOVE_M, unit.ridge_m, CELL_M)
    return np.column_stack([np.repeat(plan, len(heights), axis=0), np.tile(heights, len(plan))])


def of_run(run: Path, survey: Path, catalog: str, aoi: str, settings: dict[str, VoxelFilterParameters | None]) -> None:
    p = SynthParameters.model_validate(json.loads((survey / "synth.json").read_text())["parameters"])
    town = make_town(p.seed, p.whole_town)
    truth, gsd = Truth(Scene(town.mesh())), p.truth_cell_m
    wanted = prepared(WORKFLOW, catalog, str(run), [], aoi)
    tasks = [t for t in tasks_of(wanted, records_of(run)) if t.stage == "walls"]
    inputs = [t.arguments_as(WallInputs) for t in tasks]
    walls = tasks[0].parameters_as(WallParameters)
    tallies = {name: Tally() for name in settings}
    area = shapely.buffer(shapely.box(*p.area), BESIDE_M)
    for unit in town.units:
        if not area.contains(unit.wall_outline):
            continue
        mine = grown(unit.roof_outline.bounds, AROUND_M)
        points = points_of(wanted.store, inputs, grown(mine, RIM_M))
        of_unit(unit, points, truth, walls, tallies, settings)
    for name, tally in tallies.items():
        tally.report(name, gsd)


def points_of(store: Store, inputs: list[WallInputs], bounds: Bounds) -> ImagePoints:
    """Those of the tile that has most of them: tasks of neighbouring tiles read the same maps."""
    found = [checked_points(store, given.depths, bounds, colour=False)(bounds) for given in inputs]
    return max(found, key=len)


def of_unit(
    unit: Unit, points: ImagePoints, truth: Truth, walls: WallPointParameters,
    tallies: dict[str, Tally], settings: dict[str, VoxelFilterParameters | None],
) -> None:  # fmt: skip
    near = shapely.dwithin(shapely.points(points.xyz[:, :2]), unit.roof_outline, AROUND_M)
    near &= points.xyz[:, 2] > unit.floor_m + ABOVE_M
    distance, cells = truth.distance(points.xyz[near]), wall_cells(unit)
    for name, parameters in settings.items():
        start = time.process_time()
        keep = (
            np.ones(len(points), bool)
            if parameters is None
            else filter_noise(points.xyz - np.floor(points.xyz.min(axis=0)), parameters).keep
        )
        tally = tallies[name]
        tally.seconds += time.process_time() - start
        found = find_wall_points(points.take(keep), walls).xyz
        found = found[shapely.dwithin(shapely.points(found[:, :2]), unit.roof_outline, AROUND_M)]
        tally.distance.append(distance)
        tally.kept.append(keep[near])
        tally.walls.append(truth.distance(found))
        tally.seen.append(covered(cells, found))


def covered(cells: FloatArray, found: FloatArray) -> BoolArray:
    """(N,) whether a place has a point nearer than `WALL_M`."""
    if not len(found):
        return np.zeros(len(cells), bool)
    return np.asarray(np.isfinite(cKDTree(found).query(cells, distance_upper_bound=WALL_M)[0]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--survey", type=Path, required=True)
    parser.add_argument("--catalog", required=True)
    parser.add_argument("--aoi", required=True)
    o = parser.parse_args()
    settings = {
        "off": None,
        "on": VoxelFilterParameters(),
        "on, classes of 1.5 sigma": VoxelFilterParameters(class_sigmas=1.5),
        "on, classes of 0.7 sigma": VoxelFilterParameters(class_sigmas=0.7),
    }
    of_run(o.run, o.survey, o.catalog, o.aoi, settings)


if __name__ == "__main__":
    main()

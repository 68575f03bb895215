"""Where voids are lost: what images can see of them at all, what has depths, façade points and covered points, and which of them the models have.

    python benchmarks/void_sight.py --seed 54 --size 50 --set flight.gsd_m=0.12 …       # what is in sight of a flight, without pictures
    python benchmarks/void_sight.py --survey SURVEY --run RUN --aoi …                   # and what a run made of it; RUN is made where there is none

Of each true discontinuity (``evaluation/discontinuities.py``) the wall that stands back, the level surface before it, the soffit, the façade just above
the opening and the opening itself are sampled. A place is in sight of an image that holds it, where no surface of the town is between, at 12° from grazing
at least; of a pair, where the rays of two such images meet at an angle that they may be matched at. Models are made for the true outlines. A
discontinuity is in sight, or in the points, where a fifth of its wall or of its level surface is.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.facade_points import WallPoints
from cityflow.core.reconstruction import Evidence
from cityflow.evaluation.discontinuities import Discontinuity, SolidHull, compare_discontinuities
from cityflow.orientation.partners import GOOD_ANGLE_DEG, LARGEST_TURN_DEG
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.model import model as model_of
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.town import make_town
from cityflow.synthetic.town_hulls import UnitHull
from cityflow.synthetic.town_units import Unit
from cityflow.workflow.synth import synth_parameters
from discontinuities import area_of, kind_of
from void_run import Depths, evidence_in, walked

WALL, FLOOR, SOFFIT, FRONT, GAP = "wall behind", "floor", "soffit", "façade above", "opening painted"
STEPS = TWO, PAIR, DEPTH, KEPT, POINTS = "two", "pair", "depth", "kept", "points"
"""In sight of two images, of a pair that may be matched; one of these has its depth; not refuted; a façade point or covered point is near."""
SHOWN = 0.2
"""Share that must be seen: that of ``voids.cells.prior``."""
STEP_M, RIM_M, OFF_M = 0.25, 0.2, 0.02
"""Between places; so far from the ends of a wall; and so far before the surface."""
ABOVE_M = (0.1, 0.7)
"""The façade above an opening, over the soffit."""
GRAZING_DEG = 12.0
"""As ``outlines/from_walls/wall_points.py`` takes it."""
NEAR_M, COVERED_M = 0.3, 0.5
"""Façade points and covered points are of a place that are as near."""
FACING = 0.9


class Places(NamedTuple):
    """(N, 3) places a little before a surface, world metres, and (N, 3) unit normals."""

    xyz: FloatArray
    normal: FloatArray


@dataclass
class Bench:
    """A town, its images and what a run made of them."""

    scene: Scene
    images: Sequence[OrientedImage]
    gsd: float
    depths: Depths | None = None
    shares: dict[tuple[bool, str], list[dict[str, BoolArray]]] = field(default_factory=lambda: defaultdict(list))
    counts: dict[bool, list[tuple[bool, bool, bool]]] = field(default_factory=lambda: defaultdict(list))
    invented: int = 0

    def judge(self, unit: Unit, area: shapely.Geometry, evidence: Evidence | None) -> None:
        truth = UnitHull(unit)
        model = SolidHull(())
        if evidence is not None:
            solid = model_of(evidence, ModelParameters()).candidate.solid
            model = SolidHull(() if solid is None else (solid,), area)
        accuracy = compare_discontinuities(truth, model, truth.levels)
        self.invented += len(accuracy.invented)
        for judged in accuracy.judged:
            one = judged.true
            found = {n: self.steps(n, p, evidence) for n, p in places_of(one, truth, truth.levels, self.scene).items()}
            for name, steps in found.items():
                self.shares[one.under, name].append(steps)
            shown = [
                [s[k].mean() for n, s in found.items() if n in (WALL, FLOOR) and k in s and len(s[k])]
                for k in (PAIR, POINTS)
            ]
            seen, pointed = (max(of, default=0.0) >= SHOWN for of in shown)
            self.counts[one.under].append((seen, pointed, judged.found))
            print(
                unit.id,
                kind_of(unit, one),
                f"storey {one.level}",
                "found" if judged.found else "MISSED",
                _line(found),
                flush=True,
            )

    def steps(self, name: str, places: Places, evidence: Evidence | None) -> dict[str, BoolArray]:
        """Step → (N,) which places it has."""
        seen = in_sight(places, self.images, self.scene)
        found = {TWO: seen.sum(axis=0) >= 2, PAIR: by_pairs(places, self.images, seen)}
        if name == GAP or not len(places.xyz):
            found = {}
        elif self.depths is not None:
            names = [i.name for i in self.images]
            found[DEPTH], found[KEPT] = self.depths.right(places.xyz, seen, names, self.gsd)
        if evidence is not None and len(places.xyz):
            found[POINTS] = of_covered(places, evidence.covered) if name == FLOOR else of_walls(places, evidence.walls)
        return found

    def report(self) -> None:
        for under, title in ((True, "the upper storey stands out"), (False, "the upper storey is set back")):
            rows = np.array(self.counts[under], bool).reshape(-1, 3)
            seen, pointed, found = rows.T
            print(
                f"\n{title}: {len(rows)}, in sight {seen.sum()}, in the points {pointed.sum()}, in the models {found.sum()}"
                f" (of those in sight {(found & seen).sum()}, of those in the points {(found & pointed).sum()})"
            )
            for (of, name), parts in self.shares.items():
                if of == under:
                    print(
                        f"  {name}:",
                        _line(
                            {
                                "": {
                                    k: np.concatenate([p[k] for p in parts if k in p])
                                    for k in STEPS
                                    if any(k in p for p in parts)
                                }
                            }
                        ),
                    )
        print("invented:", self.invented)


def _line(found: Mapping[str, Mapping[str, BoolArray]]) -> str:
    parts = [
        f"{n} ({len(next(iter(s.values())))}) " + " ".join(f"{k} {100 * v.mean():.0f}" for k, v in s.items() if len(v))
        for n, s in found.items()
        if s
    ]
    return "; ".join(parts)


def places_of(one: Discontinuity, truth: UnitHull, levels: FloatArray, scene: Scene) -> dict[str, Places]:
    """Its surfaces; the opening's places are on the façade plane, where nothing stands."""
    low, high = levels[one.level], levels[one.level + 1]
    storey = low if one.under else high
    heights = np.arange(storey[0] - storey[1] + RIM_M, storey[0] + storey[1] - RIM_M, STEP_M)
    found = {WALL: _upright(one.wall, one.region, heights, 1.0)}
    plan = _grid(one.region)
    found[FLOOR] = _met(plan, storey[0], -1.0, scene)
    if one.under:
        found[SOFFIT] = _met(plan, storey[0], 1.0, scene)
        outer = truth.section(high[0]).boundary
        front = one.region.boundary.difference(one.wall.buffer(0.1)).intersection(outer.buffer(0.02))
        soffit = float(np.median(found[SOFFIT].xyz[:, 2])) if len(found[SOFFIT].xyz) else float(high[0] - high[1])
        found[FRONT] = _upright(front, one.region, soffit + np.arange(*ABOVE_M, STEP_M), -1.0)
        found[GAP] = _upright(front, one.region, heights, -1.0)
    return found


def _upright(line: shapely.Geometry, region: shapely.Geometry, heights: FloatArray, way: float) -> Places:
    """Places on upright planes over the line, facing into the region (way 1) or out of it (−1)."""
    xyz, normals = [np.empty((0, 3))], [np.empty((0, 3))]
    for part in shapely.get_parts(shapely.line_merge(line) if line.geom_type == "MultiLineString" else line):
        xy = shapely.get_coordinates(part)
        for a, b in pairwise(xy):
            length = float(np.hypot(*(b - a)))
            if length < 3 * RIM_M:
                continue
            at = a + (np.arange(RIM_M, length - RIM_M, STEP_M) / length)[:, None] * (b - a)
            n = np.array([-(b - a)[1], (b - a)[0]]) / length
            n = n if region.buffer(0.05).contains(shapely.Point((a + b) / 2 + 0.15 * n)) else -n
            places = np.repeat(at + way * OFF_M * n, len(heights), axis=0)
            xyz.append(np.column_stack([places, np.tile(heights, len(at))]))
            normals.append(np.tile([*(way * n), 0.0], (len(places), 1)))
    return Places(np.concatenate(xyz), np.concatenate(normals))


def _grid(region: shapely.Geometry) -> FloatArray:
    x_0, y_0, x_1, y_1 = region.bounds
    x, y = (a.ravel() for a in np.meshgrid(np.arange(x_0, x_1, STEP_M), np.arange(y_0, y_1, STEP_M)))
    inside = shapely.contains_xy(region.buffer(-RIM_M), x, y)
    return np.column_stack([x[inside], y[inside]])


def _met(plan: FloatArray, z: float, way: float, scene: Scene) -> Places:
    """What is met from a height upwards or downwards."""
    start = np.column_stack([plan, np.full(len(plan), z)])
    ray = np.tile([0.0, 0.0, way], (len(plan), 1))
    _, length = scene.first_hits(start - scene.origin, ray)
    met = np.isfinite(length)
    return Places((start + (length - OFF_M)[:, None] * ray)[met], -ray[met])


def in_sight(places: Places, images: Sequence[OrientedImage], scene: Scene) -> BoolArray:
    """(images, N) whether each place is in sight of each image."""
    found = np.zeros((len(images), len(places.xyz)), bool)
    for k, image in enumerate(images):
        uv, depth = image.project(places.xyz)
        way = image.centre - places.xyz
        facing = np.einsum("ij,ij->i", way, places.normal) / np.linalg.norm(way, axis=1)
        may = np.flatnonzero((depth > 0) & image.holds(uv) & (facing > np.sin(np.radians(GRAZING_DEG))))
        if len(may):
            found[k, may] = ~scene.occluded(places.xyz[may] - scene.origin, way[may])
    return found


def by_pairs(places: Places, images: Sequence[OrientedImage], seen: BoolArray) -> BoolArray:
    """(N,) whether two images that may be matched with each other see a place: their rays meet at a good angle."""
    found = np.zeros(len(places.xyz), bool)
    for i, one in enumerate(images):
        for j in range(i):
            both = np.flatnonzero(seen[i] & seen[j] & ~found)
            if len(both) and one.axis @ images[j].axis > np.cos(np.radians(LARGEST_TURN_DEG + 3)):
                rays = [places.xyz[both] - m.centre for m in (one, images[j])]
                cosine = np.einsum("ij,ij->i", *rays) / np.prod([np.linalg.norm(r, axis=1) for r in rays], axis=0)
                angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
                found[both] = (angle >= GOOD_ANGLE_DEG[0]) & (angle <= GOOD_ANGLE_DEG[1])
    return found


def of_walls(places: Places, walls: WallPoints) -> BoolArray:
    """(N,) whether a façade point that faces alike is near each place."""
    if not len(walls) or not len(places.xyz):
        return np.zeros(len(places.xyz), bool)
    near = cKDTree(walls.xyz).query_ball_point(places.xyz, NEAR_M)
    return np.array([any(walls.normal[i] @ n[:2] > FACING for i in ids) for ids, n in zip(near, places.normal, strict=True)], bool)  # fmt: skip


def of_covered(places: Places, covered: FloatArray) -> BoolArray:
    if not len(covered) or not len(places.xyz):
        return np.zeros(len(places.xyz), bool)
    return np.asarray(cKDTree(covered).query(places.xyz)[0] <= COVERED_M)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--survey", type=Path)
    parser.add_argument("--run", type=Path)
    parser.add_argument("--aoi", default="")
    parser.add_argument("--seed", type=int, default=54)
    parser.add_argument("--size", default="50")
    parser.add_argument("--flight", default="five_cameras")
    parser.add_argument("--set", action="append", default=[], help="of the flight, where there is no survey")
    parser.add_argument("--around", type=float, default=20.0, help="units so far beyond the area count, metres")
    o = parser.parse_args()
    p = (
        SynthParameters.model_validate(json.loads((o.survey / "synth.json").read_text())["parameters"])
        if o.survey
        else synth_parameters(o.seed, o.size, o.flight, 0.0, o.set, suffers="standard")
    )
    town = make_town(p.seed, p.whole_town)
    area = shapely.box(*p.area).buffer(o.around)
    units = [u for u in town.units if u.breaks and area.contains(u.wall_outline)]
    bench = Bench(Scene(town.mesh(area.buffer(60.0).bounds)), p.images, p.truth_cell_m)
    print(f"{len(units)} units with discontinuities, {len(p.images)} images", flush=True)
    run = None
    if o.run is not None:
        run = walked(o.run, str(o.survey / "catalog"), o.aoi)
        bench.depths = Depths(run.store, run.walls)
    for unit in units:
        bench.judge(unit, area_of(unit, town.units), None if run is None else evidence_in(run, unit, town.units))
    bench.report()


if __name__ == "__main__":
    main()

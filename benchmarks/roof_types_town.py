"""Roof types from an ortho of 0.25 m and coarse heights: drawn houses by the hundred, and the houses of the synthetic town.

python benchmarks/roof_types_town.py --houses 20                             # drawn houses of every shape
python benchmarks/roof_types_town.py --dormers 10                             # dormers of drawn houses: recall and false ones
python benchmarks/roof_types_town.py --town FOLDER --seeds 7 11 13 --size 200  # the town's own ortho, drawn as by matching
python benchmarks/roof_types_town.py --town FOLDER --lean 0.11                 # the same as a plain ortho

Asked for: RMSE of the skeleton's nodes ≤ 0.5 m with true outlines, ≤ 0.8 m with outlines disturbed to 0.73 m; type right for
≥ 95 % of simple and ≥ 80 % of complex roofs; the same type with surface models of 0.5, 1 and 2 m for ≥ 95 %.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np
import shapely
import shapely.affinity
from shapely import Polygon

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Candidate, Evidence, HeightRaster, Picture
from cityflow.core.roof_type_names import RoofType
from cityflow.geometry.roof_adjacency import RoofSurface
from cityflow.geometry.roof_type import type_of_surfaces
from cityflow.reconstruction.roof_types import best_roofs, reconstruct
from cityflow.reconstruction.roof_types_parts.roof_evidence import RoofTypesParameters, read
from cityflow.synthetic.roofs import MAIN, TruthFace, visible_faces
from cityflow.synthetic.town_truth import TruthRasters, truth_rasters
from cityflow.synthetic.town_units import Unit
from drawn_town import DrawnTown, drawn_town, table
from roof_skeletons import (
    FoundShapes,
    found_shapes,
    node_errors,
    roof_polygons,
    skeleton_nodes,
    united_by_plane,
)
from scenes.drawn_houses import (
    BEYOND,
    COMPLEX,
    DORMERED,
    SIMPLE,
    DrawnHouse,
    disturbed,
    dormer_outlines,
    drawn_house,
    leaning,
)

CELLS_M = (0.5, 1.0, 2.0)
BARE = ("gable", "hip", "half-hip")
DISTURBED_M, NOISE_M, ORTHO_M = 0.73, 0.35, 0.25
WITHIN_M, AROUND_M = 3.0, 6.0


@dataclass(frozen=True)
class Case:
    """A building with its truth: group (simple, complex, row, beyond), shape, type, nodes, and its ground."""

    group: str
    shape: str
    type: RoofType
    outline: Polygon
    nodes: FloatArray
    house: DrawnHouse | tuple[Unit, TownRasters]


@dataclass(frozen=True)
class TownRasters:
    """Ortho and true heights of a whole town."""

    ortho: ByteArray
    ortho_grid: Grid
    truth: TruthRasters
    seed: int
    true: bool = True


@dataclass
class Tally:
    """Outcomes of one group or shape."""

    types: list[bool] = field(default_factory=list)
    same: list[bool] = field(default_factory=list)
    gaps: list[float] = field(default_factory=list)
    uncut: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def row(self, name: str) -> list[str]:
        gaps = np.array(self.gaps)
        near = gaps[gaps <= WITHIN_M]
        rmse = f"{np.sqrt(np.mean(near**2)):.2f}" if len(near) else "–"
        median = f"{np.median(near):.2f}" if len(near) else "–"
        missed = f"{100 * np.mean(gaps > WITHIN_M):.1f} %" if len(gaps) else "–"
        far = np.array(self.uncut)
        both = f"{np.sqrt(np.mean(far**2)):.2f}" if len(far) else "–"
        same = f"{100 * np.mean(self.same):.0f} %" if self.same else "–"
        return [
            name, str(len(self.types)), f"{100 * np.mean(self.types):.1f} %", same, rmse, both, median, missed, f"{np.median(self.seconds):.3f}",
        ]  # fmt: skip


def house_cases(count: int, first: int) -> Iterator[Case]:
    """Drawn houses of every shape."""
    for group, shapes in (("simple", SIMPLE), ("complex", COMPLEX), ("beyond", BEYOND)):
        for shape in shapes:
            for seed in range(first, first + count):
                house = drawn_house(shape, seed)
                nodes = true_nodes(house.prisms, house.outline)
                yield Case(group, shape, house.type, house.outline, nodes, house)


def town_cases(drawn: DrawnTown, lean: float = 0.0) -> Iterator[Case]:
    """Units of a town that are wholly inside it; its ortho leans to the north-east by so much per metre of height."""
    rasters = town_rasters(drawn)
    if lean:
        rasters = leaning_rasters(rasters, lean)
    for unit in drawn.town.units:
        outline = without_straight(unit.wall_outline)
        kind = type_of_surfaces([RoofSurface(f.polygon, f.plane) for f in unit.roof_planes if f.kind == MAIN])
        main = [v for v in unit.volumes if v.bottom is None]
        nodes = true_nodes(tuple(unit.frame.face(f) for v in main for f in v.faces), outline)
        extras = any(f.kind != MAIN and f.polygon.area > 1.0 for f in unit.roof_planes)
        simple = len(outline.exterior.coords) == 5 and not extras
        group = "row" if unit.row else "simple" if simple else "complex"
        yield Case(group, unit.shape, kind, outline, nodes, (unit, rasters))


def without_straight(outline: Polygon) -> Polygon:
    """Vertices of neighbours on straight walls tell where they stand: they are left out."""
    ring = np.asarray(outline.simplify(1e-3).exterior.coords)[:-1]
    before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
    step = after - before
    away = np.abs(step[:, 0] * (ring - before)[:, 1] - step[:, 1] * (ring - before)[:, 0]) / np.hypot(*step.T)
    return Polygon(ring[away > 1e-3])


def true_nodes(prisms: tuple[TruthFace, ...], outline: Polygon) -> FloatArray:
    """Nodes of the main faces' edges within the outline; dormers and chimneys are no part of the skeleton."""
    x, y = outline.bounds[:2]
    faces = visible_faces([p for p in prisms if p.kind == MAIN])
    planes = [np.array([f.plane.slope_x, f.plane.slope_y, float(f.plane.z(x, y))]) for f in faces]
    return skeleton_nodes(united_by_plane([(f.polygon, p) for f, p in zip(faces, planes, strict=True)]), outline)


def town_rasters(drawn: DrawnTown) -> TownRasters:
    """The ortho brought to 0.25 m, and true heights on cells of 0.25 m."""
    frame = drawn.frames[0]
    assert frame.ortho is not None
    x, y = drawn.town.bounds[:2]
    size = round(drawn.size / ORTHO_M)
    grid = Grid(x, y + drawn.size, ORTHO_M, size, size)
    bands = [cv2.resize(band, (size, size), interpolation=cv2.INTER_AREA) for band in frame.ortho]
    return TownRasters(np.stack(bands), grid, truth_rasters(drawn.town, grid), drawn.seed)


def leaning_rasters(rasters: TownRasters, lean: float) -> TownRasters:
    """The ortho as a plain one."""
    above = rasters.truth.dsm - rasters.truth.dtm
    part = (lean / np.sqrt(2), lean / np.sqrt(2))
    colour = leaning(rasters.ortho.transpose(1, 2, 0).astype(np.float64), above, rasters.ortho_grid.cell, part)
    return replace(rasters, ortho=np.ascontiguousarray(colour.transpose(2, 0, 1)).astype(np.uint8), true=False)


def evidence_of(case: Case, cell: float, outline: Polygon, epochs: int = 1) -> Evidence:
    """What the method sees: ortho, heights in whole metres above ground, outline."""
    if isinstance(case.house, DrawnHouse):
        house = case.house
        pictures = tuple(house.ortho(epoch) for epoch in range(epochs))
        return Evidence(
            case.shape, outline, PointCloud.empty(), house.ground, heights=house.heights(cell), pictures=pictures
        )
    unit, rasters = case.house
    heights, picture = town_windows(rasters, outline, cell, unit.index)
    return Evidence(unit.id, outline, PointCloud.empty(), unit.floor_m, heights=heights, pictures=(picture,))


def town_windows(rasters: TownRasters, outline: Polygon, cell: float, index: int) -> tuple[HeightRaster, Picture]:
    """Ortho and noisy heights around a unit."""
    truth, grid = rasters.truth, rasters.ortho_grid
    x0, y0, x1, y1 = outline.buffer(AROUND_M).bounds
    step = round(cell / grid.cell)
    r0 = max(int((grid.y_max - y1) / grid.cell) // step * step, 0)
    c0 = max(int((x0 - grid.x_min) / grid.cell) // step * step, 0)
    rows = min(int((y1 - y0) / cell) + 2, (grid.rows - r0) // step)
    cols = min(int((x1 - x0) / cell) + 2, (grid.cols - c0) // step)
    part = np.s_[r0 : r0 + rows * step, c0 : c0 + cols * step]
    dsm, dtm = (v[part].reshape(rows, step, cols, step).mean(axis=(1, 3)) for v in (truth.dsm, truth.dtm))
    rng = np.random.default_rng([rasters.seed, index, round(100 * cell)])
    noise = np.clip(rng.normal(0, NOISE_M, dsm.shape), -1, 1)
    corner = grid.x_min + c0 * grid.cell, grid.y_max - r0 * grid.cell
    heights = HeightRaster(Grid(*corner, cell, rows, cols), dtm + np.round(dsm - dtm + noise), dtm)
    return heights, Picture(
        Grid(*corner, grid.cell, rows * step, cols * step), rasters.ortho[(slice(None), *part)], rasters.true
    )


def judge(cases: Iterator[Case], disturb: bool, say: bool) -> dict[str, Tally]:
    """All cases at all cell sizes; tallies by group and by shape."""
    tallies: dict[str, Tally] = {}
    for case in cases:
        rng = np.random.default_rng([len(case.shape), round(1000 * case.outline.area)])
        outline = disturbed(case.outline, rng, DISTURBED_M) if disturb else case.outline
        mine = [tallies.setdefault(name, Tally()) for name in (case.group, f"{case.group}: {case.shape}")]
        kinds = []
        for cell in CELLS_M:
            start = time.process_time()
            candidate = reconstruct(evidence_of(case, cell, outline), RoofTypesParameters())
            seconds = time.process_time() - start
            kinds.append(candidate.roof_type)
            right = candidate.roof_type == case.type
            missed, spurious = node_gaps(candidate, case, outline)
            for tally in mine:
                tally.types.append(right)
                tally.gaps += missed if right else []
                tally.uncut += [g for g in missed + spurious if np.isfinite(g)]
                tally.seconds.append(seconds)
            if say and not right:
                print(
                    case.group, case.shape, name_of(case), cell, case.type, "->", candidate.roof_type, candidate.reason
                )
        for tally in mine:
            tally.same.append(len(set(kinds)) == 1)
    return tallies


def name_of(case: Case) -> str:
    return str(case.house.seed) if isinstance(case.house, DrawnHouse) else case.house[0].id


def node_gaps(candidate: Candidate, case: Case, outline: Polygon) -> tuple[list[float], list[float]]:
    """Distances from every true node to the nearest found one, and back; infinite where the other side has none."""
    if candidate.solid is None:
        return [], []
    faces = [shapely.make_valid(f) for f in roof_polygons(candidate.solid)]
    found = skeleton_nodes(faces, outline)
    # Over a disturbed outline a hip ends beside the corner, which is no node of the truth.
    there = np.concatenate([case.nodes, shapely.get_coordinates(case.outline.exterior)[:-1]])
    missed = node_errors(case.nodes, found).missed
    return [float(g) for g in missed], [float(g) for g in node_errors(there, found).spurious]


def report(title: str, tallies: dict[str, Tally]) -> None:
    names = [
        "buildings",
        "cases",
        "type right",
        "same at 0.5, 1, 2 m",
        "RMSE of nodes (m)",
        "uncut, both ways (m)",
        "median (m)",
        "beyond 3 m",
        "CPU (s)",
    ]
    table(title, names, [tallies[k].row(k) for k in sorted(tallies, key=lambda k: (k.split(":")[0], k))])


def dormer_report(seeds: range) -> None:
    """Dormers of houses with them, and of bare ones, from heights in whole metres and from better ones."""
    rows = []
    for noise, whole in ((NOISE_M, True), (0.15, False)):
        for shape in (*DORMERED, *BARE):
            for cell in CELLS_M[:2]:
                found = [_dormers(drawn_house(shape, seed), cell, noise, whole) for seed in seeds]
                true, hit, count, false = (
                    sum(v) for v in zip(*((f.true, f.hit, f.found, f.false) for f in found), strict=True)
                )
                recall = f"{100 * hit / true:.0f} %" if true else "–"
                heights = f"{noise} m, whole metres" if whole else f"{noise} m"
                rows.append([shape, heights, f"{cell} m", str(true), recall, str(count), str(false)])
    table("Dormers", ["houses", "noise", "cells", "true", "recall", "found", "false"], rows)


def _dormers(house: DrawnHouse, cell: float, noise: float, whole: bool) -> FoundShapes:
    evidence = Evidence(
        house.shape,
        house.outline,
        PointCloud.empty(),
        house.ground,
        heights=house.heights(cell, noise, whole),
        pictures=(house.ortho(),),
    )
    reading = read(evidence, RoofTypesParameters())
    parts = best_roofs(reading, "", RoofTypesParameters())[0].dormers
    there = [shapely.affinity.translate(Polygon(p.skeleton.quad.ring()), *reading.origin[:2]) for p in parts]
    return found_shapes(dormer_outlines(house), there)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--houses", type=int, default=0, help="drawn houses of each shape")
    parser.add_argument("--dormers", type=int, default=0, help="drawn houses with dormers of each kind, and bare ones")
    parser.add_argument("--first", type=int, default=0, help="first seed of drawn houses")
    parser.add_argument("--town", type=Path, help="folder of drawn towns")
    parser.add_argument("--seeds", type=int, nargs="+", default=[7, 11, 13])
    parser.add_argument("--size", type=int, default=200)
    parser.add_argument("--outlines", choices=["true", "disturbed", "both"], default="both")
    parser.add_argument("--lean", type=float, default=0.0, help="displacement per metre of height of the town's ortho")
    parser.add_argument("--say", action="store_true", help="name every wrong type")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    if options.dormers:
        dormer_report(range(options.first, options.first + options.dormers))
    for disturb in (False, True):
        if options.outlines == ("true" if disturb else "disturbed"):
            continue
        title = f"outlines disturbed to {DISTURBED_M} m" if disturb else "true outlines"
        if options.houses:
            report(f"Drawn houses, {title}", judge(house_cases(options.houses, options.first), disturb, options.say))
        if options.town:
            towns = (drawn_town(seed, options.size, options.town) for seed in options.seeds)
            cases = (case for town in towns for case in town_cases(town, options.lean))
            report(f"Town, {title}", judge(cases, disturb, options.say))


if __name__ == "__main__":
    main()

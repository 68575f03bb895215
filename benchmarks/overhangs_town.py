"""Overhangs of a synthetic town: found ones against true ones by GSD, wall error and sensor, and the solids that they make.

python benchmarks/overhangs_town.py --seeds 7 11 13 --size 120
python benchmarks/overhangs_town.py --run RUN --survey SURVEY          # a town that was photographed and matched, true outlines
python benchmarks/overhangs_town.py --run RUN --survey SURVEY --found  # what the run exported, with the outlines that it found
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.building import EdgeOverhang, OutlineEdge
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence, HeightRaster, Picture
from cityflow.evaluation.models import compare_model
from cityflow.evaluation.models_overhangs import shares_within, true_overhang
from cityflow.geometry.polyhedron import rings_of
from cityflow.geometry.straight_edges import WallEdge, wall_edges
from cityflow.geometry.validity import check_polygons, is_valid
from cityflow.io.rasters.surface_dataset import grids_of, read_layers
from cityflow.reconstruction import orientation_histogram as histogram
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.overhang_solid import with_overhangs
from cityflow.reconstruction.overhangs.rim_search import find_overhangs
from cityflow.reconstruction.party.party_walls import cut_party_walls, differing_walls
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_truth import TruthRasters, truth_rasters
from cityflow.synthetic.town_units import Unit
from scenes.drawn_frames import NADIR_NOISE
from scenes.drawn_heights import FLAT, LEAVES, TrueView, matched_heights
from town_models import of_run

GSDS_M = (0.05, 0.08, 0.12, 0.2)
SHIFTS_M = (0.1, 0.2, 0.3)
OUTLINES_OFF_M = (0.05, 0.1, 0.2)
SURVEYED_M = 0.03
SHORTEST_M, NONE_M, MARGIN_M = 1.0, 0.02, 4.0
DENSITY_M2, NOISE_M = 20.0, 0.03
APART_M = 0.05
GSD_M = 0.08


@dataclass(frozen=True)
class Place:
    """A unit with its neighbours' walls and a model of it."""

    unit: Unit
    party: tuple[LineString, ...]
    outline: Polygon
    shift: np.ndarray
    model: Candidate
    points: PointCloud


@dataclass
class Tally:
    """Edges of at least 1 m: true and found overhang, what the surface says of it, and seconds per unit."""

    true: list[float] = field(default_factory=list)
    found: list[float] = field(default_factory=list)
    sigma: list[float] = field(default_factory=list)
    bare: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def row(self, name: str, gsd: float) -> list[str]:
        error, sigma, found = np.subtract(self.found, self.true), np.array(self.sigma), np.array(self.found)
        off, told = np.abs(error), np.isfinite(sigma) & (found > 0)
        bare = np.array(self.bare)
        return [
            name, f"{len(off)}", f"{100 * np.median(off):.1f}", f"{np.median(off) / gsd:.2f}", f"{100 * np.mean(off <= gsd):.0f}",
            f"{100 * np.mean(off <= 2 * gsd):.0f}", f"{100 * np.median(error[found > 0]):+.1f}", f"{np.sum(found == 0)}",
            f"{np.sum(bare > 0)} of {len(bare)}", f"{np.percentile(off[told] / sigma[told], 68):.2f}",
            f"{1e3 * np.median(self.seconds):.0f} / {1e3 * np.max(self.seconds):.0f}",
        ]  # fmt: skip


HEAD = (
    "case", "edges", "median cm", "GSD", "≤ 1 GSD %", "≤ 2 GSD %", "bias cm", "missed", "invented", "68 % of error/σ", "ms",
)  # fmt: skip


def places_of(town: Town, shift_m: float = 0.0, seed: int = 0) -> list[Place]:
    """Models from true points with noise, in outlines that are off by `shift_m` in a direction of their own."""
    rng = np.random.default_rng([seed, 17])
    walls = [u.wall_outline for u in town.units]
    tree = shapely.STRtree(walls)
    places = []
    for number, unit in enumerate(town.units):
        shared = [
            part
            for other in sorted(tree.query(walls[number], predicate="dwithin", distance=1e-4))
            if other != number
            for part in shapely.get_parts(
                shapely.line_merge(shapely.intersection(walls[number].boundary, shapely.buffer(walls[other], 1e-4)))
            )
            if part.geom_type == "LineString" and part.length > 0.01
        ]
        angle = rng.uniform(0, 2 * np.pi)
        shift = shift_m * np.array([np.cos(angle), np.sin(angle)])
        outline = shapely.transform(unit.wall_outline, lambda xy, by=shift: xy + by)
        party = tuple(shapely.transform(line, lambda xy, by=shift: xy + by) for line in shared)
        points = _roof_points(unit, outline, rng)
        model = histogram.reconstruct(
            Evidence(unit.id, outline, points, unit.floor_m), histogram.OrientationHistogramParameters()
        )
        places.append(Place(unit, party, outline, shift, model, points))
    return places


def _roof_points(unit: Unit, outline: Polygon, rng: np.random.Generator) -> PointCloud:
    x_0, y_0, x_1, y_1 = outline.bounds
    count = int(DENSITY_M2 * (x_1 - x_0) * (y_1 - y_0))
    x, y = rng.uniform(x_0, x_1, count), rng.uniform(y_0, y_1, count)
    z = unit.z(x, y) + rng.normal(0, NOISE_M, count)
    inside = shapely.contains_xy(outline, x, y) & np.isfinite(z)
    return PointCloud.of(np.column_stack([x, y, z])[inside], BUILDING)


def drawn(truth: TruthRasters, seed: int) -> np.ndarray:
    """Heights as matching from above would leave them."""
    kind = np.where(np.isin(truth.part, [int(Part.FOLIAGE), int(Part.TRUNK)]), LEAVES, FLAT).astype(np.uint8)
    light, contrast = np.zeros(truth.grid.shape, bool), np.full(truth.grid.shape, 9.0, np.float32)
    view = TrueView(truth.grid, truth.dsm, truth.dsm_bare, kind, light, contrast)
    return matched_heights(view, NADIR_NOISE, seed).astype(np.float64)


def window(grid: Grid, bounds: Bounds) -> Grid:
    row, col = grid.indices(np.array([bounds[0], bounds[2]]), np.array([bounds[3], bounds[1]]))
    row, col = np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1)
    return Grid(
        grid.x_min + int(col[0]) * grid.cell, grid.y_max - int(row[0]) * grid.cell, grid.cell,
        int(row[1] - row[0]) + 1, int(col[1] - col[0]) + 1,
    )  # fmt: skip


def evidence_of(place: Place, grid: Grid, dsm: np.ndarray, ortho: np.ndarray | None = None) -> Evidence:
    part = window(grid, grown(place.outline.bounds, MARGIN_M))
    cut = grid.slices(part)
    heights = HeightRaster(part, dsm[cut].astype(np.float64), np.zeros(part.shape))
    pictures = () if ortho is None else (Picture(part, ortho[:, cut[0], cut[1]]),)
    return Evidence(
        place.unit.id, place.outline, place.points, place.unit.floor_m, heights=heights, pictures=pictures,
        party=place.party, edges=surveyed(place),
    )  # fmt: skip


def surveyed(place: Place, sigma_m: float = SURVEYED_M) -> tuple[OutlineEdge, ...]:
    """What is said of an outline that is true."""
    return tuple(OutlineEdge(e.line, "given", sigma_m) for e in wall_edges(place.outline, place.party))


def true_edges(place: Place) -> list[tuple[WallEdge, float]]:
    """Edges of the outline as it is given, with the place of the true rim before each; 0 where there is no overhang."""
    found = []
    for edge in wall_edges(place.outline, place.party):
        start, end = edge.xy[0] - place.shift, edge.xy[-1] - place.shift
        true = 0.0 if edge.party or edge.length < 0.05 else true_overhang(start, end, place.unit.roof_outline)
        found.append((edge, true if true > NONE_M else 0.0))
    return found


def judge(tally: Tally, place: Place, evidence: Evidence, parameters: OverhangParameters) -> tuple[EdgeOverhang, ...]:
    start = time.perf_counter()
    overhangs = find_overhangs(evidence, place.model, parameters)
    tally.seconds.append(time.perf_counter() - start)
    for (edge, true), overhang in zip(true_edges(place), overhangs, strict=True):
        if edge.length < SHORTEST_M:
            continue
        if true == 0:
            tally.bare.append(overhang.reach_m)
            continue
        # a line apart from the outline is where façades are said to stand: what counts then is how far the roof stands out, not where its rim is
        apart = shapely.distance(overhang.line.centroid, place.outline.boundary) > APART_M
        tally.true.append(true if apart else max(true - float(place.shift @ edge.outward), 0.0))
        tally.found.append(overhang.reach_m)
        tally.sigma.append(overhang.sigma_m)
    return overhangs


def facade_points(place: Place, rng: np.random.Generator) -> WallPoints:
    """Points on the true walls, 20 per metre of wall."""
    parts = [joined_walls(())]
    for edge in wall_edges(place.unit.wall_outline, ()):
        count = int(20 * edge.length)
        s = rng.uniform(0, edge.length, count)
        xy = edge.start + s[:, None] * edge.along + rng.normal(0, 0.06, count)[:, None] * edge.outward
        z = rng.uniform(place.unit.floor_m, max(place.unit.eave_m, place.unit.floor_m + 1), count)
        normal = np.broadcast_to(edge.outward, (count, 2)).astype(np.float32)
        parts.append(
            WallPoints(np.column_stack([xy, z]), normal, np.full(count, 0.06, np.float32), np.full(count, 3, np.uint8))
        )
    return joined_walls(parts)


def lidar(truth: TruthRasters, density_m2: float, seed: int) -> PointCloud:
    """First returns from straight above, 5 cm off in plan and 2 cm in height; classes are those of the truth."""
    rng = np.random.default_rng([seed, 31])
    x_0, y_0, x_1, y_1 = truth.grid.bounds
    count = int(density_m2 * (x_1 - x_0) * (y_1 - y_0))
    x, y = rng.uniform(x_0, x_1, count), rng.uniform(y_0, y_1, count)
    row, col = truth.grid.indices(x, y)
    z, unit = truth.dsm[row, col] + rng.normal(0, 0.02, count), truth.unit[row, col]
    built = (unit >= 0) & np.isfinite(z)
    xyz = np.column_stack([x + rng.normal(0, 0.05, count), y + rng.normal(0, 0.05, count), z])
    return PointCloud.of(xyz[built], BUILDING)


def table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    print(f"\n{title}\n\n| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


def with_drawn(seeds: Sequence[int], size: int, parameters: OverhangParameters) -> None:
    """All cases of towns whose surfaces are drawn."""
    tallies = {f"{100 * g:g} cm": Tally() for g in GSDS_M}
    tallies |= {f"8 cm, walls off by {s:g} m{how}": Tally() for s in SHIFTS_M for how in ("", ", façades seen")}
    points = {s: Tally() for s in (0.0, *OUTLINES_OFF_M)}
    solids: list[list[str]] = []
    for seed in seeds:
        town = make_town(seed, TownParameters(width_m=size, height_m=size))
        places = places_of(town, seed=seed)
        for gsd in GSDS_M:
            truth = truth_rasters(town, Grid.covering(town.bounds, gsd))
            dsm = drawn(truth, seed)
            found = [
                judge(tallies[f"{100 * gsd:g} cm"], p, evidence_of(p, truth.grid, dsm), parameters) for p in places
            ]
            if gsd == 0.08:
                solids.append(solid_row(f"seed {seed}", places, found, parameters))
                _shifted(town, (truth.grid, dsm), tallies, seed, parameters)
                for shift, tally in points.items():
                    _by_points(tally, places_of(town, shift, seed), lidar(truth, 10.0, seed), parameters)
    rows = [t.row(name, 0.08 if "off" in name else float(name.split()[0]) / 100) for name, t in tallies.items()]
    rows += [
        t.row(
            "LiDAR, 10 points per m² (1 GSD: 8 cm)" + (f", outlines off by {s:g} m, nothing said of them" if s else ""),
            0.08,
        )
        for s, t in points.items()
    ]
    table("Overhangs per edge", HEAD, rows)
    table("Solids", SOLID_HEAD, solids)


def _shifted(
    town: Town, surface: tuple[Grid, np.ndarray], tallies: dict[str, Tally], seed: int, parameters: OverhangParameters
) -> None:
    for shift in SHIFTS_M:
        rng = np.random.default_rng([seed, 5])
        for place in places_of(town, shift, seed):
            plain = evidence_of(place, *surface)
            known = surveyed(place, shift / np.sqrt(2))
            fields = {name: getattr(plain, name) for name in Evidence.__slots__}
            judge(tallies[f"8 cm, walls off by {shift:g} m"], place, Evidence(**{**fields, "edges": known}), parameters)
            seen = Evidence(**{**fields, "edges": known, "walls": facade_points(place, rng)})
            judge(tallies[f"8 cm, walls off by {shift:g} m, façades seen"], place, seen, parameters)


def _by_points(tally: Tally, places: Sequence[Place], cloud: PointCloud, parameters: OverhangParameters) -> None:
    for place in places:
        close = cloud.within(grown(place.outline.bounds, 2.0))
        close = close.take(shapely.dwithin(shapely.points(close.xyz[:, :2]), place.outline, 2.0))
        judge(
            tally, place,
            Evidence(
                place.unit.id, place.outline, place.points, place.unit.floor_m, around=close, party=place.party,
                edges=() if place.shift.any() else surveyed(place),
            ),
            parameters,
        )  # fmt: skip


SOLID_HEAD = (
    "town",
    "units",
    "with overhang",
    "all edges kept",
    "valid",
    "surfaces beyond valid",
    "party walls that differ",
    "ms median / most",
)


def solid_row(
    name: str, places: Sequence[Place], found: Sequence[tuple[EdgeOverhang, ...]], parameters: OverhangParameters
) -> list[str]:
    solids, seconds, whole, wanted, valid, beyond = {}, [], 0, 0, 0, 0
    for place, overhangs in zip(places, found, strict=True):
        plain = Evidence(place.unit.id, place.outline, place.points, place.unit.floor_m, party=place.party)
        start = time.perf_counter()
        done = with_overhangs(place.model, overhangs, plain, parameters)
        seconds.append(time.perf_counter() - start)
        if done.solid is None:
            continue
        solids[place.unit.id] = done.solid
        valid += is_valid(done.solid)
        beyond += done.beyond is not None and not check_polygons(rings_of(done.beyond))
        wanted += any(o.reach_m > 0 for o in overhangs)
        whole += any(o.reach_m > 0 for o in overhangs) and done.notes["overhangs_left"] == 0
    differ = len(differing_walls(cut_party_walls(solids)))
    return [
        name, f"{len(solids)}", f"{wanted}", f"{whole}", f"{valid}", f"{beyond}", f"{differ}",
        f"{1e3 * np.median(seconds):.0f} / {1e3 * np.max(seconds):.0f}",
    ]  # fmt: skip


def with_matched(run: Path, survey: Path, parameters: OverhangParameters) -> None:
    """A town that was photographed and matched."""
    made = SynthParameters.model_validate(json.loads((survey / "synth.json").read_text())["parameters"])
    town = make_town(made.seed, made.whole_town)
    lattice, grid = grids_of(str(run / "surface.zarr"))
    _, layers = read_layers(str(run / "surface.zarr"), lattice, grid.bounds, ("dsm", "ortho"))
    dsm, ortho = layers["dsm"], layers["ortho"]
    x_0, y_0, x_1, y_1 = grid.bounds
    places = [
        p for p in places_of(town, seed=made.seed)
        if (b := grown(p.unit.bounds, 2.0))[0] > x_0 and b[1] > y_0 and b[2] < x_1 and b[3] < y_1
    ]  # fmt: skip
    rows, found = [], []
    for name, picture in (("heights alone", None), ("heights and ortho", ortho)):
        tally = Tally()
        found = [judge(tally, p, evidence_of(p, grid, dsm, picture), parameters) for p in places]
        rows.append(tally.row(name, grid.cell))
    table("Matched town, overhangs per edge", HEAD, rows)
    table("Solids", SOLID_HEAD, [solid_row("matched", places, found, parameters)])


def of_products(run: Path, survey: Path) -> None:
    """Edges of the true walls against what a run exported; an edge of which it says nothing has no overhang."""
    errors = [compare_model(truth, model).overhangs for truth, model in of_run(run, survey)]
    off = np.abs(np.concatenate([e.errors_m for e in errors]))
    given = np.concatenate([e.stated for e in errors])
    shares = shares_within(errors, 2 * GSD_M)
    row = [
        f"{len(off)}", f"{np.median(off):.3f}", f"{100 * shares.within:.1f}", f"{100 * shares.stated:.1f}", f"{np.median(off[given]):.3f}",
        f"{100 * shares.stated_within:.1f}", f"{sum(e.invented for e in errors)} of {sum(len(e.bare_m) for e in errors)}",
    ]  # fmt: skip
    head = ("edges", "median m", "≤ 2 GSD %", "stated %", "median of these m", "of these ≤ 2 GSD %", "invented")
    table(f"Overhangs per edge, {run.name}", head, [row])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[7, 11, 13])
    parser.add_argument("--size", type=int, default=120)
    parser.add_argument("--run", type=Path)
    parser.add_argument("--survey", type=Path)
    parser.add_argument("--found", action="store_true", help="what the run exported, not its surface in true outlines")
    asked = parser.parse_args()
    if asked.run is not None and asked.survey is not None and asked.found:
        of_products(asked.run, asked.survey)
    elif asked.run is not None and asked.survey is not None:
        with_matched(asked.run, asked.survey, OverhangParameters())
    else:
        with_drawn(asked.seeds, asked.size, OverhangParameters())


if __name__ == "__main__":
    main()

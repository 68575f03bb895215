"""Walls of exported models where the given outlines are prints of roofs, where they are those of walls, and where none are given: a scanned synthetic town,
run as a user runs it.

    python benchmarks/walls_in.py FOLDER --seeds 301 302 [--size 160] [--density 10] [--prints roofs walls found]

Each town is made and scanned by ``cityflow synth`` (scan angles to 18°, so that façades have echoes), and its true roof outlines or wall outlines are
given as a cadastre would, or its buildings are found. Judged are surfaces of the exported CityJSON, by edges of the true walls of at least 1 m: how far upright
walls that no neighbour shares stand from the true ones, and how far from the true eaves the roof ends, its overhang included. Every town is run twice,
without and with walls that move in: an edge is moved where its wall stands elsewhere by 5 cm, wrongly where it is farther from the true wall than before.
What is there already is not made again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Semantic
from cityflow.core.grid import grown
from cityflow.evaluation.models_overhangs import true_overhang
from cityflow.geometry.polyhedron import rings_of
from cityflow.geometry.straight_edges import wall_edges
from cityflow.geometry.validity import check_polygons, check_polyhedron
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.town import make_town
from cityflow.synthetic.town_units import Unit
from drawn_town import table
from town_models import buildings_of

LAYERS = {"roofs": "roof_outlines", "walls": "wall_outlines"}
FOUND = "found"
WORKFLOWS = Path(__file__).parents[1] / "workflows"
STAY = ["--set", "outline.walls_in.wanted=false"]
MOVED_M = 0.05
NEAR_M, LEAST_COVERED = 4.0, 0.5
SHORTEST_M, NONE_M, STEP_M, CORNER_M = 1.0, 0.02, 0.25, 0.3
INWARD_M, OUTWARD_M = 1.2, 2.4
FROM_INSIDE_M, FAR_M = 1.0, 4.0
EDGE_M = 8.0
"""Units so near to the edge of the survey are not judged."""
INVENTED_M = 0.08
PARALLEL = np.cos(np.radians(10.0))


@dataclass
class Edges:
    """By true edge, metres: overhang, and how far outside the truth the model's wall and its rim are; NaN where it has none."""

    true: FloatArray
    wall: FloatArray
    rim: FloatArray


def survey_of(folder: Path, seed: int, size: int, density: float) -> Path:
    survey = folder / f"s{seed}_{size}_{density:g}"
    if not (survey / "truth" / "town.gpkg").exists():
        _command(
            "synth",
            survey,
            "--seed",
            seed,
            "--size",
            f"{size}x{size}",
            "--flight",
            "none",
            "--lidar",
            density,
            "--workers",
            1,
        )
    return survey


def run_of(survey: Path, prints: str, name: str, more: list[str]) -> Path:
    catalog = survey / f"catalog_{prints}"
    town = survey / "truth" / "town.gpkg"
    given = () if prints == FOUND else ("--outlines", town, "--layer", LAYERS[prints], "--id-column", "unit")
    if not catalog.exists():
        _command("catalog", "create", catalog, "--lidar", survey / "lidar" / "*.laz", *given)
    run = survey / f"run_{prints}_{name}"
    if not (run / "products" / "city.city.jsonl").exists():
        _command(
            "run",
            WORKFLOWS / ("lidar_city_no_outlines.yaml" if prints == FOUND else "lidar_city.yaml"),
            "--catalog",
            catalog,
            "--out",
            run,
            "--workers",
            1,
            "--set",
            "export.formats=[cityjson]",
            *more,
        )
    return run


def _command(*words: object) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "cityflow", *map(str, words)], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, words))}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")


def judged(survey: Path, run: Path) -> tuple[Edges, Counter[str]]:
    """Every unit well inside the survey, and what is to be said of its solids."""
    made = SynthParameters.model_validate(json.loads((survey / "synth.json").read_text())["parameters"])
    town = make_town(made.seed, made.whole_town)
    inside = shapely.box(*grown(made.area, -EDGE_M))
    built = Models.of([b for b in buildings_of(run) if Lod.LOD22 in b.solids])
    tree = shapely.STRtree([u.wall_outline for u in town.units])
    rows, said = [np.empty((0, 3))], Counter[str]()
    for unit in town.units:
        if not inside.contains(unit.roof_outline):
            continue
        said["units"] += 1
        models = built.of_unit(unit)
        said["no model"] += not models
        for model in models:
            said["faulty solids"] += bool(check_polyhedron(model.solids[Lod.LOD22]))
            said["faulty overhangs"] += model.beyond is not None and bool(check_polygons(rings_of(model.beyond)))
        near = sorted(tree.query(unit.wall_outline, predicate="dwithin", distance=1e-4).tolist())
        rows.append(_edges_of(unit, models, [town.units[k] for k in near if town.units[k].id != unit.id]))
    return Edges(*np.concatenate(rows).T), said


@dataclass(frozen=True)
class Models:
    """Exported buildings with what they cover in plan; found ones have names of their own, and need not be the true units."""

    buildings: list[Building]
    covered: list[Polygon]
    tree: shapely.STRtree

    @staticmethod
    def of(buildings: list[Building]) -> Models:
        covered = [_covered(b.solids[Lod.LOD22], b.beyond) for b in buildings]
        return Models(buildings, covered, shapely.STRtree(covered))

    def of_unit(self, unit: Unit) -> list[Building]:
        """All that stand on a unit, if they cover half of it; its own model where it has one."""
        own = [b for b in self.buildings if b.id == unit.id]
        if own:
            return own
        near = sorted(self.tree.query(unit.wall_outline, predicate="intersects").tolist())
        part = [shapely.intersection(self.covered[k], unit.wall_outline).area for k in near]
        if sum(part) < LEAST_COVERED * unit.wall_outline.area:
            return []
        reach = shapely.buffer(unit.wall_outline, NEAR_M)
        return [self.buildings[k] for k in sorted(self.tree.query(reach, predicate="intersects").tolist())]


def _edges_of(unit: Unit, models: list[Building], others: list[Unit]) -> FloatArray:
    shared = tuple(
        part
        for other in others
        for part in shapely.get_parts(shapely.line_merge(shapely.intersection(unit.wall_outline.boundary, shapely.buffer(other.wall_outline, 1e-4))))
        if isinstance(part, LineString) and part.length > 0.01
    )  # fmt: skip
    walls = np.concatenate([np.empty((0, 2, 2)), *(_wall_feet(m.solids[Lod.LOD22]) for m in models)])
    roof = _closed([_covered(m.solids[Lod.LOD22], m.beyond) for m in models])
    rows = []
    for edge in wall_edges(unit.wall_outline, shared):
        if edge.party or edge.length < SHORTEST_M:
            continue
        true = true_overhang(edge.xy[0], edge.xy[-1], unit.roof_outline)
        ends = edge.xy[[0, -1]]
        inner = _further_in(ends)
        rim = true_overhang(inner[0], inner[1], roof) - FROM_INSIDE_M
        rows.append((true if true > NONE_M else 0.0, place_of_wall(ends, walls), rim - true))
    return np.array(rows, np.float64).reshape(-1, 3)


def _further_in(ends: FloatArray) -> FloatArray:
    along = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
    return np.asarray(ends - FROM_INSIDE_M * np.array([along[1], -along[0]]))


def _wall_feet(solid: Polyhedron) -> FloatArray:
    """(n, 2, 2) plan of the upright walls that stand on the floor and touch no neighbour, the outside on the right."""
    floor = solid.vertices[:, 2].min()
    feet = [np.empty((0, 2, 2))]
    for face in solid.of_semantic(Semantic.WALL):
        ring = solid.ring(face.rings[0])
        low = ring[ring[:, 2] < floor + 1e-3]
        if face.neighbour is None and len(low) >= 2:
            # seen from outside the ring runs counter-clockwise: its foot goes from left to right, the building on the left hand
            starts = [
                k for k in range(len(ring)) if ring[k, 2] < floor + 1e-3 and ring[(k + 1) % len(ring), 2] < floor + 1e-3
            ]
            feet += [np.stack([ring[k, :2], ring[(k + 1) % len(ring), :2]])[None] for k in starts]
    return np.concatenate(feet)


def place_of_wall(ends: FloatArray, walls: FloatArray) -> float:
    """Median distance outside an edge of the walls before and behind it, by places along it; NaN where less than half has one."""
    length = float(np.hypot(*(ends[1] - ends[0])))
    along = (ends[1] - ends[0]) / length
    outward = np.array([along[1], -along[0]])
    way = walls[:, 1] - walls[:, 0]
    own = walls[(way @ along) > PARALLEL * np.maximum(np.hypot(*way.T), 1e-9)]
    s, t = (own - ends[0]) @ along, (own - ends[0]) @ outward
    trimmed = min(CORNER_M, length / 4)
    found = []
    for place in np.linspace(trimmed, length - trimmed, max(3, int(length / STEP_M))):
        over = (s[:, 0] <= place) & (s[:, 1] >= place)
        off = t[over, 0] + (t[over, 1] - t[over, 0]) * (place - s[over, 0]) / np.maximum(s[over, 1] - s[over, 0], 1e-9)
        off = off[(off > -INWARD_M) & (off < OUTWARD_M)]
        found.append(off[np.argmin(np.abs(off))] if len(off) else np.nan)
    return float(np.nanmedian(found)) if np.mean(np.isfinite(found)) >= 0.5 else float("nan")


def _covered(solid: Polyhedron, beyond: Polyhedron | None) -> Polygon:
    """What the roof covers in plan, overhangs included."""
    shells = [solid] if beyond is None else [solid, beyond]
    faces = [
        Polygon(s.ring(f.rings[0])[:, :2], [s.ring(r)[:, :2] for r in f.rings[1:]])
        for s in shells
        for f in s.of_semantic(Semantic.ROOF)
    ]
    return _closed(faces)


def _closed(faces: list[Polygon]) -> Polygon:
    return shapely.buffer(shapely.union_all(shapely.buffer(faces, 2e-3, join_style="mitre")), -2e-3, join_style="mitre")


HEAD = (
    "case", "walls move in", "units", "edges with overhang", "wall off m, median", "68 %", "within 0.1 m %", "within 0.2 m %",
    "rim off m, median", "rim within 0.2 m %", "edges without", "wall off, median", "wall within 0.1 m %", "invented",
    "moved, with overhang", "wrongly", "moved, without", "wrongly", "faulty",
)  # fmt: skip


def row_of(name: str, edges: Edges, before: Edges | None, said: Counter[str]) -> list[str]:
    has = edges.true > NONE_M
    wall, rim = _off(edges.wall), _off(edges.rim)
    beyond = edges.rim + edges.true - np.where(np.isfinite(edges.wall), edges.wall, 0.0)
    return [
        name, "no" if before is None else "yes", f"{said['units']}", f"{has.sum()}", f"{np.median(wall[has]):.3f}", f"{np.percentile(wall[has], 68):.3f}",
        f"{100 * np.mean(wall[has] <= 0.1):.1f}", f"{100 * np.mean(wall[has] <= 0.2):.1f}",
        f"{np.median(rim[has]):.3f}", f"{100 * np.mean(rim[has] <= 0.2):.1f}",
        f"{(~has).sum()}", f"{np.median(wall[~has]):.3f}", f"{100 * np.mean(wall[~has] <= 0.1):.1f}",
        f"{np.sum(beyond[~has] > INVENTED_M)}", *_moved(edges, before, has), *_moved(edges, before, ~has),
        f"{said['faulty solids']} + {said['faulty overhangs']} + {said['no model']}",
    ]  # fmt: skip


def _off(metres: FloatArray) -> FloatArray:
    return np.where(np.isfinite(metres), np.abs(metres), np.inf)


def _moved(edges: Edges, before: Edges | None, which: np.ndarray) -> tuple[str, str]:
    """How many walls stand elsewhere than before, and how many of these farther from the true ones."""
    if before is None:
        return "", ""
    was, now = before.wall[which], edges.wall[which]
    moved = ~(np.abs(was - now) <= MOVED_M) & (np.isfinite(was) | np.isfinite(now))
    return f"{moved.sum()}", f"{np.sum(moved & (_off(now) > _off(was)))}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[301, 302])
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--density", type=float, default=10.0)
    parser.add_argument("--prints", nargs="+", choices=[*LAYERS, FOUND], default=[*LAYERS, FOUND])
    parser.add_argument(
        "--name", default="now", help="of the runs, so that two states of the code can stand side by side"
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="parameter of the workflow")
    asked = parser.parse_args()
    more = [word for s in asked.set for word in ("--set", s)]
    rows = []
    for prints in asked.prints:
        cases = {f"{prints}, seed {s}": both(asked.folder, s, asked, (prints, more)) for s in asked.seeds}
        every = list(cases.values())
        cases[f"{prints}, all"] = [
            (_together([c[k][0] for c in every]), sum((c[k][1] for c in every), Counter())) for k in (0, 1)
        ]
        for name, ((still, said_still), (edges, said)) in cases.items():
            rows += [row_of(name, still, None, said_still), row_of(name, edges, still, said)]
    table(f"Walls and eaves of exported models, {asked.name}", HEAD, rows)


def both(
    folder: Path, seed: int, asked: argparse.Namespace, how: tuple[str, list[str]]
) -> list[tuple[Edges, Counter[str]]]:
    """Without walls that move in, and with them."""
    survey, (prints, more) = survey_of(folder, seed, asked.size, asked.density), how
    runs = run_of(survey, prints, f"{asked.name}_still", [*more, *STAY]), run_of(survey, prints, asked.name, more)
    return [judged(survey, run) for run in runs]


def _together(every: list[Edges]) -> Edges:
    return Edges(*(np.concatenate([getattr(e, n) for e in every]) for n in ("true", "wall", "rim")))


if __name__ == "__main__":
    main()

"""Walls of exported models where the given outlines are prints of roofs, and where they are those of walls: a scanned synthetic town, run as a user runs it.

    python benchmarks/walls_in.py FOLDER --seeds 301 302 [--size 160] [--density 10] [--prints roofs walls]

Each town is made and scanned by ``cityflow synth`` (scan angles to 18°, so that façades have echoes), and its true roof outlines or wall outlines are
given as a cadastre would. Judged are surfaces of the exported CityJSON: how far upright walls that no neighbour shares stand from the true walls, and how far
from the true eaves the roof ends, its overhang included; by edges of the true walls of at least 1 m. What is there already is not made again.
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
from cityflow.stages.synth_survey import SynthParameters
from cityflow.synthetic.town import make_town
from cityflow.synthetic.town_units import Unit
from drawn_town import table
from town_models import buildings_of

LAYERS = {"roofs": "roof_outlines", "walls": "wall_outlines"}
WORKFLOW = Path(__file__).parents[1] / "workflows" / "lidar_city.yaml"
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
    if not catalog.exists():
        town = survey / "truth" / "town.gpkg"
        _command(
            "catalog",
            "create",
            catalog,
            "--lidar",
            survey / "lidar" / "*.laz",
            "--outlines",
            town,
            "--layer",
            LAYERS[prints],
            "--id-column",
            "unit",
        )
    run = survey / f"run_{prints}_{name}"
    if not (run / "products" / "city.city.jsonl").exists():
        _command(
            "run",
            WORKFLOW,
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
    built = {b.id: b for b in buildings_of(run)}
    tree = shapely.STRtree([u.wall_outline for u in town.units])
    rows, said = [np.empty((0, 3))], Counter[str]()
    for unit in town.units:
        if not inside.contains(unit.roof_outline):
            continue
        said["units"] += 1
        model = built.get(unit.id)
        if model is None or Lod.LOD22 not in model.solids:
            said["no model"] += 1
            continue
        said["faulty solids"] += bool(check_polyhedron(model.solids[Lod.LOD22]))
        said["faulty overhangs"] += model.beyond is not None and bool(check_polygons(rings_of(model.beyond)))
        said["with overhang"] += any(o.reach_m > 0 for o in model.overhangs)
        near = sorted(tree.query(unit.wall_outline, predicate="dwithin", distance=1e-4).tolist())
        rows.append(_edges_of(unit, model, [town.units[k] for k in near if town.units[k].id != unit.id]))
    return Edges(*np.concatenate(rows).T), said


def _edges_of(unit: Unit, model: Building, others: list[Unit]) -> FloatArray:
    shared = tuple(
        part
        for other in others
        for part in shapely.get_parts(shapely.line_merge(shapely.intersection(unit.wall_outline.boundary, shapely.buffer(other.wall_outline, 1e-4))))
        if isinstance(part, LineString) and part.length > 0.01
    )  # fmt: skip
    solid = model.solids[Lod.LOD22]
    walls, roof = _wall_feet(solid), _covered(solid, model.beyond)
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
    return shapely.buffer(shapely.union_all(shapely.buffer(faces, 2e-3, join_style="mitre")), -2e-3, join_style="mitre")


HEAD = (
    "case", "units", "edges with overhang", "wall off m, median", "68 %", "within 0.1 m %", "within 0.2 m %", "rim off m, median", "rim within 0.2 m %",
    "edges without", "wall off, median", "wall within 0.1 m %", "invented", "faulty",
)  # fmt: skip


def row_of(name: str, edges: Edges, said: Counter[str]) -> list[str]:
    has = edges.true > NONE_M
    wall, rim = np.abs(edges.wall), np.abs(edges.rim)
    wall, rim = (np.where(np.isfinite(v), v, np.inf) for v in (wall, rim))
    beyond = edges.rim + edges.true - np.where(np.isfinite(edges.wall), edges.wall, 0.0)
    return [
        name, f"{said['units']}", f"{has.sum()}", f"{np.median(wall[has]):.3f}", f"{np.percentile(wall[has], 68):.3f}",
        f"{100 * np.mean(wall[has] <= 0.1):.1f}", f"{100 * np.mean(wall[has] <= 0.2):.1f}",
        f"{np.median(rim[has]):.3f}", f"{100 * np.mean(rim[has] <= 0.2):.1f}",
        f"{(~has).sum()}", f"{np.median(wall[~has]):.3f}", f"{100 * np.mean(wall[~has] <= 0.1):.1f}",
        f"{np.sum(beyond[~has] > INVENTED_M)}", f"{said['faulty solids']} + {said['faulty overhangs']} + {said['no model']}",
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[301, 302])
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--density", type=float, default=10.0)
    parser.add_argument("--prints", nargs="+", choices=list(LAYERS), default=list(LAYERS))
    parser.add_argument(
        "--name", default="now", help="of the runs, so that two states of the code can stand side by side"
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="parameter of the workflow")
    asked = parser.parse_args()
    more = [word for s in asked.set for word in ("--set", s)]
    rows = []
    for prints in asked.prints:
        every, total = [], Counter[str]()
        for seed in asked.seeds:
            survey = survey_of(asked.folder, seed, asked.size, asked.density)
            edges, said = judged(survey, run_of(survey, prints, asked.name, more))
            rows.append(row_of(f"{prints}, seed {seed}", edges, said))
            every.append(edges)
            total += said
        together = Edges(*(np.concatenate([getattr(e, n) for e in every]) for n in ("true", "wall", "rim")))
        rows.append(row_of(f"{prints}, all", together, total))
    table(f"Walls and eaves of exported models, {asked.name}", HEAD, rows)


if __name__ == "__main__":
    main()

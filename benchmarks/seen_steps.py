"""Steps of roofs in runs over synthetic towns: how far from the true ones do they stand, before and after photographs have moved them?

    python benchmarks/seen_steps.py RUN TRUTH [RUN TRUTH ...]          # TRUTH: what `cityflow synth` made

The models are those that each run has reconstructed (made with `reconstruct.seen_steps.wanted=false`, or before there was such a key). A step is a wall of
0.4 m and more between two parts of a roof, at least 0.8 m long. Its true place is where the true height passes the middle between the two parts, at
most 1.5 m away, the same at three of five places along it at least; steps without one are not counted. Units right: share of their roof within 20 cm of
the truth, as `verdicts_run.py` has it, where the survey does not end at them. Seconds: processor time of a unit, images read.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron
from cityflow.core.verdicts import REASON_KEY
from cityflow.edges.edge_line import EdgeLine
from cityflow.io.city_models.cityjson import read_feature
from cityflow.io.rasters.surface_dataset import grids_of
from cityflow.reconstruction.seen_steps.edge_lines import roof_steps
from cityflow.reconstruction.seen_steps.with_seen_steps import moved_to, seen_steps
from cityflow.survey.results import HULL
from cityflow.synthetic.town_units import Unit
from drawn_town import table
from texture_world import images_of
from town_models import buildings_of
from verdict_cases import GOOD_SHARE, height_of, true_share
from verdicts_run import places_of, units_of

REACH_M, STEP_M, ALONG, AT_LEAST, SPREAD_M = 1.5, 0.02, (0.15, 0.35, 0.5, 0.65, 0.85), 3, 0.5
SIGNIFICANCE = 2.0
SURVEY_END = "survey ends"
HEAD = (
    "run", "steps", "seen", "moved", "m off, median", "≤ 0.1 m %", "≤ 0.2 m %", "area off, m²", "units", "roof right %", "units right over 95 %",
    "s median", "s most",
)  # fmt: skip


def true_place(edge: EdgeLine, near: list[Unit]) -> float:
    """Metres outside an edge; NaN where there is no true step."""
    off, found = np.arange(-REACH_M, REACH_M, STEP_M), []
    for share in ALONG:
        xyz = edge.places(np.array([share * edge.length]), off)[0]
        z = np.fmax.reduce([height_of(u, xyz[:, 0], xyz[:, 1]) for u in near])
        high = np.isfinite(z) & (z > xyz[:, 2] - edge.drop / 2)
        ends = off[:-1][high[:-1] & ~high[1:]] + STEP_M / 2
        if len(ends):
            found.append(float(ends[np.abs(ends).argmin()]))
    return float(np.median(found)) if len(found) >= AT_LEAST and np.ptp(found) < SPREAD_M else float("nan")


def places_off(solid: Polyhedron, outline: shapely.Polygon, near: list[Unit]) -> FloatArray:
    """(E, 2) metres off the true place, and length, of the steps that have one."""
    edges = [e for s in roof_steps(solid, outline) for e in s.edges]
    rows = np.array([(true_place(e, near), e.length) for e in edges], np.float64).reshape(-1, 2)
    return np.asarray(rows[np.isfinite(rows[:, 0])])


def told(name: str, off: FloatArray, counts: list[int], shares: FloatArray, seconds: FloatArray) -> list[str]:
    away = np.abs(off[:, 0])
    return [
        name, *(f"{c}" for c in counts), f"{np.median(away):.3f}", *(f"{100 * np.mean(away <= m):.0f}" for m in (0.1, 0.2)),
        f"{(away * off[:, 1]).sum():.1f}", f"{len(shares)}", f"{100 * shares.mean():.2f}", f"{int((shares >= GOOD_SHARE).sum())}",
        *((f"{np.median(seconds):.3f}", f"{seconds.max():.2f}") if len(seconds) else ("", "")),
    ]  # fmt: skip


def hulls_of(run: Path) -> list[Building]:
    """The models of what a run has exported, as they were reconstructed."""
    names = {b.id for b in buildings_of(run)}
    newest = {f.parent.name: f for f in sorted(run.glob("records/reconstruct/*/*.json"))}
    outputs = [
        p for u, f in newest.items() if u in names for p in json.loads(f.read_text())["outputs"] if p.endswith(HULL)
    ]
    return [read_feature((run / p).read_bytes()) for p in outputs]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("runs", type=Path, nargs="+")
    asked = options.parse_args()
    rows: list[list[str]] = []
    every = []
    for run, truth in zip(asked.runs[::2], asked.runs[1::2], strict=True):
        units, images = units_of(truth), images_of(truth / "catalog", run)
        tree = shapely.STRtree([u.wall_outline for u in units])
        cell = grids_of(str(run / "surface.zarr"))[0].cell
        buildings = sorted(hulls_of(run), key=lambda b: b.id)
        off: tuple[list[FloatArray], list[FloatArray]] = ([], [])
        counts, shares, seconds = np.zeros(3, int), list[tuple[float, float]](), []
        for b in buildings:
            solid, outline = b.solids[Lod.LOD22], b.footprint
            others = shapely.union_all([o.footprint for o in buildings if o is not b])
            near, _, places = places_of(outline, others, units, tree)
            if not near or SURVEY_END in str(b.attributes[REASON_KEY]):
                continue
            begun = time.process_time()
            steps = roof_steps(solid, outline)
            seen = seen_steps(steps, images, cell, SIGNIFICANCE)
            made, moved = moved_to(solid, outline, seen)
            seconds.append(time.process_time() - begun)
            counts += len(steps), len(seen), moved
            for s, known in zip((solid, made), off, strict=True):
                known.append(places_off(s, outline, near))
            shares.append((true_share(solid, places, outline), true_share(made, places, outline)))
        every.append((*(np.concatenate(o) for o in off), counts, np.array(shares), np.array(seconds)))
        rows += _rows(str(run), *every[-1])
    if every:
        before, after, counted, right, took = (list(column) for column in zip(*every, strict=True))
        joined = (np.concatenate(c) for c in (before, after, right, took))
        rows += _rows("all", next(joined), next(joined), np.sum(counted, axis=0), next(joined), next(joined))
    table("Steps of roofs and true steps", HEAD, rows)


def _rows(
    name: str, before: FloatArray, after: FloatArray, counts: FloatArray, shares: FloatArray, seconds: FloatArray
) -> list[list[str]]:
    n = [int(c) for c in counts]
    return [
        told(f"{name}, before", before, [n[0], 0, 0], shares[:, 0], np.empty(0)),
        told(f"{name}, after", after, n, shares[:, 1], seconds),
    ]


if __name__ == "__main__":
    main()

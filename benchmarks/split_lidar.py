"""Rows of houses split from LiDAR alone, their borders known.

    python benchmarks/split_lidar.py [--seeds 1 2 3] [--cases 8] [--pictures FOLDER]

A trace is what the true roofs show along a border: a step, a change of the roof over part of the depth, a valley, a firewall or parapet, a gap.
Cases: pulses per m², or pulses per m² and noise in height in mm as 8:60.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import shapely

from cityflow.core.arrays import ByteArray
from cityflow.core.grid import grown
from cityflow.core.splitting import SplitEvidence, Splitting
from cityflow.evaluation.unit_accuracy import FoundUnits, UnitsAccuracy, UnitsParameters, compare_units
from cityflow.evaluation.unit_borders import Border
from cityflow.splitting.lidar_surface import lidar_raster
from cityflow.splitting.split import SplitParameters, split
from cityflow.synthetic.town_lidar import TownLidarParameters
from lidar_rows import Row, RowTown, ground_under, row_town

DEVELOPED, HELD_OUT = (1, 2, 3), (11, 12, 13)
CASES = ("4", "8", "20", "8:60")
TRACES = ("step", "change", "valley", "firewall", "gap", "none")
AROUND_M, SURFACE_M, REACH_M = 2.0, 0.5, 1.6
JUDGE = UnitsParameters(position_m=0.75)


@dataclass
class Counts:
    """Hits and misses by trace, false lines by the kind of complex, errors of the hits."""

    by_trace: dict[str, list[int]]
    false: dict[str, int]
    position: list[float]
    angle: list[float]
    seconds: list[float]
    lines: int = 0


def town_of(seed: int, case: str, width: float = 240.0) -> RowTown:
    density, _, noise = case.partition(":")
    return row_town(seed, width, TownLidarParameters(density_m2=float(density), sigma_z_m=float(noise or 25) / 1000))


def evidence_of(town: RowTown, row: Row) -> SplitEvidence:
    around = grown(row.outline.bounds, AROUND_M)
    points = town.points.within(around)
    frame = lidar_raster(points.xyz, around, SURFACE_M, REACH_M)
    return SplitEvidence(row.kind, row.outline, (frame,), ground_under(town, row.outline), points)


def judged(row: Row, result: Splitting) -> tuple[UnitsAccuracy, list[Border]]:
    owner = [[k for k, u in enumerate(row.units) if u.distance(line) < 0.01][:2] for line, _ in row.traces]
    borders = [Border(line, (o[0], o[-1]), 0.0, t) for (line, t), o in zip(row.traces, owner, strict=True)]
    found = FoundUnits([row.outline], result.units, [c.line for c in result.cut_lines])
    return compare_units(found, row.units, borders, JUDGE), borders


def count(counts: Counts, row: Row, result: Splitting) -> UnitsAccuracy:
    accuracy, borders = judged(row, result)
    hit = {h.border for h in accuracy.hits}
    for k in sorted(hit | set(accuracy.missed)):
        for trace in borders[k].traces or {"none"}:
            counts.by_trace.setdefault(trace, [0, 0])[0] += k in hit
            counts.by_trace[trace][1] += 1
        traced = "traced" if borders[k].traces else "untraced"
        counts.by_trace.setdefault(traced, [0, 0])[0] += k in hit
        counts.by_trace[traced][1] += 1
    counts.false[row.kind] = counts.false.get(row.kind, 0) + len(accuracy.false_alarms)
    counts.position += [h.position_m for h in accuracy.hits]
    counts.angle += [h.angle_deg for h in accuracy.hits]
    counts.lines += accuracy.lines
    return accuracy


def measure(seeds: Sequence[int], case: str, pictures: Path | None) -> Counts:
    counts = Counts({}, {}, [], [], [])
    for seed in seeds:
        town = town_of(seed, case)
        for number, row in enumerate(town.rows):
            evidence = evidence_of(town, row)
            start = time.process_time()
            result = split(evidence, SplitParameters())
            counts.seconds.append(time.process_time() - start)
            accuracy = count(counts, row, result)
            if pictures is not None and (accuracy.missed or accuracy.false_alarms):
                picture(evidence, row, result, pictures / f"s{seed}_{number:02d}_{row.kind.replace(' ', '_')}.png")
    return counts


def picture(evidence: SplitEvidence, row: Row, result: Splitting, path: Path) -> None:
    """Shaded surface, true borders white, accepted lines red, rejected blue."""
    cell, scale = 0.2, 3
    assert evidence.points is not None
    raster = lidar_raster(evidence.points.xyz, grown(row.outline.bounds, AROUND_M), cell, REACH_M)
    gy, gx = np.gradient(raster.dsm, cell)
    shade = np.clip(140 + 60 * (gx * 0.8 + gy * 0.5), 20, 235)
    grey: ByteArray = np.asarray(np.nan_to_num(shade), np.uint8)
    image = cv2.resize(grey, None, fx=scale, fy=scale)
    image = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)

    def draw(xy: np.ndarray, colour: tuple[int, int, int], width: int) -> None:
        at = (xy - [raster.grid.x_min, raster.grid.y_max]) * [1, -1] * scale / cell
        cv2.polylines(image, [np.round(at).astype(np.int32)], False, colour, width, cv2.LINE_AA)

    draw(shapely.get_coordinates(row.outline.exterior), (255, 255, 255), 1)
    for line, _ in row.traces:
        draw(shapely.get_coordinates(line), (255, 255, 255), 5)
    for cut in result.rejected:
        draw(shapely.get_coordinates(cut.line), (255, 120, 0), 1)
    for cut in result.cut_lines:
        draw(shapely.get_coordinates(cut.line), (0, 255, 255) if cut.kind == "gap" else (0, 0, 255), 2)
    cv2.imwrite(str(path), image)


def report(title: str, c: Counts) -> None:
    def share(name: str) -> str:
        hits, all_ = c.by_trace.get(name, (0, 0))
        return f"{hits:4d}/{all_:<4d}"

    hits, borders = (sum(c.by_trace.get(n, (0, 0))[k] for n in ("traced", "untraced")) for k in (0, 1))
    false = sum(c.false.values())
    print(
        f"{title:<22} traced {share('traced')} all {hits:4d}/{borders:<4d} false {false:3d} of {c.lines:<4d} ({100 * false / max(c.lines, 1):.1f} %)  "
        f"pos {np.median(c.position or [np.nan]):.3f} m  angle {np.median(c.angle or [np.nan]):.2f}°  "
        f"s {np.median(c.seconds):.2f} longest {max(c.seconds):.2f}"
    )
    print(
        "   ",
        "  ".join(f"{t} {share(t)}" for t in TRACES),
        " false:",
        {k: v for k, v in c.false.items() if v},
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[*DEVELOPED, *HELD_OUT])
    parser.add_argument("--cases", nargs="+", default=CASES)
    parser.add_argument("--pictures", type=Path)
    asked = parser.parse_args()
    cv2.setNumThreads(1)
    sets = [
        ("developed", [s for s in asked.seeds if s in DEVELOPED]),
        ("held out", [s for s in asked.seeds if s not in DEVELOPED]),
    ]
    for case in asked.cases:
        for name, seeds in sets:
            if seeds:
                report(f"{case}/m² {name}", measure(seeds, case, asked.pictures))


if __name__ == "__main__":
    main()

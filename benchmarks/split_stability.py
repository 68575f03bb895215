"""Whether splitting depends on accidents of an outline: outlines of runs over synthetic flights, each disturbed within its own uncertainty and split again.

    python benchmarks/split_stability.py RUN SURVEY [RUN SURVEY ...]      # as `split_flights.py` takes them; --draws 4

A draw moves every vertex, adds or cuts small notches, slanting bits and corners of about the cell that outlines are found with. The surfaces stay, so
whatever changes is the method's doing. Printed are borders found and false lines of the outlines as they are and as they are drawn; of the borders found
at all those found in every draw and in more than half; of the lines that any names with 0.3 or more the standard deviation of their probability, and how
many cross one half.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.splitting import CutLine, SplitEvidence, Splitting
from cityflow.evaluation.unit_accuracy import FoundUnits, compare_units
from cityflow.evaluation.unit_borders import Border
from cityflow.splitting.split import SplitParameters, split
from drawn_town import table
from split_flights import evidences_of, truth_of

LEAST_M2 = 150.0
"""Smaller outlines have a border or two: they are left out."""
VERTEX_M = 0.12
"""Standard deviation of a vertex, in x and y."""
EVERY_M = 15.0
"""There is one notch, bump or slanting bit for so much of the border."""
CELL_M = 0.5
SAME_M, SAME_DEG = 1.2, 10.0
"""Lines whose middles are nearer and that are turned by less are the same."""


def disturbed(outline: Polygon, rng: np.random.Generator) -> Polygon:
    """The outline as it might have been found: within its uncertainty the same."""
    rings = [_moved(r, rng) for r in (outline.exterior, *outline.interiors)]
    shape = shapely.make_valid(Polygon(rings[0], rings[1:]))
    bits = [_bit(outline, rng) for _ in range(max(int(outline.length / EVERY_M), 2))]
    for bit, adds in bits:
        shape = shapely.union(shape, bit) if adds else shapely.difference(shape, bit)
    whole = max(shapely.get_parts(shape), key=lambda p: p.area)
    return Polygon(whole.exterior, [r for r in whole.interiors if Polygon(r).area > 4 * CELL_M**2])


def _moved(ring: shapely.LinearRing, rng: np.random.Generator) -> np.ndarray:
    xy = shapely.get_coordinates(ring)[:-1]
    return np.asarray(xy + rng.normal(0.0, VERTEX_M, xy.shape))


def _bit(outline: Polygon, rng: np.random.Generator) -> tuple[Polygon, bool]:
    """A notch or bump, a slanting bit, or a corner, at a place of the border; and whether it is added."""
    ring, kind, adds = outline.exterior, rng.integers(3), bool(rng.random() < 0.5)
    length = float(rng.uniform(1.0, 3.0) if kind == 0 else rng.uniform(2.0, 5.0))
    deep = CELL_M * float(rng.uniform(0.6, 1.4))
    if kind == 2:  # cut or filled across a corner
        corner = int(rng.integers(len(ring.coords) - 1))
        at = ring.project(shapely.Point(ring.coords[corner]))
        ends = [ring.interpolate((at + side * 2 * deep) % ring.length) for side in (-1, 1)]
        return Polygon([ends[0].coords[0], ring.coords[corner], ends[1].coords[0]]).buffer(0.01), adds
    at = float(rng.uniform(0.0, ring.length))
    a, b = (np.array(ring.interpolate((at + d) % ring.length).coords[0]) for d in (0.0, length))
    along = (b - a) / max(float(np.hypot(*(b - a))), 1e-9)
    off = deep * np.array([along[1], -along[0]])  # a convex notch: both sides of the border
    corners = [a - off, b - off, b + off, a + off] if kind == 0 else [a, (a + b) / 2 - off, b, (a + b) / 2 + off]
    return Polygon(corners), adds


@dataclass(frozen=True, slots=True)
class Drawn:
    """Of some outlines, as they are and as they were drawn: `found` (D + 1, B) borders hit; `false` lines (D + 1,); `chance` (L, D + 1) of every line."""

    found: np.ndarray
    false: np.ndarray
    chance: np.ndarray


def drawn(evidences: Sequence[SplitEvidence], units: Sequence[Polygon], borders: Sequence[Border], draws: int) -> Drawn:
    """Split as they are, and `draws` times otherwise."""
    outlines = [e.outline for e in evidences]
    found, false, results = [], [], []
    for draw in range(draws + 1):
        rngs = [np.random.default_rng([draw, k]) for k in range(len(outlines))]
        shapes = [disturbed(o, r) if draw else o for o, r in zip(outlines, rngs, strict=True)]
        splits = [split(replace(e, outline=o), SplitParameters()) for e, o in zip(evidences, shapes, strict=True)]
        a = compare_units(
            FoundUnits(outlines, [u for s in splits for u in s.units], [c.line for s in splits for c in s.cut_lines]),
            units,
            borders,
        )
        hit = np.zeros(len(borders), bool)
        hit[[h.border for h in a.hits]] = True
        found.append(hit)
        false.append(len(a.false_alarms))
        results.append(splits)
    chances = [c for k in range(len(outlines)) for c in chances_of([r[k] for r in results])]
    return Drawn(np.array(found), np.array(false), np.array(chances).reshape(-1, draws + 1))


def chances_of(results: Sequence[Splitting]) -> list[list[float]]:
    """Of every line that any result names its probability in each, 0 where it is not named. Gaps are left out."""
    named = [[c for c in (*r.cut_lines, *r.rejected) if c.kind == "cut"] for r in results]
    kept: list[CutLine] = []
    for c in sorted((c for lines in named for c in lines), key=lambda c: -c.confidence):
        if not any(_same(c.line, k.line) for k in kept):
            kept.append(c)
    return [[max((c.confidence for c in lines if _same(c.line, k.line)), default=0.0) for lines in named] for k in kept]


def _same(a: LineString, b: LineString) -> bool:
    (p, q), (r, s) = (shapely.get_coordinates(x)[[0, -1]] for x in (a, b))
    turn = abs(float(np.degrees(np.arctan2(*(q - p)[::-1]) - np.arctan2(*(s - r)[::-1]))))
    near = min(a.interpolate(0.5, True).distance(b), b.interpolate(0.5, True).distance(a)) < SAME_M
    return bool(near and min(turn % 180, 180 - turn % 180) < SAME_DEG)


def row_of(d: Drawn) -> list[str]:
    """The figures of a table's row."""
    ever, times = d.found.any(axis=0), d.found.sum(axis=0)
    likely = d.chance[d.chance.max(axis=1) >= 0.3]
    crossed = int(((likely >= 0.5).any(axis=1) & (likely < 0.5).any(axis=1)).sum())
    return [
        str(d.found[0].sum()), f"{d.found[1:].sum(axis=1).mean():.1f}", str(d.false[0]), f"{d.false[1:].mean():.1f}",
        f"{(times == len(d.found)).sum()} of {ever.sum()}", str((2 * times > len(d.found)).sum()),
        f"{likely.std(axis=1).mean():.3f}", f"{crossed} of {len(likely)}",
    ]  # fmt: skip


COLUMNS = ["run", "found", "drawn", "false", "drawn", "in all", "in most", "spread", "cross 0.5"]


def joined(parts: Sequence[Drawn]) -> Drawn:
    return Drawn(
        np.concatenate([p.found for p in parts], axis=1),
        np.sum([p.false for p in parts], axis=0),
        np.concatenate([p.chance for p in parts]),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", help="RUN and SURVEY of each flight")
    parser.add_argument("--draws", type=int, default=4)
    asked = parser.parse_args()
    rows, parts = [], []
    for run, survey in zip(asked.folders[::2], asked.folders[1::2], strict=True):
        large = [e for e in evidences_of(run, survey) if e.outline.area >= LEAST_M2]
        parts.append(drawn(large, *truth_of(survey), asked.draws))
        rows.append([str(run), *row_of(parts[-1])])
    table("Borders of disturbed outlines", COLUMNS, [*rows, ["all", *row_of(joined(parts))]])


if __name__ == "__main__":
    main()

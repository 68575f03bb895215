"""Narrow gaps between the houses of synthetic towns as images show them: are the blocks found as two, and is nothing parted that is one?

    python benchmarks/narrow_gaps_images.py --seeds 401 402 [--size 120] [--cache FOLDER]

Surfaces and façades are drawn with the errors of matching (`drawn_town.py`): gaps narrower than 1.3 m are bridged or have holes, and walls in them are
hardly seen. Each seed is built twice: with a gap of 0.8 to 2 m, without trees, after almost every second house of a row, and with none. A gap is parted where
the houses on its sides lie in different outlines. Cut wrongly are true blocks of which two outlines have a tenth and 10 m² each.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import shapely
from shapely import Polygon

from cityflow.evaluation.outlines import compare_outlines, united_by_adjacency
from cityflow.outlines.find_outlines import FindParameters, find_outlines
from cityflow.outlines.from_walls.wall_points import WallPointParameters
from cityflow.synthetic import town_terraces
from cityflow.synthetic.town import Town
from cityflow.synthetic.town_terraces import RowRule
from drawn_town import DrawnTown, drawn_town, table

GAPS, NO_GAPS = 0.45, 0.0
WIDTHS_M = (0.8, 1.0, 1.2, 1.6)
LEAST_SHARE, LEAST_M2 = 0.1, 10.0


def owner_of(polygons: Sequence[Polygon], town: Town) -> list[int]:
    """The outline that has most of each unit; -1 where none has a third of it."""
    tree = shapely.STRtree(list(polygons))
    found = []
    for unit in town.units:
        near = np.sort(tree.query(unit.wall_outline, predicate="intersects"))
        common = [shapely.intersection(unit.wall_outline, polygons[k]).area for k in near]
        found.append(int(near[int(np.argmax(common))]) if common and max(common) > unit.wall_outline.area / 3 else -1)
    return found


def gaps_parted(
    polygons: Sequence[Polygon], town: Town, among: frozenset[int] | None = None
) -> list[tuple[float, bool]]:
    """Width of each open gap, and whether its two units lie in different outlines; `among`: of these units alone."""
    owner = owner_of(polygons, town)
    rows = []
    for gap in town.gaps:
        a, b = gap.between
        if gap.tree or min(owner[a], owner[b]) < 0 or (among is not None and not {a, b} <= among):
            continue
        width = float(shapely.distance(town.units[a].wall_outline, town.units[b].wall_outline))
        rows.append((width, owner[a] != owner[b]))
    return rows


def blocks_cut(polygons: Sequence[Polygon], true: Sequence[Polygon]) -> int:
    """True blocks of which two outlines that do not touch have a part that counts."""
    tree, wrong = shapely.STRtree(list(polygons)), 0
    for block in true:
        near = tree.query(block, predicate="intersects")
        common = [shapely.intersection(block, polygons[k]).area for k in near]
        wrong += sum(c > max(LEAST_SHARE * block.area, LEAST_M2) for c in common) > 1
    return wrong


def judged(made: DrawnTown) -> tuple[list[tuple[float, bool]], int, int, float]:
    """Gaps, true blocks, those that were cut, mean IoU."""
    walls = made.wall_points(WallPointParameters())
    found = united_by_adjacency([o.polygon for o in find_outlines(made.region_surface(walls), FindParameters())])
    true = united_by_adjacency([g for g, _ in made.truth["blocks"]])
    return gaps_parted(found, made.town), len(true), blocks_cut(found, true), compare_outlines(found, true).iou_mean


def drawn_with(chance: float, seed: int, size: int, cache: Path | None) -> DrawnTown:
    """A drawn town in whose rows so many houses are followed by a gap."""
    town_terraces.RowRule = partial(RowRule, gap=chance, tree_in_gap=0.0, twin=0.1, same=0.0)  # type: ignore[misc,assignment]
    made = drawn_town(seed, size, None if cache is None else cache / f"gaps_{chance:g}")
    assert made.town is not None  # made now: another chance makes another town
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[401, 402])
    parser.add_argument("--size", type=int, default=120)
    parser.add_argument("--cache", type=Path)
    asked = parser.parse_args()
    rows, every = [], []
    for seed in asked.seeds:
        gaps, blocks, cut, iou = judged(drawn_with(GAPS, seed, asked.size, asked.cache))
        _, plain, plain_cut, plain_iou = judged(drawn_with(NO_GAPS, seed, asked.size, asked.cache))
        every += gaps
        rows.append(
            [
                f"{seed}",
                *parted(gaps),
                f"{cut} of {blocks}",
                f"{iou:.3f}",
                f"{plain_cut} of {plain}",
                f"{plain_iou:.3f}",
            ]
        )
        print(rows[-1], flush=True)
    rows.append(["all", *parted(every), "", "", "", ""])
    head = [
        "seed",
        *(f"gaps from {w:g} m" for w in WIDTHS_M),
        "blocks cut wrongly",
        "IoU mean",
        "without gaps: cut wrongly",
        "IoU mean",
    ]
    table("Narrow gaps on images", head, rows)


def parted(gaps: Sequence[tuple[float, bool]]) -> list[str]:
    """Parted of all, by width."""
    limits = zip(WIDTHS_M, (*WIDTHS_M[1:], np.inf), strict=True)
    classes = [[apart for width, apart in gaps if low <= width < high] for low, high in limits]
    return [f"{sum(c)} of {len(c)}" for c in classes]


if __name__ == "__main__":
    main()

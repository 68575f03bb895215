"""Narrow gaps between houses of a synthetic town matched from images: are the blocks found as two, and is nothing parted that is one?

    python benchmarks/matched_gaps.py FOLDER --seeds 611 612 [--size 50] [--roofed 0 1] [--gaps 0.6 1.2]

A flight of five cameras over a small area is rendered and run as a user runs it, with outlines found. Houses of rows are followed by gaps of `--gaps` metres,
without trees; `--roofed` is the share of a gap's width that the verges beside it cover: 1 closes it from above. Judged in the area without a rim of 3 m:
a gap is parted where the houses on its sides lie in different outlines, and as wide as these are apart; cut wrongly are true blocks of which two outlines
have a tenth and 10 m² each. `narrow_gaps_images.py` does the same with drawn surfaces. What is there already is not made again. `--look` counts gaps without
making anything.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import shapely
from rich.console import Console
from shapely import Polygon

from cityflow.core.grid import grown
from cityflow.evaluation.outlines import compare_outlines, united_by_adjacency
from cityflow.io.tables.vector import read_layer
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.flight_presets import preset
from cityflow.synthetic.town import Town
from cityflow.synthetic.town_terraces import RowGaps
from cityflow.workflow.synth import make_survey
from drawn_town import table
from narrow_gaps_images import blocks_cut, gaps_parted, owner_of

WORKFLOW = Path(__file__).parents[1] / "workflows" / "demo_flight.yaml"
SETTINGS = ("reconstruct.methods=[extruded]", "texture.when=never", "split.when=never", "export.formats=[cityjson]")
RIM_M, SHARE = 3.0, 0.8


def parameters(seed: int, size: float, gaps: tuple[float, float], roofed: float) -> SynthParameters:
    """Five cameras over a small area, 10 cm GSD, and a town of rows with gaps."""
    flight = preset("five_cameras", gsd_m=0.1, width_px=720, height_px=540, forward_overlap=0.6, side_overlap=0.4)
    town = {
        "row_gaps": RowGaps(share=SHARE, width_m=gaps, roofed_share=roofed),
        "street_tree_share": 0.0,
        "park_share": 0.0,
    }
    return SynthParameters.model_validate({"seed": seed, "size": (size, size), "flight": flight, "town": town})


def run_of(folder: Path, p: SynthParameters, roofed: float, more: list[str]) -> Path:
    """Made and run, unless it is there."""
    survey = folder / f"s{p.seed}_{p.size[0]:g}_{roofed:g}"
    if not (survey / "synth.json").exists():
        make_survey(survey, p, "", 1, Console(stderr=True), next_step=False)
    run = survey / "run"
    if not (run / "products" / "outlines.gpkg").exists():
        settings = [word for s in (*SETTINGS, *more) for word in ("--set", s)]
        command = [sys.executable, "-m", "cityflow", "run", str(WORKFLOW), "--catalog", str(survey / "catalog")]
        subprocess.run([*command, "--out", str(run), "--workers", "1", *settings], check=True)
    return run


def judged(p: SynthParameters, run: Path) -> list[str]:
    """Gaps parted of all by width, blocks cut, mean IoU, widths of parted gaps as found and as they are."""
    town, inside = town_of(p.seed, p.whole_town), shapely.box(*grown(p.area, -RIM_M))
    found = united_by_adjacency(list(read_layer(run / "products" / "outlines.gpkg", "outlines").geometry))
    units = [k for k, u in enumerate(town.units) if inside.contains(u.wall_outline)]
    gaps = gaps_parted(found, town, frozenset(units))
    every = united_by_adjacency([u.wall_outline for u in town.units])
    true = [b for b in every if inside.contains(b)]
    near = [f for f in found if any(f.intersects(b) for b in true)]
    narrow = [apart for width, apart in gaps if width < 1.0]
    wide = [apart for width, apart in gaps if width >= 1.0]
    return [
        f"{sum(narrow)} of {len(narrow)}", f"{sum(wide)} of {len(wide)}", f"{blocks_cut(found, true)} of {len(true)}",
        f"{compare_outlines(near, true).iou_mean:.3f}", ", ".join(f"{a:.2f} / {b:.2f}" for a, b in widths(found, town, frozenset(units))),
    ]  # fmt: skip


def widths(found: Sequence[Polygon], town: Town, among: frozenset[int]) -> list[tuple[float, float]]:
    """Of each gap that is parted: how far the outlines on its sides are apart, and its units."""
    owner, rows = owner_of(found, town), []
    for a, b in (gap.between for gap in town.gaps if not gap.tree and among.issuperset(gap.between)):
        if min(owner[a], owner[b]) >= 0 and owner[a] != owner[b]:
            units = town.units[a].wall_outline, town.units[b].wall_outline
            rows.append((float(shapely.distance(found[owner[a]], found[owner[b]])), float(shapely.distance(*units))))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[611])
    parser.add_argument("--size", type=float, default=50.0)
    parser.add_argument("--gaps", type=float, nargs=2, default=(0.6, 1.2))
    parser.add_argument("--roofed", type=float, nargs="+", default=[0.0, 1.0])
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="parameter of the workflow")
    parser.add_argument("--look", action="store_true")
    asked = parser.parse_args()
    rows = []
    for seed in asked.seeds:
        for roofed in asked.roofed:
            p = parameters(seed, asked.size, tuple(asked.gaps), roofed)
            if asked.look:
                print(seed, _looked_at(p), flush=True)
                continue
            rows.append([f"{seed}", f"{roofed:g}", *judged(p, run_of(asked.folder, p, roofed, asked.set))])
            print(rows[-1], flush=True)
    head = [
        "seed",
        "of a gap roofed",
        "gaps below 1 m parted",
        "from 1 m",
        "blocks cut wrongly",
        "IoU mean",
        "width found / true m",
    ]
    table("Narrow gaps on matched images", head, rows)


def _looked_at(p: SynthParameters) -> str:
    """How many gaps lie inside, without a tree."""
    town, inside = town_of(p.seed, p.whole_town), shapely.box(*grown(p.area, -RIM_M))
    kept = [g for g in town.gaps if not g.tree and all(inside.contains(town.units[k].wall_outline) for k in g.between)]
    flat = sum("flat" in town.units[g.between[0]].shape for g in kept)
    units = sum(inside.contains(u.wall_outline) for u in town.units)
    return f"{len(kept)} gaps, {flat} after flat roofs; {units} units; {len(p.images)} images"


if __name__ == "__main__":
    main()

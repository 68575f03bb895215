"""``cityflow evaluate outlines``: a run's outlines against given ones."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import shapely
from rich.console import Console
from rich.table import Table
from shapely import Polygon

from cityflow.evaluation.outlines import OutlineAccuracy, compare_outlines, united_by_adjacency
from cityflow.evaluation.wall_completeness import edges_of, found_along, length_found, stretches_of
from cityflow.io.tables.outlines_gpkg import Layer, write_geopackage
from cityflow.runs.run_folder import open_run
from cityflow.workflow.printed import print_json
from cityflow.workflow.reference_layers import ReferenceFile, RunLayers, run_layers, within

RESULT = "evaluation_outlines.json"
MAP = "evaluation_outlines.gpkg"
LAYERS = ("blocks", "wall_outlines", "outlines", "units")
WITHIN_CELLS = 3.0
"""A stretch of a true edge is found where an edge of the result is so near, in cells of the surface; set by hand."""

ROWS = (
    ("outlines in the reference", "true", "{:d}"),
    ("outlines found", "found", "{:d}"),
    ("completeness, by number", "completeness", "{:.1%}"),
    ("correctness, by number", "correctness", "{:.1%}"),
    ("completeness, by area", "completeness_area", "{:.1%}"),
    ("correctness, by area", "correctness_area", "{:.1%}"),
    ("IoU, mean over outlines", "iou_mean", "{:.3f}"),
    ("IoU, mean, touching outlines as one", "iou_joined_mean", "{:.3f}"),
    ("IoU of all areas", "iou", "{:.3f}"),
    ("corner deviation, median (m)", "corner_median_m", "{:.2f}"),
    ("corner deviation, mean (m)", "corner_mean_m", "{:.2f}"),
    ("boundary deviation, median (m)", "boundary_m", "{:.2f}"),
    ("edge length found", "length_found", "{:.1%}"),
)


def evaluate_outlines(run_url: str, reference: str, layer: str, console: Console, in_json: bool = False) -> None:
    """Print figures, and keep them as ``evaluation_outlines.json`` in the RUN, with what is missing and extra as GeoPackage.

    Outlines that touch are one on both sides: a survey from above cannot tell more, and how they are split is another question.

    Raises
    ------
    CatalogError, RunError
        The reference cannot be read or stands elsewhere, or the run has no outlines.
    """
    run = open_run(run_url)
    file = ReferenceFile(reference, layer, run.catalog.reference)
    polygons, notes = file.polygons(LAYERS)
    found = run_layers(run)
    true = united_by_adjacency(within(polygons, found.window, file))
    cell_m = run.source().survey.lattice.product_grid.cell
    tree, layers = judged_outlines(found, true, WITHIN_CELLS * cell_m)
    tree |= {"reference": reference, "notes": notes}
    run.store.write_bytes(RESULT, as_json(tree))
    run.store.write_bytes(MAP, write_geopackage(layers, run.catalog.reference))
    if in_json:
        print_json(tree)
        return
    console.print(table("Outlines against the reference", ROWS, tree))
    for note in [
        *notes,
        f"edges count as found within {tree['within_m']:.2f} m",
        f"written: {RESULT}, {MAP} in {run.store.root}",
    ]:
        console.print(f"Note: {note}", markup=False, highlight=False, soft_wrap=True)


def judged_outlines(found: RunLayers, true: list[Polygon], within_m: float) -> tuple[dict[str, Any], list[Layer]]:
    """Figures by name, and layers of what is missing, what is extra, and edges that were not found."""
    blocks = united_by_adjacency(found.outlines)
    accuracy = compare_outlines(blocks, true, window=found.window)
    walls = stretches_of(edges_of(true))
    tree = {**figures(accuracy), "within_m": within_m, "length_found": rounded(length_found(blocks, walls, within_m))}
    missing, extra = [true[k] for k in accuracy.missed], [blocks[k] for k in accuracy.wrong]
    lost = walls.take(~found_along(blocks, walls, within_m))
    ends = np.stack(
        [lost.xy - lost.direction * lost.length[:, None] / 2, lost.xy + lost.direction * lost.length[:, None] / 2], 1
    )
    lines = (
        shapely.get_parts(shapely.line_merge(shapely.multilinestrings(shapely.linestrings(ends)))) if len(ends) else []
    )
    layers = [
        Layer("missing", missing, [{"area_m2": round(p.area, 2)} for p in missing]),
        Layer("extra", extra, [{"area_m2": round(p.area, 2)} for p in extra]),
        Layer("edges_not_found", list(lines), [{"length_m": round(float(g.length), 2)} for g in lines]),
    ]
    return tree, layers


def figures(a: OutlineAccuracy) -> dict[str, Any]:
    """All single figures."""
    names = [key for _, key, _ in ROWS if key != "length_found"]
    return {name: rounded(getattr(a, name)) for name in names} | {"missing": len(a.missed), "extra": len(a.wrong)}


def rounded(value: float | int) -> float | int | None:
    """As JSON takes it: no NaN."""
    if isinstance(value, int):
        return value
    return round(float(value), 5) if np.isfinite(value) else None


def as_json(tree: Mapping[str, Any]) -> bytes:
    return (json.dumps(tree, indent=1, sort_keys=True, ensure_ascii=False) + "\n").encode()


def table(title: str, rows: tuple[tuple[str, str, str], ...], tree: Mapping[str, Any]) -> Table:
    """Names and formatted figures."""
    made = Table(title=title)
    made.add_column("figure")
    made.add_column("value", justify="right")
    for name, key, form in rows:
        made.add_row(name, "–" if tree[key] is None else form.format(tree[key]))
    return made

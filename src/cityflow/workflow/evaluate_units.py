"""``cityflow evaluate units``: how a run split its outlines, against given single units."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from shapely import LineString, Polygon

from cityflow.evaluation.outlines import united_by_adjacency
from cityflow.evaluation.unit_accuracy import FoundUnits, UnitsAccuracy, UnitsParameters, compare_units
from cityflow.evaluation.unit_borders import TRACES, Border, borders_of, with_traces
from cityflow.io.tables.outlines_gpkg import Layer, write_geopackage
from cityflow.runs.run_folder import open_run
from cityflow.workflow.evaluate_outlines import as_json, rounded, table
from cityflow.workflow.printed import print_json
from cityflow.workflow.reference_layers import ReferenceFile, RunLayers, run_layers, within

RESULT = "evaluation_units.json"
MAP = "evaluation_units.gpkg"
LAYERS = ("units", "outlines")
TRACED_LINES = "cut_lines"

ROWS = (
    ("borders in the reference, within one outline", "borders", "{:d}"),
    ("cut lines found", "lines", "{:d}"),
    ("hits", "hits", "{:d}"),
    ("misses", "misses", "{:d}"),
    ("false alarms", "false_alarms", "{:d}"),
    ("sensitivity over all borders", "sensitivity", "{:.1%}"),
    ("sensitivity over those with a trace", "sensitivity_traced", "{:.1%}"),
    ("false alarms of the lines found", "false_share", "{:.1%}"),
    ("position error, median (m)", "position_m", "{:.2f}"),
    ("angle error, median (deg)", "angle_deg", "{:.2f}"),
    ("units in the reference, within the outlines", "units", "{:d}"),
    ("IoU of units, mean", "unit_iou_mean", "{:.3f}"),
    ("units with an IoU over 0.7", "unit_same_share", "{:.1%}"),
)


def evaluate_units(run_url: str, reference: str, layer: str, console: Console, in_json: bool = False) -> None:
    """Print figures, and keep them as ``evaluation_units.json`` in the RUN, with missed borders and false lines as GeoPackage.

    The borders are worked out from the reference's polygons. A layer ``cut_lines`` beside, with columns height, roof, facade and gap, tells which of
    them can be seen at all.

    Raises
    ------
    CatalogError, RunError
        The reference cannot be read or stands elsewhere, or the run has no outlines.
    """
    run = open_run(run_url)
    file = ReferenceFile(reference, layer, run.catalog.reference)
    polygons, notes = file.polygons(LAYERS)
    found = run_layers(run)
    units = within(polygons, found.window, file)
    marked = [(line, frozenset(t for t in TRACES if row.get(t))) for line, row in file.lines(TRACED_LINES)]
    tree, layers = judged_units(found, units, marked)
    notes = [*notes, *found.notes] + ([] if marked else ["the reference does not say which borders can be seen"])
    tree |= {"reference": reference, "notes": notes}
    run.store.write_bytes(RESULT, as_json(tree))
    run.store.write_bytes(MAP, write_geopackage(layers, run.catalog.reference))
    if in_json:
        print_json(tree)
        return
    console.print(table("Single units against the reference", ROWS, tree))
    for trace, of in tree["by_trace"].items() if marked else ():
        console.print(f"  {trace}: {of['hits']} of {of['borders']}", markup=False, highlight=False)
    for note in [*notes, f"written: {RESULT}, {MAP} in {run.store.root}"]:
        console.print(f"Note: {note}", markup=False, highlight=False, soft_wrap=True)


def judged_units(
    found: RunLayers, units: list[Polygon], marked: Sequence[tuple[LineString, frozenset[str]]]
) -> tuple[dict[str, Any], list[Layer]]:
    """Figures by name, and layers of the borders missed, the lines that are none, and the hits."""
    borders = with_traces(borders_of(units), marked)
    blocks = united_by_adjacency(found.outlines)
    result = compare_units(FoundUnits(blocks, found.units, found.lines), units, borders, UnitsParameters())
    wrong, hits = [found.lines[k] for k in result.false_alarms], [found.lines[h.line] for h in result.hits]
    layers = [
        Layer("missed", [borders[k].line for k in result.missed], [_row(borders[k]) for k in result.missed]),
        Layer("false_alarms", wrong, [{"length_m": round(g.length, 2)} for g in wrong]),
        Layer(
            "hits",
            hits,
            [{"position_m": round(h.position_m, 3), "angle_deg": round(h.angle_deg, 2)} for h in result.hits],
        ),
    ]
    tree = figures(result)
    # of a reference that says nothing of traces, all borders would count as traced
    return (tree if marked else {**tree, "sensitivity_traced": None}), layers


def _row(border: Border) -> dict[str, str | float]:
    traces = "unknown" if border.traces is None else " ".join(t for t in TRACES if t in border.traces) or "none"
    return {"traces": traces, "gap_m": round(border.gap_m, 3), "length_m": round(border.line.length, 2)}


def figures(a: UnitsAccuracy) -> dict[str, Any]:
    """All single figures."""
    return {
        "borders": a.all_borders.borders, "lines": a.lines, "hits": len(a.hits), "misses": len(a.missed),
        "false_alarms": len(a.false_alarms), "not_counted": len(a.apart), "lines_not_counted": len(a.void),
        "sensitivity": rounded(a.all_borders.share), "sensitivity_traced": rounded(a.traced.share),
        "false_share": rounded(a.false_share), "position_m": rounded(a.position_m), "angle_deg": rounded(a.angle_deg),
        "units": len(a.unit_iou), "units_missing": a.units_missing, "unit_iou_mean": rounded(a.iou_mean),
        "unit_same_share": rounded(a.same_share),
        "by_trace": {name: {"hits": s.hits, "borders": s.borders} for name, s in a.by_trace.items()},
    }  # fmt: skip

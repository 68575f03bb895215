"""report.json and report.html of a run: one page that opens anywhere, without a network."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

from cityflow.core.building import Status
from cityflow.core.json_values import PLAIN, finite
from cityflow.viewer.environment import rendered, template_text
from cityflow.viewer.histogram import Histogram, histogram
from cityflow.viewer.image_rows import ImageFigures, TileRow
from cityflow.viewer.orientation_page import how_exact
from cityflow.viewer.report_in_short import in_short, verdict
from cityflow.viewer.report_parameters import ReportParameters
from cityflow.viewer.report_rows import ReportData, UnitRow
from cityflow.viewer.run_figures import figures_of, figures_text, report_figures
from cityflow.viewer.survey_in_short import shortfall
from cityflow.viewer.unit_figures import UnitFigures, measured
from cityflow.viewer.unit_map import draw_map

__all__ = ["listed_units", "verdict", "write_report"]

USUAL = ReportParameters()
LEAST_LISTED = 3
BUILDINGS = "buildings"


def write_report(data: ReportData, parameters: ReportParameters = USUAL) -> tuple[bytes, bytes]:
    """Bytes of report.json and of report.html; the same data give the same bytes."""
    figures = report_figures(data)
    return figures_text(figures).encode(), _page(data, figures, parameters).encode()


def _page(data: ReportData, figures: dict[str, Any], parameters: ReportParameters) -> str:
    listed = parameters.listed
    units = sorted(data.units, key=lambda u: u.id)
    unit_map = draw_map(units, {} if data.whole else data.waiting, data.relief.bounds if data.relief else None)
    return rendered(
        "report.html.j2",
        data=data,
        figures=figures,
        summary=figures["summary"],
        verdict=verdict(figures["summary"]) + shortfall(figures["images"]),
        short=in_short(figures, data.run, data.unit_stage),
        most_looks=parameters.looks,
        unfinished=figures["summary"]["unfinished"],
        run=shlex.quote(data.run),
        has_workflow=any("WORKFLOW" in p["command"] for p in figures["problems"]),
        unit_map=unit_map,
        units=units,
        histograms=_histograms(figures_of(data)),
        orientation_exact=how_exact(data.orientation) if data.orientation else "",
        image_histograms=_image_histograms(data.images) if data.images else [],
        worst_tiles=_most_gaps(data.images, listed) if data.images else [],
        row_of={u.id: i for i, u in enumerate(units)},
        off_map=_off_map(units, {s.row for s in unit_map.shapes}),
        worst=_highest(units, "nmad", listed),
        slowest=_highest(units, "seconds", listed),
        payload=Markup(_script_json(_payload(units, data))),
        style=template_text("report.css"),
        script=template_text("report.js"),
    )


def listed_units(units: Sequence[UnitRow], listed: int = USUAL.listed) -> list[UnitRow]:
    """The buildings that the page lists by themselves: the worst, then the slowest, each once."""
    ordered = sorted(units, key=lambda u: u.id)
    return list({u.id: u for name in ("nmad", "seconds") for _, u in _highest(ordered, name, listed)}.values())


def _off_map(units: Sequence[UnitRow], drawn: set[int]) -> list[UnitRow]:
    """Units that the map does not show, the refused first."""
    missing = [u for i, u in enumerate(units) if i not in drawn]
    return sorted(missing, key=lambda u: (u.status is not Status.REFUSED, u.id))


def _highest(units: Sequence[UnitRow], name: str, listed: int) -> list[tuple[int, UnitRow]]:
    """Positions and units with the highest values, the highest first: of few units a third, so that not all of them are among the worst."""
    known = [(i, u) for i, u in enumerate(units) if measured([u], name)]
    most = min(listed, max(LEAST_LISTED, len(known) // 3))
    return sorted(known, key=lambda entry: (-getattr(entry[1], name), entry[1].id))[:most]


def _histograms(found: UnitFigures) -> list[Histogram]:
    nmad = [100 * v for v in found.values["nmad"]]
    planes = [v for v in found.values["planes"] if v > 0]
    return [
        histogram("Scatter of points about roofs", "NMAD of a building (cm)", nmad, counted=BUILDINGS, unit="cm"),
        histogram("How detailed the roofs are", "roof planes of a building", planes, counted=BUILDINGS, whole=True),
        histogram("Time per building", "seconds", found.seconds, counted=BUILDINGS, unit="s"),
    ]


def _image_histograms(images: ImageFigures) -> list[Histogram]:
    """Of what has been measured; a chart of nothing would only take place."""
    gaps = [100 * (1 - t.completeness) for t in images.tiles if t.completeness is not None]
    sigma = [100 * t.sigma for t in images.tiles if t.sigma is not None]
    charts = [
        (
            "Vertical parallax of pairs",
            "row offset before correction (pixels)",
            list(images.parallaxes_px),
            "pairs",
            "px",
        ),
        ("Gaps in the surface", "share of a tile without height (%)", gaps, "tiles", "%"),
        ("Expected precision", "median of a tile (cm)", sigma, "tiles", "cm"),
    ]
    return [histogram(t, axis, values, counted=of, unit=unit) for t, axis, values, of, unit in charts if values]


def _most_gaps(images: ImageFigures, listed: int) -> list[TileRow]:
    known = [t for t in images.tiles if t.completeness is not None]
    return sorted(known, key=lambda t: (t.completeness or 0.0, t.tile))[:listed]


PAYLOAD_FIELDS = (
    "id", "tile", "verdict", "verdict_reason", "good_probability",
    "status", "reason", "method", "lod", "planes", "nmad", "rmse", "bias", "le95", "share_explained",
    "seconds", "peak_mb",
)  # fmt: skip


def _payload(units: Sequence[UnitRow], data: ReportData) -> dict[str, Any]:
    """What the page's script needs: rows without repeated keys, figures to four digits."""
    rows = [[_short(getattr(u, name)) for name in PAYLOAD_FIELDS] for u in units]
    keys = sorted({key for u in units for key in u.attributes})
    extra = [[_short(u.attributes.get(key)) for key in keys] for u in units] if keys else []
    overrides = {u.id: data.overrides[u.id] for u in units if u.id in data.overrides}
    pages = {u.id: data.pages[u.id] for u in units if u.id in data.pages}
    return {
        "fields": PAYLOAD_FIELDS, "rows": rows, "keys": keys, "extra": extra, "overrides": finite(overrides), "pages": pages,
    }  # fmt: skip


def _short(value: Any) -> Any:
    """Four digits, or what JSON can say of it."""
    if type(value) in PLAIN:
        return value
    value = finite(value)
    return float(f"{value:.4g}") if type(value) is float and abs(value) < 1e4 else value


def _script_json(value: Any) -> str:
    """JSON that can stand inside a script element: nothing in it can end the element or begin a comment."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text

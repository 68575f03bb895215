"""Figures of a run for report.json and the page."""

from __future__ import annotations

import json
import math
import re
import shlex
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cityflow.core.building import Status
from cityflow.core.json_values import finite
from cityflow.core.verdicts import Verdict
from cityflow.viewer.image_rows import ImageFigures
from cityflow.viewer.report_rows import ProblemRow, ReportData, UnitRow
from cityflow.viewer.review_list import review_list
from cityflow.viewer.roof_figures import roof_figures
from cityflow.viewer.unit_figures import UnitFigures, quantile
from cityflow.viewer.window_figures import window_figures

EXPORT = "export"
"""The stage that comes last."""

MOST_UNITS_IN_A_COMMAND = 20
"""A longer command would not be typed or pasted; the one for all failed units takes its place."""

UNIT_MEASURES = ("nmad", "rmse", "bias", "le95", "share_explained")


def report_figures(data: ReportData) -> dict[str, Any]:
    """Everything that report.json says; units are sorted by id, and what is not finite becomes None."""
    units = sorted(data.units, key=lambda u: u.id)
    found = figures_of(data)
    figures = {
        "title": data.title,
        "workflow": data.workflow,
        "reference": {"crs": data.crs, "vertical_datum": data.vertical_datum},
        "summary": {**summary(found), **_progress(data)},
        "districts": [asdict(d) for d in data.districts],
        "stages": [asdict(s) for s in data.stages],
        "problems": problem_groups(data),
        "unused_edits": [asdict(e) for e in data.unused_edits],
        "images": image_summary(data.images) if data.images else None,
        "orientation": asdict(data.orientation) if data.orientation else None,
        "poses": asdict(data.poses) if data.poses else None,
        "checkpoints": [asdict(c) for c in data.checkpoints],
        "pictures": [p.title for p in data.pictures],
        "review_list": [
            {"id": s.unit.id, "verdict": s.unit.verdict or Verdict.POOR.value, "reason": s.reason}
            for s in review_list(units)
        ],
        "roofs": roof_figures(found),
        "textures": asdict(data.textures) if data.textures else None,
        "windows": window_figures(found),
        "placing": dict(data.placing),
        "pages": dict(sorted(data.pages.items())),
        "units": [_unit(u) for u in units],
        "products": [asdict(p) for p in data.products],
        "sources": [asdict(s) for s in data.sources],
        "versions": dict(sorted(data.versions.items())),
        "parameters": data.parameters,
        "changed_parameters": [{"key": k, "value": v, "default": d} for k, v, d in data.changed],
        "overrides": {unit: dict(values) for unit, values in sorted(data.overrides.items())},
    }
    cleaned: dict[str, Any] = finite(figures)
    return cleaned


def figures_of(data: ReportData) -> UnitFigures:
    """Of all buildings, though the data have a row for some of them only."""
    return UnitFigures.of(data.units) if data.whole is None else data.whole


def summary(found: UnitFigures) -> dict[str, Any]:
    """Counts by status, level of detail and method; medians over the units that have the figure."""
    values = found.values
    return {
        "units": found.units,
        **{s.value: found.status[s.value] for s in Status},
        "verdicts": found.verdicts,
        "good_expected": round(math.fsum(values["good_probability"])),
        "by_lod": dict(sorted(found.texts["lod"].items())),
        "by_method": dict(sorted(found.texts["method"].items())),
        "planes": round(sum(values["planes"])),
        "nmad_median": quantile(values["nmad"], 0.5),
        "nmad_95": quantile(values["nmad"], 0.95),
        "rmse_median": quantile(values["rmse"], 0.5),
        "bias_median": quantile(values["bias"], 0.5),
        "share_explained_median": quantile(values["share_explained"], 0.5),
        "seconds_total": math.fsum(found.seconds),
        "seconds_median": quantile(found.seconds, 0.5),
        "seconds_max": max(found.seconds, default=None),
        "peak_mb": found.peak_mb,
    }


def _progress(data: ReportData) -> dict[str, Any]:
    """How far the run is: buildings that wait, tasks done, whether anything has been exported, and whether something is still to be done."""
    exported = any(s.stage == EXPORT for s in data.stages)
    begun = bool(data.stages or data.units)
    return {
        "waiting": len(data.waiting),
        "tasks": sum(s.done + s.degraded for s in data.stages),
        "exported": exported,
        "unfinished": bool(data.waiting) or not begun or (bool(data.stages) and not exported),
    }


def image_summary(images: ImageFigures) -> dict[str, Any]:
    """What report.json says of images; medians over the tiles and the pairs that have the figure."""
    sigmas = [t.sigma for t in images.tiles if t.sigma is not None]
    pairs, refused = sum(d.pairs for d in images.directions), sum(d.refused for d in images.directions)
    return {
        "images": images.images,
        "left_out": list(images.left_out),
        "unused": images.unused,
        "pairs": pairs,
        "pairs_refused": refused,
        "parallax_px_median": quantile(images.parallaxes_px, 0.5),
        "asked_m2": images.asked_m2,
        "shown_share": images.shown_share,
        "surveyed_m2": sum(t.surveyed_m2 for t in images.tiles),
        "completeness_mean": _mean_over_ground(images, "completeness"),
        "ortho_seen_mean": _mean_over_ground(images, "seen"),
        "sigma_median": quantile(sigmas, 0.5),
        "match_seconds": images.match_seconds,
        "sgm_seconds": images.sgm_seconds,
        "directions": [asdict(d) for d in images.directions],
        "refused_pairs": [asdict(r) for r in images.refused],
        "tiles": [asdict(t) for t in images.tiles],
    }


def _mean_over_ground(images: ImageFigures, name: str) -> float | None:
    """Of a share of the tiles, each by its surveyed ground; where that is not known yet, all alike."""
    known = [(v, t.surveyed_m2) for t in images.tiles if (v := getattr(t, name)) is not None]
    ground = sum(area for _, area in known)
    if not ground:
        return float(np.mean([v for v, _ in known])) if known else None
    return float(sum(v * area for v, area in known) / ground)


def problem_groups(data: ReportData) -> list[dict[str, Any]]:
    """What did not end as asked, by stage, status and kind of reason, the most frequent first.

    Reasons that differ in figures and numbered names only are one kind; the first one by id stands for it.
    """
    units = data.units if data.whole is None else ()
    rows = [ProblemRow(data.unit_stage, u.id, u.status, u.reason) for u in units if u.status is not Status.DONE]
    groups: dict[tuple[str, Status, str], list[ProblemRow]] = {}
    for row in sorted((*rows, *data.problems), key=lambda p: (p.stage, p.unit)):
        groups.setdefault((row.stage, row.status, kind_of_reason(row.reason)), []).append(row)
    severity = [Status.FAILED, Status.REFUSED, Status.DEGRADED, Status.DONE]
    order = sorted(groups.items(), key=lambda g: (severity.index(g[0][1]), -len(g[1]), g[0][0], g[0][2]))
    return [_group(rows, data) for _, rows in order]


def kind_of_reason(reason: str) -> str:
    """A reason without its figures and numbered names, and of several every kind once.

    >>> kind_of_reason("img_07.jpg: only 3.5% could be matched; img_08.jpg: only 1.2% could be matched")
    'only # could be matched'
    >>> kind_of_reason("without the depths of 34_54.a, 34_54.b") == kind_of_reason("without the depths of 34_55.a")
    True
    """
    parts = (re.sub(r"^\S+: ", "", part) for part in reason.split("; "))
    marked = (re.sub(r"\S*\d\S*", "#", part) for part in parts)
    return "; ".join(sorted({re.sub(r"#(?: #)+", "#", part) for part in marked}))


def _group(rows: Sequence[ProblemRow], data: ReportData) -> dict[str, Any]:
    first = rows[0]
    return {
        "stage": first.stage,
        "status": first.status.value,
        "reason": first.reason or "no reason given",
        "count": len(rows),
        "units": [r.unit for r in rows],
        "pages": [r.unit for r in rows if r.unit in data.pages] if first.stage == data.unit_stage else [],
        "command": rerun_command(first.stage, [r.unit for r in rows], data.unit_stage, first.status, data.run),
        "explain": explain_command(first.unit, data.run),
    }


def explain_command(unit: str, run: str = "RUN") -> str:
    """The command that tells all of a unit; names that look like options are told apart from them.

    >>> explain_command("12_7"), explain_command("-3_4", "my run")
    ('cityflow explain RUN 12_7', "cityflow explain 'my run' -- -3_4")
    """
    return f"cityflow explain {shlex.quote(run)} {'-- ' if unit.startswith('-') else ''}{shlex.quote(unit)}"


def rerun_command(stage: str, units: Sequence[str], unit_stage: str, status: Status, run: str = "RUN") -> str:
    """The command that runs these units of a run's folder, and what depends on them, again.

    Refused units are left to a new run of the workflow: once their outlines are mended their tasks are stale by themselves.
    """
    here = shlex.quote(run)
    if status is Status.REFUSED:
        return f"cityflow run WORKFLOW --out {here}"
    if len(units) > MOST_UNITS_IN_A_COMMAND:
        return f"cityflow rerun {here} {'--degraded' if status is Status.DEGRADED else '--failed'}"
    chosen = " ".join(f"--unit {shlex.quote(u)}" for u in units)
    return f"cityflow rerun {here} {'' if stage == unit_stage else f'--stage {shlex.quote(stage)} '}{chosen}"


def _unit(unit: UnitRow) -> dict[str, Any]:
    names = (
        "id", "tile", "verdict", "verdict_reason", "good_probability", "reason", "method", "lod", "planes", *UNIT_MEASURES,
        "seconds", "peak_mb",
    )  # fmt: skip
    row = {name: getattr(unit, name) for name in names}
    return {**row, "status": unit.status.value, "attributes": dict(unit.attributes)}


def figures_text(figures: dict[str, Any]) -> str:
    """JSON with a line for every key and every building: read by people with patience, and written fast."""
    return (
        "{\n"
        + ",\n".join(f"{_json(k)}: {_lines(v) if k == 'units' else _json(v)}" for k, v in figures.items())
        + "\n}\n"
    )


def _lines(rows: Sequence[Any]) -> str:
    return "[\n" + ",\n".join(map(_json, rows)) + "\n]" if rows else "[]"


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)

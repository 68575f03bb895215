"""Data of buildings for the page: an index of all of them, and a file for each ground tile."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import asdict
from typing import Any
from urllib.parse import quote

import numpy as np

from cityflow.core.building import Status
from cityflow.core.json_values import finite
from cityflow.flow.task import Record
from cityflow.reporting.score_parts import ScoreParts, score_parts
from cityflow.reporting.unit_pages import page_path
from cityflow.reporting.view_frame import PageFrame
from cityflow.runs.current import CurrentRecords
from cityflow.stages import reconstruct, texture
from cityflow.viewer.report_rows import UnitRow

Json = Any
FIELDS = ("id", "tile", "status", "verdict", "nmad", "rmse", "place", "size")
NO_TILE = "_"
"""Stands for the tile of what belongs to none: refused outlines."""
SCORE_DIGITS = 5
SCALE_SHARE, LEAST_SCALE_M = 95, 0.05
"""The colours of quality end at this percentile of all buildings, and never below this."""


def index_table(units: Sequence[UnitRow], frame: PageFrame, heights: Mapping[str, tuple[float, float]]) -> Json:
    """Every building that is a polygon: where it is, how it ended, how well it fits; `heights` of floor and ridge by unit."""
    rows = [
        [u.id, u.tile or NO_TILE, str(u.status), u.verdict, _short(u.nmad), _short(u.rmse), *_place(u, frame, heights)]
        for u in units if u.rings
    ]  # fmt: skip
    return finite({"fields": FIELDS, "rows": rows})


def _place(unit: UnitRow, frame: PageFrame, heights: Mapping[str, tuple[float, float]]) -> tuple[list[float], float]:
    """Middle of a building in the page's frame, and how large it is."""
    low, high = heights[unit.id]
    ring = unit.rings[0]
    middle = (ring.min(axis=0) + ring.max(axis=0)) / 2
    size = float(np.hypot(*(ring.max(axis=0) - ring.min(axis=0))))
    return [round(v, 2) for v in frame.plan(middle, (low + high) / 2)[0].tolist()], round(size, 1)


def heights_of(units: Sequence[UnitRow], ground: float) -> dict[str, tuple[float, float]]:
    """Floor and ridge of every unit, world metres; `ground` and a storey above it where nothing is known."""
    found = {}
    for unit in units:
        low, high = (unit.attributes.get(key) for key in ("ground_height_m", "ridge_height_m"))
        floor = float(low) if isinstance(low, int | float) else ground
        found[unit.id] = floor, float(high) if isinstance(high, int | float) else floor + 3.0
    return found


def scale_of(units: Sequence[UnitRow], name: str) -> float:
    """Where the colours of a measure of quality end, metres."""
    known = [v for u in units if (v := getattr(u, name)) is not None and np.isfinite(v)]
    return round(max(float(np.percentile(known, SCALE_SHARE)), LEAST_SCALE_M), 3) if known else LEAST_SCALE_M


def unit_files(
    units: Sequence[UnitRow], records: CurrentRecords, atlas_cells: Mapping[str, str], pages: Set[str] = frozenset()
) -> Iterator[tuple[str, Json]]:
    """Ground tile → what is known of its units by their ids; `leaves` of the atlas by unit, `pages` are those that the report has."""
    good = (Status.DONE, Status.DEGRADED)
    textured = {r.unit: dict(r.result) for r in records.of(texture.NAME) if r.status in good}
    rows = {unit.id: unit for unit in units}
    by_tile: dict[str, dict[str, Json]] = defaultdict(dict)
    for record in records.of(reconstruct.NAME):
        if (unit := rows.get(record.unit)) is None:
            continue
        entry = _known(unit, record, textured.get(unit.id))
        if unit.id in atlas_cells:
            entry["leaf"] = atlas_cells[unit.id]
        if page_path(unit.id) in pages:
            entry["page"] = quote(page_path(unit.id))
        by_tile[unit.tile or NO_TILE][unit.id] = entry
    for tile, known in sorted(by_tile.items()):
        yield tile, finite(known)


def _known(unit: UnitRow, record: Record, textured: Json) -> dict[str, Json]:
    entry: dict[str, Json] = {
        "reason": unit.reason, "verdict_reason": unit.verdict_reason, "good_probability": _short(unit.good_probability),
        "method": unit.method, "lod": unit.lod, "planes": unit.planes, "seconds": round(unit.seconds, 3),
        "share_explained": _short(unit.share_explained), "kept": record.result.get("kept"), "scores": _scores(record),
        "attributes": {k: v for k, v in unit.attributes.items() if not isinstance(v, dict | list)},
    }  # fmt: skip
    if textured is not None:
        entry["texture"] = textured
    return entry


def _scores(record: Record) -> list[dict[str, Json]]:
    scores = record.result.get("scores")
    if not isinstance(scores, list) or not scores:
        return []
    return [{**{k: _short(v) for k, v in s.items()}, "parts": _parts(score_parts(s))} for s in scores]


def _parts(part: ScoreParts | None) -> dict[str, Json] | None:
    return None if part is None else {name: _short(value) for name, value in asdict(part).items()}


def _short(value: Any) -> Any:
    return round(value, SCORE_DIGITS) if isinstance(value, float) else value

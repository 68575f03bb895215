"""Data of buildings for the page: of each ground tile a table and all that is known, and an index over the tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
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
IDS_AT_ONCE = 4096
"""Ids in a part of the sorted table of all: a page that looks for one reads one part."""
DIRECTIONS = np.linspace(0.0, 2 * np.pi, 32, endpoint=False)
_WAYS = np.column_stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)])
_REACH = 0.45
"""Of the size of a building, from its middle to its ends."""
SCORE_DIGITS = 5
SCALE_SHARE, LEAST_SCALE_M = 95, 0.05
"""The colours of quality end at this percentile of all buildings, and never below this."""


def table_of(units: Sequence[UnitRow], tile: str, frame: PageFrame, heights: Mapping[str, tuple[float, float]]) -> Json:
    """Every building of a tile that is a polygon: where it is, how it ended, how well it fits; `heights` of floor and ridge by unit."""
    rows = [
        [u.id, tile, str(u.status), u.verdict, _short(u.nmad), _short(u.rmse), *_place(u, frame, heights)]
        for u in units if u.rings
    ]  # fmt: skip
    return finite({"fields": FIELDS, "rows": rows})


def id_key(unit: str) -> bytes:
    """Ids are sorted by this, as a browser compares texts in lower case."""
    return unit.lower().encode("utf-16-be", "surrogatepass")


def id_parts(tiles: Mapping[str, Iterable[str]]) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """The sorted table of all buildings, in parts: the first id of a part in lower case, and (id, tile) of each; `tiles`: tile → its buildings."""
    rows = sorted(((u, t) for t, found in tiles.items() for u in found), key=lambda row: (id_key(row[0]), row))
    for start in range(0, len(rows), IDS_AT_ONCE):
        part = rows[start : start + IDS_AT_ONCE]
        yield part[0][0].lower(), part


def ends_of(rows: Sequence[Sequence[Json]]) -> list[list[float]]:
    """Places that the rows of a table end at, in all directions of the compass, in the page's frame; of each direction the farthest."""
    if not rows:
        return []
    places, sizes = np.array([row[-2] for row in rows], np.float64), np.array([row[-1] for row in rows], np.float64)
    best = np.argmax(places[:, :2] @ _WAYS.T + _REACH * sizes[:, None], axis=0)
    found = places[best]
    found[:, :2] += _REACH * sizes[best, None] * _WAYS
    return np.round(found, 2).tolist()


def farthest(ends: Sequence[Sequence[Sequence[float]]]) -> list[list[float]]:
    """Of the `ends_of` several tables those of the whole."""
    known = np.array([e for e in ends if e], np.float64)
    if not len(known):
        return []
    best = np.argmax((known[..., :2] * _WAYS).sum(axis=-1), axis=0)
    return known[best, np.arange(len(_WAYS))].tolist()


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


def scale_of(values: Sequence[float]) -> float:
    """Where the colours of a measure of quality end, metres."""
    return round(max(float(np.percentile(values, SCALE_SHARE)), LEAST_SCALE_M), 3) if len(values) else LEAST_SCALE_M


def known_units(
    units: Sequence[UnitRow], records: CurrentRecords, atlas_cells: Mapping[str, str], pages: Set[str] = frozenset()
) -> Json:
    """All that is known of the units of a tile, by id; `atlas_cells` by unit, `pages` are those that the report has."""
    good = (Status.DONE, Status.DEGRADED)
    rows = {unit.id: unit for unit in units}
    textured = {r.unit: dict(r.result) for r in records.some(texture.NAME, rows) if r.status in good}
    found = {}
    for record in records.some(reconstruct.NAME, rows):
        entry = _known(rows[record.unit], record, textured.get(record.unit))
        if record.unit in atlas_cells:
            entry["atlas_cell"] = atlas_cells[record.unit]
        if page_path(record.unit) in pages:
            entry["page"] = quote(page_path(record.unit))
        found[record.unit] = entry
    return finite(found)


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

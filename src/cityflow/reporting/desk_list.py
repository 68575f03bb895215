"""The review list of the desk: a row for each building, by what a look at it is worth; read from the files of the view."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cityflow.flow.store import Store
from cityflow.flow.task import digest_of
from cityflow.reporting.view_tiles import TABLES, UNITS
from cityflow.viewer.review_list import DOUBTFUL_BORDER, NO_REASON, SUSPECTED, suspicion_of, worth_of

Json = Any

FIELDS = (
    "id",
    "tile",
    "status",
    "verdict",
    "probability",
    "nmad",
    "rmse",
    "method",
    "border",
    "suspicion",
    "reason",
    "model",
)
NEAR_M = 1.0
"""How far beyond a building the middle of its border may be."""
_OF_A_PASS = ("seconds", "page")
"""What differs from one run to the next though the model is the same."""


@dataclass(slots=True)
class DeskList:
    """Rows of all buildings; files of tiles are read again where they have changed."""

    store: Store
    _read: dict[str, tuple[tuple[str, str], list[dict[str, Json]]]] = field(default_factory=dict)

    def rows(self) -> list[dict[str, Json]]:
        """A row for each building, keys as `FIELDS`, sorted by worth; `model`: a digest of all that is known of it."""
        tables, units = dict(self.store.stamps(TABLES)), dict(self.store.stamps(UNITS))
        found = dict[str, tuple[tuple[str, str], list[dict[str, Json]]]]()
        for path, stamp in sorted(tables.items()):
            name = path.rsplit("/", 1)[-1]
            both = stamp, units.get(f"{UNITS}/{name}", "")
            kept = self._read.get(path)
            found[path] = kept if kept is not None and kept[0] == both else (both, self._tile(path, f"{UNITS}/{name}"))
        self._read = found
        rows = [row for _, of_tile in found.values() for row in of_tile]
        return sorted(rows, key=_worth)

    def row(self, unit: str) -> dict[str, Json] | None:
        """That of a building; None where there is none."""
        return next((row for row in self.rows() if row["id"] == unit), None)

    def _tile(self, table: str, units: str) -> list[dict[str, Json]]:
        known = self._json(units)
        read = self._json(table)
        borders = _Borders.of(_objects(read.get("cuts", {})))
        return [_row(unit, known, borders) for unit in _objects(read)]

    def _json(self, path: str) -> dict[str, Json]:
        try:
            found = json.loads(self.store.read_bytes(path))
        except (OSError, ValueError):
            return {}  # it is being written, or is no more
        return found if isinstance(found, dict) else {}


def _objects(table: Mapping[str, Json]) -> list[dict[str, Json]]:
    return [dict(zip(table["fields"], row, strict=True)) for row in table.get("rows", [])]


@dataclass(frozen=True, slots=True)
class _Borders:
    """Cut lines of a tile, taken or not, by the outline that they cross: middle in the page's frame, and the probability that the choice is wrong."""

    of_outline: Mapping[str, Sequence[tuple[float, float, float]]]

    @classmethod
    def of(cls, lines: Sequence[Mapping[str, Json]]) -> _Borders:
        found = defaultdict[str, list[tuple[float, float, float]]](list)
        for line in lines:
            if line["confidence"] is None:
                continue
            (x0, y0, _), (x1, y1, _) = line["from"], line["to"]
            wrong = 1 - line["confidence"] if line["accepted"] else line["confidence"]
            found[line["outline"]].append(((x0 + x1) / 2, (y0 + y1) / 2, wrong))
        return cls(found)

    def doubt(self, unit: Mapping[str, Json]) -> float:
        """The highest such probability at a building; 0 where it has no border."""
        x, y, _ = unit["place"]
        parts = unit["id"].split(".")
        # the id of a part is that of its outline and its own, joined by a dot; either may have dots
        names = {".".join(parts[:k]) for k in range(1, len(parts) + 1)}
        reach = unit["size"] / 2 + NEAR_M
        near = (w for name in names for px, py, w in self.of_outline.get(name, ()) if np.hypot(px - x, py - y) <= reach)
        return round(max(near, default=0.0), 3)


def _row(unit: Mapping[str, Json], known: Mapping[str, Mapping[str, Json]], borders: _Borders) -> dict[str, Json]:
    more = known.get(unit["id"], {})
    digest = digest_of({k: v for k, v in more.items() if k not in _OF_A_PASS}) if more else ""
    # why it is simpler than asked comes first: an edit that could not be carried out is among that
    reasons = dict.fromkeys((more.get("reason"), more.get("verdict_reason")))
    border, reason = borders.doubt(unit), "; ".join(r for r in reasons if r)
    if border >= DOUBTFUL_BORDER:
        reason = "; ".join(
            r for r in (reason, f"a border is wrong, or lacking, with a probability of {border:.0%}") if r
        )
    suspicion = suspicion_of(more.get("attributes", {}))
    if suspicion >= SUSPECTED:
        reason = "; ".join(
            r for r in (f"perhaps no building: points lie on {1 - suspicion:.0%} of its roof", reason) if r
        )
    values = (
        unit["id"], unit["tile"], unit["status"], unit["verdict"], more.get("good_probability"), unit["nmad"], unit["rmse"],
        more.get("method") or "", border, suspicion, reason, digest[:16],
    )  # fmt: skip
    row = dict(zip(FIELDS, values, strict=True))
    if not row["reason"] and row["verdict"] != "good":
        row["reason"] = NO_REASON
    return row


def _worth(row: Mapping[str, Json]) -> tuple[Any, ...]:
    return (
        *worth_of(row["status"], row["verdict"], row["probability"], row["rmse"], row["border"], row["suspicion"]),
        row["id"],
    )

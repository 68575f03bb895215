"""The review list of the desk: a row for each building, by what a look at it is worth; read from the files of the view."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from cityflow.flow.store import Store
from cityflow.flow.task import digest_of
from cityflow.reporting.view_tiles import TABLES, UNITS
from cityflow.viewer.review_list import NO_REASON, worth_of

Json = Any

FIELDS = ("id", "tile", "status", "verdict", "probability", "nmad", "rmse", "method", "reason", "model")
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
        fields = read.get("fields", [])
        return [_row(dict(zip(fields, row, strict=True)), known) for row in read.get("rows", [])]

    def _json(self, path: str) -> dict[str, Json]:
        try:
            found = json.loads(self.store.read_bytes(path))
        except (OSError, ValueError):
            return {}  # it is being written, or is no more
        return found if isinstance(found, dict) else {}


def _row(unit: Mapping[str, Json], known: Mapping[str, Mapping[str, Json]]) -> dict[str, Json]:
    more = known.get(unit["id"], {})
    digest = digest_of({k: v for k, v in more.items() if k not in _OF_A_PASS}) if more else ""
    values = (
        unit["id"], unit["tile"], unit["status"], unit["verdict"], more.get("good_probability"), unit["nmad"], unit["rmse"],
        more.get("method") or "", more.get("verdict_reason") or more.get("reason") or "", digest[:16],
    )  # fmt: skip
    row = dict(zip(FIELDS, values, strict=True))
    if not row["reason"] and row["verdict"] != "good":
        row["reason"] = NO_REASON
    return row


def _worth(row: Mapping[str, Json]) -> tuple[Any, ...]:
    return (*worth_of(row["status"], row["verdict"], row["probability"], row["rmse"]), row["id"])

"""Rows that an export leaves of every unit of its tile, for the report and the map."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from cityflow.flow.store import Store

ROWS = "units.json"


def encode_rows(rows: Mapping[str, Any]) -> bytes:
    """Unit → status, reason, attributes, as JSON."""
    return json.dumps(rows, ensure_ascii=False, sort_keys=True).encode()


def read_rows(store: Store, outputs: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Unit → status, reason, and attributes (None where it left no building), from what export tasks have written."""
    paths = [p for p in outputs if p.endswith(f"/{ROWS}")]
    return {unit: row for _, data in store.read_many(paths) for unit, row in json.loads(data).items()}

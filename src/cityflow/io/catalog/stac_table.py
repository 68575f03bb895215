"""One table of all items beside them, in the layout of stac-geoparquet: written through geopandas, a row an item.

Properties are columns, as are ``cityflow:item_size`` and ``cityflow:item_md5``: size and MD5 of the item's file, by which a changed item is found.
References are relative to the folder of the items, where the table lies, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Any

import pyarrow as pa
import shapely

from cityflow.io.catalog.stac_items import ITEM_MD5, ITEM_SIZE
from cityflow.io.catalog.stac_schema import BASE, PROPERTIES, SCHEMA, md5_of
from cityflow.io.tables.geoparquet import geoparquet_bytes

BATCH = 2000
"""Items that are held as trees at once; bounds memory."""
WGS84 = "OGC:CRS84"


class ItemTable:
    """Rows of items, as they are written one by one."""

    def __init__(self) -> None:
        self._rows: list[dict[str, Any]] = []
        self._boxes: list[list[float] | None] = []
        self._done: list[pa.Table] = []

    def add(self, item: Mapping[str, Any], text: bytes) -> None:
        """An item, and what its file holds."""
        size_and_md5 = {ITEM_SIZE: len(text), ITEM_MD5: md5_of(text)}
        if unknown := item["properties"].keys() - PROPERTIES.keys() - {"proj:projjson"}:
            raise ValueError(f"stac_schema.PROPERTIES lacks {', '.join(sorted(unknown))}")
        moment = datetime.fromisoformat(item["properties"]["datetime"])
        fields = {k: item.get(k) for k in BASE} | {k: item["properties"].get(k) for k in PROPERTIES}
        self._rows.append(fields | {"datetime": moment} | size_and_md5)
        self._boxes.append(item.get("bbox"))
        if len(self._rows) == BATCH:
            self._pack()

    def as_bytes(self) -> bytes:
        """The table as a GeoParquet file: same items, same bytes."""
        self._pack()
        table = pa.concat_tables(self._done)
        empty = [n for n in PROPERTIES if table[n].null_count == len(table)]
        shapes = [None if box is None else shapely.box(*box) for box in self._boxes]
        return geoparquet_bytes(table.drop_columns(empty), shapes, WGS84)

    def _pack(self) -> None:
        if self._rows or not self._done:
            self._done.append(pa.Table.from_pylist(self._rows, schema=SCHEMA))
            self._rows = []

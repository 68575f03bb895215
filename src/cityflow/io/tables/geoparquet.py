"""GeoParquet through geopandas: the same bytes for the same table."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from shapely.geometry.base import BaseGeometry

ROWS_A_GROUP = 10_000
"""Rows that are read at once; bounds memory."""


def geoparquet_bytes(table: pa.Table, shapes: Sequence[BaseGeometry | None], crs: Any) -> bytes:
    """A table and the geometry of each row, with its box (``bbox``), as a file.

    Parameters
    ----------
    crs : as geopandas takes it; None for a local frame
    """
    # Loaded where a table is written: many commands import this module, and they take longer than to start it
    import geopandas as gpd
    import pandas as pd

    frame = table.to_pandas(types_mapper=pd.ArrowDtype)
    located = gpd.GeoDataFrame(frame, geometry=gpd.GeoSeries(list(shapes), index=frame.index, crs=crs))
    buffer = io.BytesIO()
    located.to_parquet(buffer, index=False, write_covering_bbox=True)
    return _without_pandas(buffer)


def _without_pandas(buffer: io.BytesIO) -> bytes:
    """The same file without what pandas notes on its own types: it cannot read what it notes on nested ones."""
    table = pq.read_table(buffer)
    plain, out = table.replace_schema_metadata({b"geo": table.schema.metadata[b"geo"]}), io.BytesIO()
    pq.write_table(plain, out, compression="zstd", row_group_size=ROWS_A_GROUP)
    return out.getvalue()

"""The table of items, read in the place of very many items; what does not fit the items any more is found without reading them.

It is used where its bytes have the digest that the collection names, its rows are the collection's items one by one, and each item's file has the size that
its row has. Of files that are as young as the table or younger, and where no times compare (object stores), the MD5 must be that of the row.
"""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from cityflow.errors import CatalogError
from cityflow.io.catalog.catalog_kinds import KIND
from cityflow.io.catalog.stac_assets import IMAGE
from cityflow.io.catalog.stac_files import contents, listed, texts
from cityflow.io.catalog.stac_items import (
    ITEM_MD5,
    ITEM_SIZE,
    SHA256_MULTIHASH,
    TABLE,
    TABLE_ASSET,
    StaleTable,
    item_place,
)
from cityflow.io.catalog.stac_schema import BASE, PROPERTIES, md5_of

MOST_MB = 2048
"""Of a table, packed and unpacked: that of a million images has a quarter of it."""
OF_IMAGES = (
    "datetime", "proj:bbox", "pers:perspective_center", "pers:rotation_matrix", "cityflow:camera", "cityflow:heights",
    "cityflow:bands", "cityflow:dtype", "cityflow:gain", "cityflow:gamma", "cityflow:falloff", "cityflow:shoulder", "cityflow:white",
    "cityflow:pixel_mm", "cityflow:head", "cityflow:date_unknown", "cityflow:pose_covariance",
    "cityflow:video_s",
)  # fmt: skip
"""What is read of an image; the other columns are for others."""
Tree = dict[str, Any]


def open_table(collection: Mapping[str, Any], base: str, links: Sequence[str]) -> pq.ParquetFile | None:
    """The table of a collection; None where it names none of ours.

    Parameters
    ----------
    collection : its JSON;  base : its folder
    links : references to its items, in its order; of children, too

    Raises
    ------
    StaleTable
        Its digest, its rows or one of the items is another than when it was made.
    """
    asset = dict(collection.get("assets") or {}).get(TABLE_ASSET)
    if not isinstance(asset, Mapping) or asset.get("href") != f"./{TABLE}":
        return None
    file, known = _opened(_data(base, str(asset.get("file:checksum"))), len(links))
    if [f"./{item_place(name)}" for name in known["id"].to_pylist()] != list(links):
        raise StaleTable("the collection has other items than the table")
    _compare_items(base, known)
    return file


def _data(base: str, checksum: str) -> bytes:
    place = f"{base}/{TABLE}"
    try:
        data = contents(place, MOST_MB)
    except (OSError, CatalogError) as error:
        raise StaleTable(f"the table cannot be read ({type(error).__name__})") from error
    if SHA256_MULTIHASH + hashlib.sha256(data).hexdigest() != checksum:
        raise StaleTable("the table has another digest than the collection says")
    return data


def _opened(data: bytes, rows: int) -> tuple[pq.ParquetFile, pa.Table]:
    """The file, and what tells whether it is that of the items."""
    wanted = ["id", ITEM_SIZE, ITEM_MD5]
    try:
        file = pq.ParquetFile(io.BytesIO(data))
        size = sum(file.metadata.row_group(k).total_byte_size for k in range(file.metadata.num_row_groups))
        if missing := {*wanted, "assets", KIND}.difference(file.schema_arrow.names):
            raise StaleTable(f"the table lacks {', '.join(sorted(missing))}")
        if file.metadata.num_rows != rows or size > MOST_MB * 1e6:
            raise StaleTable(f"the table has {file.metadata.num_rows} rows for {rows} items")
        return file, file.read(columns=wanted)
    except (pa.ArrowException, OSError) as error:
        raise StaleTable(f"the table is damaged ({error!s:.100})") from error


def _compare_items(base: str, table: pa.Table) -> None:
    places = [f"{base}/{item_place(name)}" for name in table["id"].to_pylist()]
    sizes, digests = table[ITEM_SIZE].to_pylist(), table[ITEM_MD5].to_pylist()
    try:
        found = listed(f"{base}/{os.path.dirname(TABLE)}")
        made_ns = found[f"{base}/{TABLE}"].changed_ns
    except (OSError, CatalogError, KeyError, NotImplementedError) as error:
        raise StaleTable("the folder of the items cannot be listed") from error
    unsure: list[str] = []
    for place, size, digest in zip(places, sizes, digests, strict=True):
        file = found.get(place)
        if file is None or file.size != size or file.md5 not in ("", digest):
            raise StaleTable(f"{Path(place).name} {'is missing' if file is None else 'has changed'}")
        if not file.md5 and (not made_ns or file.changed_ns >= made_ns):
            unsure.append(place)
    expected = dict(zip(places, digests, strict=True)) if unsure else {}
    for place, text in texts(unsure):
        if md5_of(text) != expected[place]:
            raise StaleTable(f"{Path(place).name} has changed")


def image_items(file: pq.ParquetFile) -> Iterator[Tree]:
    """Items of images as `stac_images.image_of_item` reads them: its fields alone."""
    wanted = [name for name in OF_IMAGES if name in file.schema_arrow.names]
    for group in range(file.num_row_groups):
        rows = file.read_row_group(group, columns=[*wanted, "id", "assets", KIND])
        images = rows.filter(pc.equal(rows[KIND], IMAGE))
        columns = {name: _values(images[name]) for name in wanted}
        assets = _values(images["assets"])
        for k, name in enumerate(images["id"].to_pylist()):
            properties = {key: column[k] for key, column in columns.items() if column[k] is not None}
            yield {"id": name, "properties": {KIND: IMAGE, **properties}, "assets": assets[k]}


def other_items(file: pq.ParquetFile) -> Iterator[Tree]:
    """Items of all other kinds, whole, but without a geometry."""
    names = [name for name in file.schema_arrow.names if name in BASE or name in PROPERTIES]
    for group in range(file.num_row_groups):
        if pc.all(pc.equal(file.read_row_group(group, columns=[KIND])[KIND], IMAGE)).as_py():
            continue
        rows = file.read_row_group(group, columns=names)
        for row in rows.filter(pc.not_equal(rows[KIND], IMAGE)).to_pylist():
            moment = row.pop("datetime").isoformat().replace("+00:00", "Z")
            fields = {key: row.pop(key) for key in BASE}
            properties = {key: value for key, value in row.items() if value is not None}
            yield {**fields, "geometry": None, "properties": {"datetime": moment, **properties}}


def _values(column: pa.ChunkedArray | pa.Array) -> list[Any]:
    """Values of a column as Python's; lists of one length through numpy, since they are most of a table."""
    array = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if pa.types.is_struct(array.type) and not array.null_count:
        names = [field.name for field in array.type]
        return [dict(zip(names, row, strict=True)) for row in zip(*map(_values, array.flatten()), strict=True)]
    if pa.types.is_list(array.type) and not array.null_count and len(array):
        lengths = pc.unique(pc.list_value_length(array)).to_pylist()
        flat = array.flatten()
        if len(lengths) == 1 and lengths[0] and not flat.null_count and pa.types.is_primitive(flat.type):
            rows: list[Any] = flat.to_numpy().reshape(-1, lengths[0]).tolist()
            return rows
    if pa.types.is_timestamp(array.type):
        array = pc.strftime(array.cast(pa.timestamp("s", "UTC")), "%Y-%m-%dT%H:%M:%SZ")
    values: list[Any] = array.to_pylist()
    return values

"""Columns of the table of items: STAC's own fields, the properties that `stac_write` gives an item, and size and MD5 of its file."""

from __future__ import annotations

import hashlib

import pyarrow as pa

from cityflow.io.catalog.stac_items import ITEM_MD5, ITEM_SIZE

_TEXT, _WHOLE, _REAL, _YES = pa.string(), pa.int64(), pa.float64(), pa.bool_()
_TEXTS, _WHOLES, _REALS = pa.list_(_TEXT), pa.list_(_WHOLE), pa.list_(_REAL)
_ASSET = {"href": _TEXT, "type": _TEXT, "roles": _TEXTS, "file:checksum": _TEXT, "file:size": _WHOLE}
_CAMERA = {
    "width": _WHOLE,
    "height": _WHOLE,
    **dict.fromkeys(("fx", "fy", "cx", "cy"), _REAL),
    "kind": _TEXT,
    "distortion": _REALS,
}
_INTERIOR = {
    "sensor_array_dimensions": _WHOLES,
    "pixel_spacing": _REALS,
    "focal_length": _REAL,
    "principal_point_offset": _REALS,
}
BASE = {
    "type": _TEXT, "stac_version": _TEXT, "stac_extensions": _TEXTS, "id": _TEXT, "collection": _TEXT,
    "links": pa.list_(pa.struct({"rel": _TEXT, "href": _TEXT, "type": _TEXT})), "assets": pa.struct({"data": pa.struct(_ASSET)}),
}  # fmt: skip
PROPERTIES = {
    "datetime": pa.timestamp("us", "UTC"),
    "proj:code": _TEXT, "proj:bbox": _REALS, "proj:shape": _WHOLES, "proj:transform": _REALS,
    "pc:count": _WHOLE, "pc:type": _TEXT, "pc:encoding": _TEXT,
    "pc:schemas": pa.list_(pa.struct({"name": _TEXT, "size": _WHOLE, "type": _TEXT})),
    "pers:interior_orientation": pa.struct(_INTERIOR), "pers:perspective_center": _REALS, "pers:rotation_matrix": _REALS,
    "pers:omega": _REAL, "pers:phi": _REAL, "pers:kappa": _REAL, "pers:crs": _WHOLE, "pers:vertical_crs": _WHOLE,
    "view:off_nadir": _REAL, "view:azimuth": _REAL,
    "cityflow:kind": _TEXT, "cityflow:date_unknown": _YES, "cityflow:crs_in_file": _TEXT,
    "cityflow:camera": pa.struct(_CAMERA), "cityflow:heights": _REALS, "cityflow:bands": _WHOLE, "cityflow:dtype": _TEXT,
    "cityflow:gain": _REALS, "cityflow:gamma": _REALS, "cityflow:falloff": _REAL, "cityflow:shoulder": _REAL,
    "cityflow:white": _REAL, "cityflow:pixel_mm": _REAL, "cityflow:head": _TEXT, "cityflow:pose_covariance": _REALS,
    "cityflow:video_s": _REAL,
    "cityflow:z_range": _REALS, "cityflow:classes": _WHOLES, "cityflow:returns": _WHOLE,
    "cityflow:count": _WHOLE, "cityflow:id_column": _TEXT, "cityflow:id_format": _TEXT, "cityflow:layer": _TEXT,
}  # fmt: skip
"""Every property that `stac_write` gives an item, but the CRS as PROJJSON, which is the same for all."""
SCHEMA = pa.schema({**BASE, **PROPERTIES, ITEM_SIZE: _WHOLE, ITEM_MD5: _TEXT})


def md5_of(text: bytes) -> str:
    """MD5 of an item's file, hexadecimal: what object stores know of a file without sending it."""
    return hashlib.md5(text, usedforsecurity=False).hexdigest()

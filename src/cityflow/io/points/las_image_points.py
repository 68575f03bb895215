"""Points from images as LAZ: colour, reference image, number of agreeing partners, expected precision."""

from __future__ import annotations

import io
import json
from datetime import date

import laspy
import numpy as np
from pyproj import CRS

from cityflow.core.arrays import ByteArray
from cityflow.core.depth_map import ImagePoints
from cityflow.core.kernels import njit
from cityflow.io.points.las_header import BACKEND
from cityflow.io.points.las_write import FIXED_DATE, SOFTWARE

SCALE_M = 0.001
SIGMA = "sigma"
RGB, RGB_NIR = 7, 8
"""LAS point formats."""

NAMES_RECORD = 1
ONE_OF_ONE = 1 | 1 << 4
"""Number of a return, and of the returns of its pulse."""
PART = 1 << 15
"""Points at a time; no result depends on it."""


def write_image_points(
    points: ImagePoints, classes: ByteArray, created: date = FIXED_DATE, crs: CRS | None = None
) -> bytes:
    """A LAZ 1.4 file; the same points give the same bytes.

    Parameters
    ----------
    points : world metres, rounded to millimetres
    classes : (N,) ASPRS classes

    Notes
    -----
    ``point_source_id`` counts the reference images from 1 in the order of the variable-length record ``cityflow`` 1 (a JSON list of names; 0 where
    there are more than 65,535), ``user_data`` is the number of agreeing partners, the extra dimension ``sigma`` the expected standard
    deviation along the ray in metres.
    """
    four = points.colour.ndim == 2 and points.colour.shape[1] == 4
    header = laspy.LasHeader(point_format=RGB_NIR if four else RGB, version="1.4")
    low = np.array(points.box[:3]) if len(points) else np.zeros(3)
    header.scales, header.offsets = np.full(3, SCALE_M), np.floor(low)
    header.creation_date = created
    header.generating_software, header.system_identifier = SOFTWARE, SOFTWARE
    header.add_extra_dim(laspy.ExtraBytesParams(SIGMA, np.float32, "precision along ray, m"))
    names = json.dumps(list(points.names), ensure_ascii=False).encode()
    header.vlrs.append(laspy.VLR(SOFTWARE, NAMES_RECORD, "reference images", names[:65535]))
    if crs is not None:
        header.add_crs(crs)
    data = laspy.LasData(header, _records(points, classes, header))
    buffer = io.BytesIO()
    data.write(buffer, do_compress=True, laz_backend=BACKEND)
    return buffer.getvalue()


def _records(points: ImagePoints, classes: ByteArray, header: laspy.LasHeader) -> laspy.ScaleAwarePointRecord:
    """Written in parts that stay in the cache: each of its fields would else go through all records."""
    records = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
    places = _counts(points.xyz, header.offsets, SCALE_M)
    for first in range(0, len(points), PART):
        part = slice(first, first + PART)
        out, image, colour = records.array[part], points.image[part], points.colour[part]
        out["X"], out["Y"], out["Z"] = places[:, part]
        out["classification"], out["bit_fields"] = classes[part], ONE_OF_ONE
        out["user_data"], out[SIGMA] = points.views[part], points.sigma[part]
        out["point_source_id"] = np.where(image < 65535, image + 1, 0)
        colour = colour.astype(np.uint16) * np.uint16(257 if colour.dtype == np.uint8 else 1)
        bands = colour if colour.shape[1] >= 3 else np.repeat(colour[:, :1], 3, axis=1)
        for number, band in enumerate(("red", "green", "blue", "nir")[: max(bands.shape[1], 3)]):
            out[band] = bands[:, number]
    return records


@njit(cache=True, nogil=True)
def _counts(xyz, offsets, scale):  # type: ignore[no-untyped-def]
    """(3, N) int32 whole steps of `scale` from the offsets."""
    out = np.empty((3, len(xyz)), np.int32)
    for i in range(len(xyz)):
        for k in range(3):
            out[k, i] = np.rint((xyz[i, k] - offsets[k]) / scale)
    return out

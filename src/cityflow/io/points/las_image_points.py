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
    records = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
    records.X, records.Y, records.Z = _counts(points.xyz, header.offsets, SCALE_M)
    records.classification = classes
    records.return_number[:] = 1
    records.number_of_returns[:] = 1
    records.user_data = points.views
    records.point_source_id = np.where(points.image < 65535, points.image + 1, 0).astype(np.uint16)
    records[SIGMA] = points.sigma
    colour = points.colour.astype(np.uint16) * np.uint16(257 if points.colour.dtype == np.uint8 else 1)
    bands = colour if colour.shape[1] >= 3 else np.repeat(colour[:, :1], 3, axis=1)
    records.red, records.green, records.blue = bands[:, :3].T
    if bands.shape[1] == 4:
        records.nir = bands[:, 3]
    return records


@njit(cache=True, nogil=True)
def _counts(xyz, offsets, scale):  # type: ignore[no-untyped-def]
    """(3, N) int32 whole steps of `scale` from the offsets."""
    out = np.empty((3, len(xyz)), np.int32)
    for i in range(len(xyz)):
        for k in range(3):
            out[k, i] = np.rint((xyz[i, k] - offsets[k]) / scale)
    return out

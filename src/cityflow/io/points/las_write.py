"""Small LAZ files whose bytes depend on their points alone."""

from __future__ import annotations

import io
from datetime import date
from typing import Any

import laspy
import numpy as np
from pyproj import CRS

from cityflow.core.points import PointCloud
from cityflow.io.points.las_header import BACKEND

FIXED_DATE = date(2000, 1, 1)
"""Creation date of files whose source states none; today's would change the bytes."""
SOFTWARE = "cityflow"


def write_points(
    cloud: PointCloud,
    scale: float = 0.001,
    offsets: tuple[float, float, float] | None = None,
    created: date = FIXED_DATE,
    crs: CRS | None = None,
) -> bytes:
    """A LAZ 1.4 file (point format 6); the same cloud gives the same bytes.

    Parameters
    ----------
    scale : metres; coordinates are rounded to multiples of it
    offsets : x, y, z in metres; by default the whole metres below the lowest coordinates
    created : the header's date
    """
    low = cloud.xyz.min(axis=0) if len(cloud) else np.zeros(3)
    origin = np.floor(low) if offsets is None else np.asarray(offsets, float)
    counts = np.rint((cloud.xyz - origin) / scale)
    if len(counts) and np.abs(counts).max() > np.iinfo(np.int32).max:
        raise ValueError(f"coordinates need more than 32 bits at scale {scale}")
    return encode(
        counts.astype(np.int32),
        np.stack([cloud.classification, cloud.return_number, cloud.number_of_returns], axis=1),
        blank_header((scale, scale, scale), (float(origin[0]), float(origin[1]), float(origin[2])), created, crs),
    )


def blank_header(
    scales: tuple[float, float, float],
    offsets: tuple[float, float, float],
    created: date | None,
    crs: CRS | None = None,
) -> laspy.LasHeader:
    """A LAS 1.4 header of point format 6 without anything of today or of this machine."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.asarray(scales), np.asarray(offsets)
    header.creation_date = created or FIXED_DATE
    header.generating_software, header.system_identifier = SOFTWARE, SOFTWARE
    if crs is not None:
        header.add_crs(crs)
    return header


def encode(
    counts: np.ndarray[Any, np.dtype[np.int32]], marks: np.ndarray[Any, np.dtype[np.uint8]], header: laspy.LasHeader
) -> bytes:
    """LAZ bytes of (N, 3) raw coordinates and (N, 3) class, return number, number of returns."""
    records = laspy.ScaleAwarePointRecord.zeros(len(counts), header=header)
    records.X, records.Y, records.Z = counts.T
    records.classification, records.return_number, records.number_of_returns = marks.T
    data = laspy.LasData(header, records)
    buffer = io.BytesIO()
    data.write(buffer, do_compress=True, laz_backend=BACKEND)
    return buffer.getvalue()

"""What the pictures of a synthetic flight say of themselves in EXIF: the given orientation's places and focal lengths, and times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.camera import OrientedImage
from cityflow.core.photo_metadata import GnssPosition, PhotoMetadata
from cityflow.core.reference import Reference
from cityflow.io.crs import horizontal_transform, transformed
from cityflow.io.images.image_write import JPEG_ENDING
from cityflow.synthetic.pose_noise import station_of
from cityflow.synthetic.sensor_readout import head_of

PIXEL_MM = 0.0046
"""Of a usual aerial camera, millimetres."""
MAKE, MODEL = "cityflow", "synthetic {}"
SECONDS_A_STATION = 2
FIRST_SECOND = 10 * 3600
"""Ten in the morning."""


def photo_tags(given: Sequence[OrientedImage], day: str, sigma_m: float, reference: Reference) -> list[PhotoMetadata]:
    """Tags of all images, in their order.

    Parameters
    ----------
    given : as they are handed over, world metres
    day : ISO day of the flight
    sigma_m : standard deviation of the places, metres; 0: not stated

    Raises
    ------
    CatalogError
        The reference is a local frame.
    """
    from pyproj import CRS

    centres = np.array([i.centre for i in given]).reshape(-1, 3)
    places = transformed(horizontal_transform(reference, CRS.from_epsg(4326)), centres[:, :2])
    stations = {name: k for k, name in enumerate(sorted({station_of(i.name) for i in given}))}
    sigmas = (sigma_m,) * 3 if sigma_m else None
    return [
        PhotoMetadata(
            f"{image.name}{JPEG_ENDING}", image.camera.width, image.camera.height, MAKE, MODEL.format(head_of(image)),
            taken=_time(day, stations[station_of(image.name)]), focal_mm=image.camera.fx * PIXEL_MM,
            sensor_width_mm=image.camera.width * PIXEL_MM, position=GnssPosition(lat, lon, float(z), sigmas_m=sigmas),
        )
        for image, (lon, lat), z in zip(given, places.tolist(), centres[:, 2], strict=True)
    ]  # fmt: skip


def _time(day: str, station: int) -> str:
    seconds = FIRST_SECOND + SECONDS_A_STATION * station
    return f"{day.replace('-', ':')} {seconds // 3600 % 24:02d}:{seconds // 60 % 60:02d}:{seconds % 60:02d}"

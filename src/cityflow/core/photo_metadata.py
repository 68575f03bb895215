"""What a photograph's file says of itself: place, look, camera and time, as its maker wrote them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera

FILM_MM = 36.0
"""Width of a 35 mm film's picture, which equivalent focal lengths count on."""


class HeightKind(StrEnum):
    """What a height counts from."""

    UNKNOWN = "unknown"
    SEA_LEVEL = "mean sea level"
    ELLIPSOID = "ellipsoid"


@dataclass(frozen=True, slots=True)
class GnssPosition:
    """Place of the exposure.

    Attributes
    ----------
    latitude, longitude : WGS 84 degrees, positive north and east
    height_m : None where it is missing;  height_kind : what it counts from
    sigmas_m : standard deviations east, north and up, metres; None where they are not stated
    fixed : whether carrier phases were resolved (RTK fix); None where nothing is said
    """

    latitude: float
    longitude: float
    height_m: float | None = None
    height_kind: HeightKind = HeightKind.UNKNOWN
    sigmas_m: tuple[float, float, float] | None = None
    fixed: bool | None = None


@dataclass(frozen=True, slots=True)
class PhotoMetadata:
    """What is known of a photograph; what is missing is None or empty.

    Attributes
    ----------
    name : of the file
    width, height : pixels as stored
    make, model, serial : of the camera
    taken : time of the exposure as EXIF writes it, with fractions of a second where they are known
    orientation : EXIF 1 to 8; 1 is upright
    focal_mm, focal_35mm : focal length, and the one that gives the same picture on 35 mm film
    sensor_width_mm : of the pixels that are stored
    calibrated : the camera as its maker calibrated it, in pixels
    position : where it was taken;  above_start_m : height over the place of take-off
    look_deg : yaw (clockwise from true north), pitch (0 is level, -90 straight down), roll of the optical axis
    shutter : ``global`` or ``rolling``; empty where nothing is said
    """

    name: str
    width: int = 0
    height: int = 0
    make: str = ""
    model: str = ""
    serial: str = ""
    taken: str = ""
    orientation: int = 1
    focal_mm: float | None = None
    focal_35mm: float | None = None
    sensor_width_mm: float | None = None
    calibrated: Camera | None = None
    position: GnssPosition | None = None
    above_start_m: float | None = None
    look_deg: tuple[float, float, float] | None = None
    shutter: str = ""

    @property
    def focal_px(self) -> float | None:
        """Of the stored pixels: the calibrated one, else by the sensor's width, else by 35 mm film, whose width is the image's longer side."""
        if self.calibrated is not None:
            return self.calibrated.fx
        if self.focal_mm and self.sensor_width_mm and self.width:
            return self.focal_mm / self.sensor_width_mm * self.width
        if self.focal_35mm and self.width:
            return self.focal_35mm / FILM_MM * max(self.width, self.height)
        return None

    @property
    def camera_key(self) -> tuple[str, str, str, int, int, float | None]:
        """Photographs with the same have the same camera, as far as their files say."""
        return self.make, self.model, self.serial, self.width, self.height, self.focal_mm

    @property
    def axis(self) -> FloatArray | None:
        """(3,) unit vector of the viewing direction: east, north, up; None without `look_deg`."""
        if self.look_deg is None:
            return None
        yaw, pitch, _ = np.radians(self.look_deg)
        return np.array([np.sin(yaw) * np.cos(pitch), np.cos(yaw) * np.cos(pitch), np.sin(pitch)])

"""EXIF and XMP of photographs as one value: DJI, senseFly and Parrot, Autel, Sony, Phase One, and plain cameras.

Where XMP and EXIF both state a value, XMP's is taken: makers of drones write it with more digits. DJI's gimbal angles are those of the optical axis, pitch
0 at the horizon. Pix4D's tags (``Camera:Pitch``, which senseFly, Parrot and Autel write) are those of an aircraft whose camera looks straight down where
they are 0; they are led to the optical axis, as a roll of wings tilts it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import ExifTags, Image

from cityflow.core.camera import Camera
from cityflow.core.photo_metadata import GnssPosition, HeightKind, PhotoMetadata
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import from_yaw_pitch_roll, gimbal_angles
from cityflow.io.given_files import check_plain
from cityflow.io.images.exif_values import MM_PER_UNIT, exif_degrees, exif_number
from cityflow.io.images.xmp_tags import xmp_tags

TIFF_XMP = 700
SERIALS = ("drone-dji:CameraSerialNumber", "Camera:SerialNumber", "aux:SerialNumber", "exifEX:BodySerialNumber")
RTK_FIXED = "50"
"""DJI's ``RtkFlag``: 0 none, 16 single, 34 float, 50 fixed."""
ROLLED_LEFT = "sensefly"
"""Make whose ``Camera:Roll`` is positive with the left wing down: so OpenDroneMap reads it (``opendm/photo.py``); no description of its own was found."""
ELLIPSOID_REFERENCES = (2, 3)
"""EXIF 3.0's ``GPSAltitudeRef`` for heights above and below the ellipsoid; 0 and 1 are above and below sea level."""


def photo_metadata(path: str | Path) -> PhotoMetadata:
    """What the file says of itself, read without decoding its pixels.

    Raises
    ------
    CatalogError
        Where the file is missing or no image.
    """
    check_plain(path)
    Image.MAX_IMAGE_PIXELS = None  # nothing is decoded; Pillow would refuse a header of 150 megapixels
    try:
        with Image.open(path) as image:
            exif, width, height = image.getexif(), image.width, image.height
            packet = image.info.get("xmp") or getattr(image, "tag_v2", {}).get(TIFF_XMP) or b""
            return metadata_of_tags(
                Path(path).name, (width, height), exif, packet if isinstance(packet, bytes) else bytes(packet)
            )
    except (OSError, ValueError, SyntaxError) as error:
        raise CatalogError(
            f"this is no image ({error})", where=str(path), remedy="copy the file again, or leave it out"
        ) from error


def metadata_of_bytes(name: str, size: tuple[int, int], exif: bytes, xmp: bytes = b"") -> PhotoMetadata:
    """The value of a block of EXIF (with or without its six bytes ``Exif``) and an XMP packet; what is damaged is as if it were missing.

    Parameters
    ----------
    size : width and height in pixels as stored
    """
    tags = Image.Exif()
    try:
        tags.load(exif)
    except (OSError, ValueError, SyntaxError, KeyError):
        tags = Image.Exif()
    return metadata_of_tags(name, size, tags, xmp)


def metadata_of_tags(name: str, size: tuple[int, int], exif: Image.Exif, xmp: bytes) -> PhotoMetadata:
    """As `metadata_of_bytes`, of tags that Pillow has read."""
    extra, base = xmp_tags(xmp), ExifTags.Base
    fine, place = _ifd(exif, ExifTags.IFD.Exif), _ifd(exif, ExifTags.IFD.GPSInfo)
    make = _text(exif.get(base.Make)) or extra.get("tiff:Make", "")
    focal, sensor = exif_number(fine.get(base.FocalLength)) or None, _sensor_width(fine, size)
    start = exif_number(extra.get("drone-dji:RelativeAltitude", extra.get("drone-autel:RelativeAltitude")))
    orientation = exif_number(exif.get(base.Orientation))
    return PhotoMetadata(
        name, *size, make, _text(exif.get(base.Model)) or extra.get("tiff:Model", ""),
        _text(fine.get(base.BodySerialNumber)) or next((extra[k] for k in SERIALS if k in extra), ""), _taken(fine),
        int(orientation) if orientation and 1 <= orientation <= 8 else 1, focal,
        exif_number(fine.get(base.FocalLengthIn35mmFilm)) or None, sensor, _calibrated(extra, size, sensor),
        _position(place, extra), start if start is not None else exif_number(extra.get("Camera:AboveGroundAltitude")),
        _look(extra, make), _shutter(extra),
    )  # fmt: skip


def _ifd(exif: Image.Exif, part: int) -> Mapping[int, Any]:
    try:
        return exif.get_ifd(part)
    except (OSError, ValueError, SyntaxError, KeyError, TypeError):
        return {}


def _text(value: Any) -> str:
    return "" if value is None else str(value).strip("\0 ")


def _taken(fine: Mapping[int, Any]) -> str:
    time, fraction = _text(fine.get(ExifTags.Base.DateTimeOriginal)), _text(fine.get(ExifTags.Base.SubsecTimeOriginal))
    return f"{time}.{fraction}" if time and fraction.isdigit() else time


def _sensor_width(fine: Mapping[int, Any], size: tuple[int, int]) -> float | None:
    resolution = exif_number(fine.get(ExifTags.Base.FocalPlaneXResolution))
    unit = MM_PER_UNIT.get(fine.get(ExifTags.Base.FocalPlaneResolutionUnit, 2))
    taken = exif_number(fine.get(ExifTags.Base.ExifImageWidth)) or size[0]
    return taken / resolution * unit if resolution and unit else None


def _calibrated(extra: Mapping[str, str], size: tuple[int, int], sensor_mm: float | None) -> Camera | None:
    """DJI's calibration in pixels, else Pix4D's tags in millimetres of the sensor."""
    width, height = size
    terms = _numbers(extra.get("drone-dji:DewarpData", "").partition(";")[2])
    if len(terms) == 9 and terms[0] > 0 and extra.get("drone-dji:DewarpFlag", "0") in ("0", ""):
        fx, fy, dx, dy, k1, k2, p1, p2, k3 = terms
        return Camera(width, height, fx, fy, width / 2 + dx, height / 2 + dy, (k1, k2, p1, p2, k3))
    focal = _first(extra, "drone-dji:CalibratedFocalLength")
    cx, cy = (_first(extra, f"drone-dji:CalibratedOpticalCenter{a}") for a in "XY")
    if focal and cx and cy:
        return Camera(width, height, focal, focal, cx, cy)
    return _of_pix4d_tags(extra, size, sensor_mm)


def _of_pix4d_tags(extra: Mapping[str, str], size: tuple[int, int], sensor_mm: float | None) -> Camera | None:
    focal, principal = _first(extra, "Camera:PerspectiveFocalLength"), _numbers(extra.get("Camera:PrincipalPoint", ""))
    if (
        not (focal and sensor_mm and len(principal) == 2)
        or extra.get("Camera:ModelType", "perspective") != "perspective"
    ):
        return None
    per_mm = size[0] / sensor_mm
    lens = _numbers(extra.get("Camera:PerspectiveDistortion", ""))
    k1, k2, k3, p1, p2 = lens if len(lens) == 5 else (0.0,) * 5
    middle = principal[0] * per_mm, principal[1] * per_mm
    return Camera(*size, focal * per_mm, focal * per_mm, *middle, (k1, k2, p1, p2, k3) if any(lens) else ())


def _position(place: Mapping[int, Any], extra: Mapping[str, str]) -> GnssPosition | None:
    gps = ExifTags.GPS
    latitude = _first(extra, "drone-dji:GpsLatitude", "drone-dji:Latitude", "drone-autel:GpsLatitude")
    longitude = _first(
        extra, "drone-dji:GpsLongitude", "drone-dji:GpsLongtitude", "drone-dji:Longitude", "drone-autel:GpsLongitude"
    )
    if latitude is None or longitude is None:
        latitude = exif_degrees(place.get(gps.GPSLatitude), place.get(gps.GPSLatitudeRef), "S")
        longitude = exif_degrees(place.get(gps.GPSLongitude), place.get(gps.GPSLongitudeRef), "W")
    if latitude is None or longitude is None:
        return None
    height, kind = _height(place, extra)
    plan = exif_number(place.get(gps.GPSHPositioningError)) or _first(extra, "Camera:GPSXYAccuracy")
    up = _first(extra, "Camera:GPSZAccuracy") or plan
    rtk = [_first(extra, f"drone-dji:RtkStd{a}") for a in ("Lon", "Lat", "Hgt")]
    sigmas = (
        (float(rtk[0] or 0), float(rtk[1] or 0), float(rtk[2] or 0))
        if all(rtk)
        else (plan, plan, up)
        if plan and up
        else None
    )
    flag = extra.get("drone-dji:RtkFlag")
    return GnssPosition(latitude, longitude, height, kind, sigmas, None if flag is None else flag.strip() == RTK_FIXED)


def _height(place: Mapping[int, Any], extra: Mapping[str, str]) -> tuple[float | None, HeightKind]:
    """Height and what it counts from: DJI's RTK writes ellipsoidal heights."""
    stated = extra.get("Camera:VertCS", "").lower()
    absolute = _first(extra, "drone-dji:AbsoluteAltitude", "drone-autel:AbsoluteAltitude")
    if absolute is not None:
        rtk = (
            extra.get("drone-dji:AltitudeType", "").lower() == "rtkalt"
            or extra.get("drone-dji:RtkFlag", "0").strip() == RTK_FIXED
        )
        return absolute, HeightKind.ELLIPSOID if rtk else HeightKind.UNKNOWN
    height = exif_number(place.get(ExifTags.GPS.GPSAltitude))
    reference = place.get(ExifTags.GPS.GPSAltitudeRef, 0)
    code = reference[0] if isinstance(reference, bytes) and reference else exif_number(reference)
    if height is None:
        return None, HeightKind.UNKNOWN
    kind = (
        HeightKind.ELLIPSOID
        if code in ELLIPSOID_REFERENCES or "ellips" in stated or "wgs84" in stated
        else HeightKind.UNKNOWN
    )
    if "egm" in stated or "geoid" in stated:
        kind = HeightKind.SEA_LEVEL
    return (-height if code in (1, 3) else height), kind


def _look(extra: Mapping[str, str], make: str) -> tuple[float, float, float] | None:
    """Yaw, pitch (0 level, -90 down) and roll in degrees."""
    for maker in ("drone-dji:Gimbal{}Degree", "drone-autel:Gimbal{}Degree", "Camera:Gimbal{}"):
        angles = [_first(extra, maker.format(a)) for a in ("Yaw", "Pitch", "Roll")]
        if None not in angles[:2]:
            return float(angles[0] or 0), float(angles[1] or 0), float(angles[2] or 0)
    yaw, pitch, roll = (_first(extra, f"Camera:{a}") for a in ("Yaw", "Pitch", "Roll"))
    if yaw is None or pitch is None or roll is None:
        return None
    wing = -roll if make.strip().lower() == ROLLED_LEFT else roll
    axis = gimbal_angles(from_yaw_pitch_roll(*np.radians([yaw, pitch, wing]).tolist()))
    return float(np.degrees(axis[0])), float(np.degrees(axis[1])), float(np.degrees(axis[2]))


def _shutter(extra: Mapping[str, str]) -> str:
    text = (extra.get("drone-dji:ShutterType", "") + extra.get("Camera:ShutterType", "")).lower()
    if any(word in text for word in ("mechanical", "global", "leaf")):
        return "global"
    return "rolling" if any(word in text for word in ("electronic", "rolling")) else ""


def _first(extra: Mapping[str, str], *names: str) -> float | None:
    """The first that is a number; fractions such as 123/10 are."""
    for name in names:
        text = extra.get(name, "").strip()
        over, slash, under = text.partition("/")
        value = exif_number(over)
        divisor = exif_number(under) if slash else 1.0
        if value is not None and divisor:
            return value / divisor
    return None


def _numbers(text: str) -> list[float]:
    """Numbers between commas; empty where one is none."""
    values = [exif_number(part) for part in text.split(",")] if text.strip() else []
    return [float(v or 0) for v in values] if None not in values else []

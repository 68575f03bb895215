"""Puts EXIF into JPEG files that have none: camera, time and place of the exposure."""

from __future__ import annotations

from PIL import ExifTags, Image
from PIL.TiffImagePlugin import IFDRational

from cityflow.core.photo_metadata import HeightKind, PhotoMetadata

START = b"\xff\xd8"
APP1 = b"\xff\xe1"
MOST_BYTES = 65533
MICROMETRES = 5
"""EXIF's unit of the focal plane's resolution, as cameras write it."""
SECOND_PARTS = 1_000_000
"""Of arc: 0.03 mm on the ground."""
ABOVE_SEA, ABOVE_ELLIPSOID = 0, 2


def with_exif(jpeg: bytes, photo: PhotoMetadata) -> bytes:
    """The same picture with what is known of its exposure; pixels are not encoded anew.

    Raises
    ------
    ValueError
        This is no JPEG.
    """
    if not jpeg.startswith(START):
        raise ValueError(f"{photo.name} is no JPEG, so that it can have no EXIF here")
    block = _tags(photo).tobytes()
    if len(block) > MOST_BYTES:
        raise ValueError(f"{photo.name}: EXIF of {len(block)} bytes does not fit into one segment")
    return START + APP1 + (len(block) + 2).to_bytes(2, "big") + block + jpeg[len(START) :]


def _tags(photo: PhotoMetadata) -> Image.Exif:
    base, tags = ExifTags.Base, Image.Exif()
    tags[base.Make], tags[base.Model], tags[base.Orientation] = photo.make, photo.model, photo.orientation
    fine = tags.get_ifd(ExifTags.IFD.Exif)
    time, _, fraction = photo.taken.partition(".")
    if time:
        fine[base.DateTimeOriginal] = time
    if fraction:
        fine[base.SubsecTimeOriginal] = fraction
    fine[base.ExifImageWidth], fine[base.ExifImageHeight] = photo.width, photo.height
    if photo.focal_mm is not None:
        fine[base.FocalLength] = IFDRational(round(photo.focal_mm * 10_000), 10_000)
    if photo.sensor_width_mm is not None:
        per_micrometre = IFDRational(photo.width, round(photo.sensor_width_mm * 1000))
        fine[base.FocalPlaneXResolution] = fine[base.FocalPlaneYResolution] = per_micrometre
        fine[base.FocalPlaneResolutionUnit] = MICROMETRES
    if photo.position is not None:
        _place(tags, photo)
    return tags


def _place(tags: Image.Exif, photo: PhotoMetadata) -> None:
    assert photo.position is not None
    gps, at = ExifTags.GPS, photo.position
    place = tags.get_ifd(ExifTags.IFD.GPSInfo)
    place[gps.GPSVersionID] = b"\x02\x03\x00\x00"
    place[gps.GPSLatitudeRef], place[gps.GPSLatitude] = "N" if at.latitude >= 0 else "S", _degrees(at.latitude)
    place[gps.GPSLongitudeRef], place[gps.GPSLongitude] = "E" if at.longitude >= 0 else "W", _degrees(at.longitude)
    if at.height_m is not None:
        above = ABOVE_ELLIPSOID if at.height_kind is HeightKind.ELLIPSOID else ABOVE_SEA
        place[gps.GPSAltitudeRef] = bytes([above + (at.height_m < 0)])
        place[gps.GPSAltitude] = IFDRational(round(abs(at.height_m) * 1000), 1000)
    if at.sigmas_m is not None:
        place[gps.GPSHPositioningError] = IFDRational(round(at.sigmas_m[0] * 1000), 1000)


def _degrees(angle: float) -> tuple[IFDRational, ...]:
    """Degrees, minutes, seconds."""
    parts = round(abs(angle) * 3600 * SECOND_PARTS)
    minutes, seconds = divmod(parts, 60 * SECOND_PARTS)
    return IFDRational(minutes // 60, 1), IFDRational(minutes % 60, 1), IFDRational(seconds, SECOND_PARTS)

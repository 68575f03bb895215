"""Headers of image files, without decoding: size, bands, EXIF; and whether they can be a camera's.

Image coordinates hold for the pixels as they are stored. A file whose EXIF tag asks viewers to turn it is refused: nobody can tell whether its
poses were computed for the stored or for the turned picture.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from PIL import ExifTags, Image
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.io import DatasetReader

from cityflow.core.camera import Camera
from cityflow.errors import CatalogError
from cityflow.io.given_files import check_plain

UPRIGHT = 1
MOST_PIXELS, GREAT_PIXELS = 1_000_000_000, 100_000_000
"""The largest cameras that fly have half of the first; below the second any picture fits into memory."""
MOST_PACKED = 500
"""How much smaller a picture is in its file than in memory: photographs 5 to 50 times, a plain colour over a thousand times."""
DEPTHS = ("uint8", "uint16")
ADVICE = "convert it to a JPEG, TIFF or PNG of 8 or 16 bits"
MM_PER_UNIT = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}
"""EXIF's units of the focal plane: inch, centimetre, millimetre, micrometre."""


@dataclass(frozen=True, slots=True)
class ImageHeader:
    """What a file says of its image without decoding it.

    Attributes
    ----------
    width, height : pixels as stored
    bands : stored bands, an alpha band not counted: 1, 3 or 4; a palette counts as 3
    dtype : ``uint8`` or ``uint16``
    orientation : EXIF 1 to 8; 1 where there is no tag
    taken : EXIF date and time of the exposure, as written; empty where unknown
    camera : maker and model; empty where unknown
    focal_mm, focal_px : focal length, and the same in pixels where EXIF has what it takes
    exposure_s, f_number, iso : exposure
    position : WGS 84 latitude and longitude in degrees, ellipsoidal or mean-sea-level height in metres, as EXIF has them
    """

    path: str
    width: int
    height: int
    bands: int
    dtype: str
    orientation: int = UPRIGHT
    taken: str = ""
    camera: str = ""
    focal_mm: float | None = None
    focal_px: float | None = None
    exposure_s: float | None = None
    f_number: float | None = None
    iso: float | None = None
    position: tuple[float, float, float | None] | None = None


def image_header(path: str | Path) -> ImageHeader:
    """Size, bands and EXIF of any image that can be tiled.

    Raises
    ------
    CatalogError
        The file is missing, no image, or of a kind of pixel that is not used here.
    """
    with opened(path) as dataset:
        bands, dtype = kind_of(dataset)
        size = dataset.width, dataset.height
        _refuse_giant(str(path), *size, len(bands) * np.dtype(dtype).itemsize)
    return ImageHeader(str(path), *size, len(bands), dtype, **_exif(Path(path), size[0]))


def _refuse_giant(path: str, width: int, height: int, pixel_bytes: int) -> None:
    """A few bytes may promise a picture that fills the memory as soon as it is decoded."""
    pixels = width * height
    stored = Path(path).stat().st_size if "://" not in path else pixels
    if pixels > MOST_PIXELS or (pixels > GREAT_PIXELS and pixels * pixel_bytes > MOST_PACKED * stored):
        raise CatalogError(
            f"{width:,} × {height:,} pixels in {stored / 1e6:,.1f} MB is no photograph", where=path,
            remedy="leave the image out; orthos and rasters go to --ortho and --dsm",
        )  # fmt: skip


def check_against(header: ImageHeader, camera: Camera) -> None:
    """Refuse an image that cannot be what the camera took.

    Raises
    ------
    CatalogError
        Another size than the camera's, or turned by EXIF.
    """
    check_size(header, (camera.width, camera.height))


def check_size(header: ImageHeader, asked: tuple[int, int]) -> None:
    """As `check_against`, by width and height of the camera's images, pixels."""
    size = header.width, header.height
    if header.orientation != UPRIGHT:
        raise CatalogError(
            f"rotated EXIF: the orientation tag is {header.orientation}, so viewers show the picture turned or mirrored",
            where=header.path,
            remedy="remove the tag if the poses hold for the pixels as stored, else store the picture turned",
        )
    if size == asked[::-1] and size != asked:
        raise CatalogError(
            f"the image is {size[0]} × {size[1]} pixels, its camera {asked[0]} × {asked[1]}: one of them is turned",
            where=header.path,
            remedy="store the image as it was when its pose was computed",
        )
    if size != asked:
        raise CatalogError(
            f"wrong size: the image is {size[0]} × {size[1]} pixels, its camera {asked[0]} × {asked[1]}",
            where=header.path,
            remedy="name the camera's image, not a preview, or scale the camera to it",
        )


@contextlib.contextmanager
def opened(path: str | Path) -> Iterator[DatasetReader]:
    """A file opened strictly: what a decoder only warns of is an error.

    Raises
    ------
    CatalogError
        The file is missing, no image, or damaged; also when reading inside the block fails.
    """
    check_plain(path)
    if "://" not in str(path) and not Path(path).is_file():
        raise CatalogError("no such image", where=str(path), remedy="check the path, or leave the image out")
    strict = {"GDAL_ERROR_ON_LIBJPEG_WARNING": "YES", "GDAL_ALLOW_LARGE_LIBJPEG_MEM_ALLOC": "YES"}
    with rasterio.Env(**strict):
        try:
            dataset = open_dataset(str(path))
        except RasterioError as error:
            raise CatalogError(f"this is no image: {error}", where=str(path), remedy=ADVICE) from error
        try:
            with dataset:
                yield dataset
        except RasterioError as error:
            raise CatalogError(
                f"truncated or damaged: {error}", where=str(path), remedy="copy the file again, or leave the image out"
            ) from error


def kind_of(dataset: DatasetReader) -> tuple[tuple[int, ...], str]:
    """Numbers of the bands that hold the picture, from 1 on (1, 1, 1 for a palette), and their dtype.

    Raises
    ------
    CatalogError
        Not grey, colour or colour with near infrared of 8 to 16 bits.
    """
    names = [c.name for c in dataset.colorinterp]
    shown = tuple(i for i, name in enumerate(names, start=1) if name != "alpha")
    if names == ["palette"]:
        shown = (1, 1, 1)
    if "cyan" in names or len(shown) not in (1, 3, 4):
        raise CatalogError(
            f"bands {names} are not used here", where=dataset.name, remedy="keep 1, 3 or 4 bands: R G B NIR"
        )
    if any(dtype not in DEPTHS for dtype in dataset.dtypes):
        raise CatalogError(f"pixels of type {dataset.dtypes[0]} are not used here", where=dataset.name, remedy=ADVICE)
    return shown, dataset.dtypes[0]


def open_dataset(name: str) -> DatasetReader:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        return rasterio.open(name)


def _exif(path: Path, width: int) -> dict[str, Any]:
    """Fields of `ImageHeader` that EXIF holds; none where the tag block is missing or cannot be read."""
    Image.MAX_IMAGE_PIXELS = None  # nothing is decoded here; Pillow would refuse a 150-megapixel header
    try:
        with Image.open(path) as image:
            tags = image.getexif()
            fine, place = tags.get_ifd(ExifTags.IFD.Exif), tags.get_ifd(ExifTags.IFD.GPSInfo)
    except (OSError, ValueError, SyntaxError):
        return {}
    base = ExifTags.Base
    focal = exif_number(fine.get(base.FocalLength))
    text = " ".join(str(tags.get(t, "")).strip("\0 ") for t in (base.Make, base.Model)).strip()
    orientation = exif_number(tags.get(base.Orientation))
    return {
        "orientation": int(orientation) if orientation else UPRIGHT,
        "taken": str(fine.get(base.DateTimeOriginal, "")).strip("\0 "), "camera": text,
        "focal_mm": focal, "focal_px": _focal_px(fine, focal, width),
        "exposure_s": exif_number(fine.get(base.ExposureTime)), "f_number": exif_number(fine.get(base.FNumber)),
        "iso": exif_number(fine.get(base.ISOSpeedRatings)), "position": _position(place),
    }  # fmt: skip


def _focal_px(fine: Any, focal_mm: float | None, width: int) -> float | None:
    resolution = exif_number(fine.get(ExifTags.Base.FocalPlaneXResolution))
    unit = MM_PER_UNIT.get(fine.get(ExifTags.Base.FocalPlaneResolutionUnit, 2))
    if focal_mm and resolution and unit:
        return focal_mm * resolution / unit
    equivalent = exif_number(fine.get(ExifTags.Base.FocalLengthIn35mmFilm))
    return equivalent / 36.0 * width if equivalent else None


def _position(place: Any) -> tuple[float, float, float | None] | None:
    gps = ExifTags.GPS
    latitude = exif_degrees(place.get(gps.GPSLatitude), place.get(gps.GPSLatitudeRef), "S")
    longitude = exif_degrees(place.get(gps.GPSLongitude), place.get(gps.GPSLongitudeRef), "W")
    if latitude is None or longitude is None:
        return None
    height = exif_number(place.get(gps.GPSAltitude))
    below = place.get(gps.GPSAltitudeRef) in (1, b"\x01")
    return latitude, longitude, -height if below and height is not None else height


def exif_degrees(parts: Any, side: Any, negative: str) -> float | None:
    numbers = [exif_number(p) for p in parts] if isinstance(parts, tuple) and len(parts) == 3 else [None]
    if any(n is None for n in numbers):
        return None
    value = sum(n / 60**i for i, n in enumerate(numbers) if n is not None)
    return -value if str(side).strip("\0 ").upper() == negative else value


def exif_number(value: Any) -> float | None:
    """EXIF's rationals may be 0/0."""
    try:
        number = float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if np.isfinite(number) else None

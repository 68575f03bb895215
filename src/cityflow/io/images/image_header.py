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

import numpy as np
import rasterio
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.io import DatasetReader

from cityflow.core.camera import Camera
from cityflow.core.photo_metadata import PhotoMetadata
from cityflow.errors import CatalogError
from cityflow.io.given_files import check_plain
from cityflow.io.images.exif_and_xmp import photo_metadata

UPRIGHT = 1
MOST_PIXELS, GREAT_PIXELS = 1_000_000_000, 100_000_000
"""The largest cameras that fly have half of the first; below the second any picture fits into memory."""
MOST_PACKED = 500
"""How much smaller a picture is in its file than in memory: photographs 5 to 50 times, a plain colour over a thousand times."""
DEPTHS = ("uint8", "uint16")
ADVICE = "convert it to a JPEG, TIFF or PNG of 8 or 16 bits"


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
    camera, serial : maker and model, and the body's serial number; empty where unknown
    """

    path: str
    width: int
    height: int
    bands: int
    dtype: str
    orientation: int = UPRIGHT
    taken: str = ""
    camera: str = ""
    serial: str = ""


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
    photo = _tags(path)
    camera = f"{photo.make} {photo.model}".strip()
    return ImageHeader(str(path), *size, len(bands), dtype, photo.orientation, photo.taken, camera, photo.serial)


def _tags(path: str | Path) -> PhotoMetadata:
    """EXIF and XMP; nothing is known where Pillow cannot read the file."""
    try:
        return photo_metadata(path)
    except CatalogError:
        return PhotoMetadata(Path(path).name)


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

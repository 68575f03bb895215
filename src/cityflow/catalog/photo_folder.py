"""Photographs without poses, as they lie in a folder: files, what these say of themselves, cameras; what cannot be used is told by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cityflow.catalog.file_questions import Reading, told_of
from cityflow.catalog.file_reading import IMAGE_FILES, ImageFile, bytes_of
from cityflow.catalog.image_files import ImageFiles, unit_names
from cityflow.catalog.white import white_level
from cityflow.core.arrays import FloatArray
from cityflow.core.photo_metadata import PhotoMetadata
from cityflow.errors import CatalogError, CityflowError
from cityflow.io.images.exif_and_xmp import photo_metadata
from cityflow.io.orientation.oriented_images import LeftOut
from cityflow.orientation.photo_doubts import DEGREE_M, focal_is_doubtful, photo_doubts, usable_positions
from cityflow.orientation.plausibility import SURVEY

GUESS = 1.2
"""Focal length where nothing is known, in the image's longer side, from which COLMAP starts too."""


@dataclass(frozen=True, slots=True)
class PhotoFile:
    """A photograph that can be used.

    Attributes
    ----------
    name : of its task;  relative : of its file, from the folder;  path, size, checksum : of the file
    width, height : pixels;  white : the value that is shown as white
    camera : number of its camera
    looks_at : (3,) metres in a frame of the survey, where it looks at the ground, else where it was taken; None where unknown
    metadata : what the file says
    has_place : whether its GNSS position can be true
    """

    name: str
    relative: str
    path: str
    size: int
    checksum: str
    width: int
    height: int
    white: float
    camera: int
    looks_at: tuple[float, float, float] | None
    metadata: PhotoMetadata
    has_place: bool


@dataclass(frozen=True, slots=True)
class PhotoFolder:
    """Photographs of a folder.

    Attributes
    ----------
    files : in the order of their names
    focals : of each camera the focal length in pixels, and whether it is more than a guess
    left_out, notes : for the user
    """

    files: tuple[PhotoFile, ...]
    focals: tuple[tuple[float, bool], ...]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]


def photo_folder(folder: Path, reading: Reading, only: frozenset[str] | None = None) -> PhotoFolder:
    """Read every header, checksum and EXIF block; photographs of one camera lie in one folder and say the same of it.

    Parameters
    ----------
    only : the files that are looked at, by their names from the folder on; None: all

    Raises
    ------
    CatalogError
        There is no folder, or no image in it.
    """
    if not folder.is_dir():
        raise CatalogError("no such folder of photographs", where=str(folder), remedy="check the path")
    found = ImageFiles.of(folder)
    if not found.all:
        raise CatalogError("no images in the folder", where=str(folder), remedy="name a folder of JPEG or TIFF files")
    relative = [n for p in found.all if (n := p.relative_to(folder).as_posix()) in (only or {n})]
    paths = [str(folder / n) for n in relative]
    answers = reading.answers(IMAGE_FILES, paths, len(paths), bytes_of(paths))
    left_out: list[LeftOut] = []
    usable: list[tuple[str, str, ImageFile, PhotoMetadata]] = []
    known: dict[str, str] = {}
    for path, name, answer in zip(paths, relative, answers, strict=True):
        try:
            if not isinstance(answer, ImageFile):
                raise told_of(answer, path)
            metadata = replace(photo_metadata(path), name=name)
        except CityflowError as error:
            left_out.append(LeftOut(name, error.problem, error.remedy))
            continue
        first = known.setdefault(answer.digest.checksum, name)
        if first != name:
            left_out.append(LeftOut(name, f"the same file as {first}", "one of them is used"))
            continue
        usable.append((path, name, answer, metadata))
    return _described(usable, left_out)


def _described(usable: Sequence[tuple[str, str, ImageFile, PhotoMetadata]], left_out: list[LeftOut]) -> PhotoFolder:
    names = unit_names([name for _, name, _, _ in usable])
    order = sorted(range(len(usable)), key=lambda k: names[k])
    metadata = [usable[k][3] for k in order]
    placed = usable_positions(metadata)
    looks = _looks_at(metadata, placed)
    deep = [usable[k][0] for k in order if usable[k][2].contents.header.dtype != "uint8"]
    white = white_level(deep) if deep else 255.0
    cameras: dict[object, int] = {}
    focals: list[tuple[float, bool]] = []
    files = []
    for k, look in zip(order, looks, strict=True):
        path, name, answer, stated = usable[k]
        header = answer.contents.header
        key = (stated.camera_key, Path(name).parent.as_posix())
        if key not in cameras:
            cameras[key] = len(focals)
            focals.append(_focal(stated, header.width, header.height))
        files.append(
            PhotoFile(
                names[k], name, path, answer.digest.size, answer.digest.checksum, header.width, header.height,
                255.0 if header.dtype == "uint8" else white, cameras[key], look, stated, stated.name in placed,
            )
        )  # fmt: skip
    doubts = [f"{d if n == SURVEY else f'{n}: {d}'} → {r}" for n, d, r in photo_doubts(metadata)]
    return PhotoFolder(tuple(files), tuple(focals), tuple(left_out), tuple(doubts))


def _focal(stated: PhotoMetadata, width: int, height: int) -> tuple[float, bool]:
    if stated.focal_px is not None and not focal_is_doubtful(stated):
        return stated.focal_px, True
    return GUESS * max(width, height), False


def _looks_at(photos: Sequence[PhotoMetadata], placed: frozenset[str]) -> list[tuple[float, float, float] | None]:
    """Where each looks at the ground, as far as its angles and its height over the place of take-off say it."""
    known = [p.position for p in photos if p.name in placed and p.position is not None]
    if not known:
        return [None] * len(photos)
    latitude, longitude = np.median([(p.latitude, p.longitude) for p in known], axis=0)
    scale = np.array([np.cos(np.radians(latitude)), 1.0]) * DEGREE_M
    result: list[tuple[float, float, float] | None] = []
    for photo in photos:
        position, axis = photo.position, photo.axis
        if photo.name not in placed or position is None:
            result.append(None)
            continue
        place: FloatArray = np.array([position.longitude - longitude, position.latitude - latitude]) * scale
        if axis is not None and axis[2] < -0.1 and photo.above_start_m:
            place = place + axis[:2] / -axis[2] * photo.above_start_m
        result.append((float(place[0]), float(place[1]), position.height_m or 0.0))
    return result

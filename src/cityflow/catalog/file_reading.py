"""What is read of each file of a catalog: its digest, and what its header says."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from cityflow.catalog.file_questions import Question, packed_as
from cityflow.catalog.kept_answers import state_of
from cityflow.errors import CityflowError
from cityflow.io.catalog.stac import sha256_of
from cityflow.io.fetch import local_file
from cityflow.io.given_files import check_plain
from cityflow.io.images.image_header import ImageHeader, image_header
from cityflow.io.points.las import Sample, sample
from cityflow.io.points.las_header import LasHeader, read_header

VERSION = 2
"""Raise it when anything else is read: what was kept before is then read again."""
F = TypeVar("F")


@dataclass(frozen=True, slots=True)
class Digest:
    """SHA-256 (hexadecimal) and size in bytes of a file."""

    checksum: str
    size: int


@dataclass(frozen=True, slots=True)
class LidarContents:
    """Header of a LiDAR file, and what some of its points say."""

    header: LasHeader
    sample: Sample


@dataclass(frozen=True, slots=True)
class ImageContents:
    """Header of an image file, and whether its end is missing."""

    header: ImageHeader
    is_cut_off: bool


@dataclass(frozen=True, slots=True)
class LidarFile:
    """A LiDAR file, as far as it is read."""

    digest: Digest
    contents: LidarContents


@dataclass(frozen=True, slots=True)
class ImageFile:
    """An image file, as far as it is read."""

    digest: Digest
    contents: ImageContents


@dataclass(frozen=True, slots=True)
class CheckJob:
    """A file to check; `kind` is ``lidar``, ``image`` or empty, where nothing but its digest is asked."""

    href: str
    kind: str


@dataclass(frozen=True, slots=True)
class CheckedFile:
    """A file whose digest and contents may each be read, or not, for a reason."""

    digest: Digest | Exception
    contents: LidarContents | ImageContents | Exception | None


def read_digest(path: str) -> Digest:
    """Raises OSError, and CatalogError where it is no plain file."""
    check_plain(path)
    return Digest(*sha256_of(path))


def lidar_contents(path: str) -> LidarContents:
    """Raises CatalogError where it is missing, damaged or no LiDAR file."""
    return LidarContents(read_header(path), sample(path))


def image_contents(path: str) -> ImageContents:
    """Raises CatalogError where it is missing or no image."""
    with local_file(path) as local:
        return ImageContents(image_header(local), is_cut_off(local))


def read_lidar(path: str) -> LidarFile:
    contents = lidar_contents(path)
    return LidarFile(read_digest(path), contents)


def read_image(path: str) -> ImageFile:
    contents = image_contents(path)
    return ImageFile(read_digest(path), contents)


def check_file(job: CheckJob) -> CheckedFile:
    """All that can be read, and why the rest cannot."""
    contents: LidarContents | ImageContents | Exception | None = None
    if job.kind == "lidar":
        contents = _tried(lidar_contents, job.href)
    elif job.kind == "image":
        contents = _tried(image_contents, job.href)
    return CheckedFile(_tried(read_digest, job.href), contents)


def _tried(read: Callable[[str], F], path: str) -> F | Exception:
    try:
        return read(path)
    except (CityflowError, OSError) as error:
        return error


def is_cut_off(path: Path) -> bool:
    """A JPEG ends with a mark of its own, perhaps followed by a little padding."""
    if path.suffix.lower() not in (".jpg", ".jpeg"):
        return False
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 4096))
        return b"\xff\xd9" not in file.read()


def bytes_of(paths: Iterable[str]) -> float:
    """Of all local files that are there."""
    total = 0.0
    for path in paths:
        with suppress(OSError):
            total += 0 if "://" in path else Path(path).stat().st_size
    return total


def _question(name: str, ask: Callable[[str], F], kind: type[F]) -> Question[str, F]:
    def key(path: str) -> str:
        state = state_of(path)
        place = path if "://" in path else Path(path).absolute().as_posix()
        return f"{kind.__name__} {VERSION} {path} {place} {state}" if state else ""

    return Question(name, ask, key, *packed_as(kind))


LIDAR_FILES = _question("LiDAR files", read_lidar, LidarFile)
IMAGE_FILES = _question("images", read_image, ImageFile)
DIGESTS = _question("files", read_digest, Digest)
CHECKED_FILES = Question("files", check_file)

"""Bundler's output file: cameras with focal length and two radial terms, y up and z backward, and tie points."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import PHOTO_FLIP, nearest_rotation
from cityflow.io.given_files import MODEL_MB, check_plain
from cityflow.io.orientation.camera_calibration import with_distortion
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile, SizeOf

LISTS = ("list.txt", "image_list.txt", "images.txt", "list_tmp.txt")


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`."""
    return read_bundler(given.path, given.size_of, given.options.get("bundler_list"))


def read_bundler(path: str | Path, size_of: SizeOf, names_file: str | Path | None = None) -> OrientationModel:
    """The model of a ``bundle.out`` with the list of its images.

    Parameters
    ----------
    size_of : width and height of an image by its name in the list, None where it cannot be read; the file does not state them, and its principal
        point is the centre of the image
    names_file : one image a line; by default ``list.txt`` and the like beside the file

    Raises
    ------
    CatalogError
        Where a file is missing or damaged, or they do not belong together.
    """
    place = Path(path)
    names = _names(place, names_file)
    try:
        cameras, sparse = _numbers(place)
    except (OSError, ValueError) as error:
        raise CatalogError(
            f"this is no Bundler file ({error})", where=str(path), remedy="name the file bundle.out"
        ) from error
    if len(cameras) != len(names):
        problem = f"{len(cameras)} cameras, but {len(names)} images in the list"
        raise CatalogError(problem, where=str(path), remedy="name the list that the model was made with")
    images: list[OrientedImage] = []
    left_out: list[LeftOut] = []
    for name, values in zip(names, cameras, strict=True):
        outcome = _image(name, values, size_of)
        (images if isinstance(outcome, OrientedImage) else left_out).append(outcome)  # type: ignore[arg-type]
    kept, twice = in_order(images)
    return OrientationModel(kept, sparse, (*left_out, *twice))


def _image(name: str, values: FloatArray, size_of: SizeOf) -> OrientedImage | LeftOut:
    focal, k1, k2 = (float(v) for v in values[:3])
    if focal <= 0:
        return LeftOut(name, "the model has no orientation of this image", "orient it, or do without")
    size = size_of(name)
    if size is None:
        return LeftOut(name, "the image is in the model, but cannot be read, and the model does not state its size")
    try:
        rotation = PHOTO_FLIP @ nearest_rotation(values[3:12].reshape(3, 3))
    except ValueError as error:
        return LeftOut(name, str(error), "orient the image again")
    width, height = size
    plain = Camera(width, height, focal, focal, width / 2, height / 2)
    camera = with_distortion(plain, (k1, k2, 0.0, 0.0))
    return OrientedImage(name, camera, rotation, -rotation.T @ (PHOTO_FLIP @ values[12:15]))


def _names(path: Path, names_file: str | Path | None) -> list[str]:
    """First word of each line; focal lengths may follow it."""
    choices = [Path(names_file)] if names_file else [path.parent / n for n in LISTS] + [path.parent.parent / LISTS[0]]
    for choice in choices:
        if choice.is_file():
            lines = choice.read_text(encoding="utf-8", errors="replace").splitlines()
            return [line.split()[0] for line in lines if line.strip()]
    raise CatalogError(
        "the list of images is missing", where=str(choices[0]), remedy="name it with --bundler-list FILE"
    )


def _numbers(path: Path) -> tuple[FloatArray, FloatArray]:
    """(n, 15) values of the cameras: f k1 k2, R, t; and (m, 3) points."""
    check_plain(path, MODEL_MB)
    with path.open(encoding="utf-8", errors="replace") as file:
        lines = (line for line in file if line.strip() and not line.startswith("#"))
        count, points = (int(v) for v in next(lines, "").split())
        most = path.stat().st_size  # a number takes a byte at least
        if not (0 <= count <= most and 0 <= points <= most):
            raise ValueError(f"it says that it has {count} cameras and {points} points")
        cameras = np.array([_take(lines, 5) for _ in range(count)], np.float64).reshape(-1, 15)
        sparse = np.empty((points, 3))
        for i in range(points):
            sparse[i] = _take(lines, 3)[:3]
    return cameras, sparse


def _take(lines: Iterator[str], count: int) -> list[float]:
    """Numbers of the next lines; of a point's three only the first is looked at."""
    taken = [next(lines, None) for _ in range(count)]
    if taken[-1] is None:
        raise ValueError("it ends too early")
    kept = taken[:1] if count == 3 else taken
    return [float(v) for line in kept if line is not None for v in line.split()]

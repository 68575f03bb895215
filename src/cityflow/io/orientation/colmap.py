"""COLMAP's sparse models, text and binary: read into oriented images, written as text.

Files of newer versions (rigs, frames) say nothing that images do not say, and are not read.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import from_quaternion, to_quaternion
from cityflow.io.given_files import MODEL_MB, check_plain
from cityflow.io.orientation.colmap_binary import binary_cameras, binary_images, binary_points
from cityflow.io.orientation.colmap_cameras import REMEDY, camera_of, model_of
from cityflow.io.orientation.colmap_text import text_cameras, text_images, text_points
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile

NESTED = ("", "sparse/0", "sparse", "0")
"""Where people's model folders keep the files."""


class _Files(NamedTuple):
    cameras: Path
    images: Path
    points: Path


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`."""
    return read_colmap(given.path)


def read_colmap(folder: str | Path) -> OrientationModel:
    """The model in a folder with ``cameras``, ``images`` and ``points3D`` as ``.bin`` or ``.txt``; where both are there, binary.

    Images whose camera cannot be used are left out by name.

    Raises
    ------
    CatalogError
        Where there is no model, or a file of it is damaged.
    """
    files = _found(Path(folder))
    for file in files:
        check_plain(file, MODEL_MB)
    binary = files.images.suffix == ".bin"
    try:
        cameras = list(binary_cameras(files.cameras) if binary else text_cameras(files.cameras))
        poses = list(binary_images(files.images) if binary else text_images(files.images))
        sparse = np.empty((0, 3))
        if files.points.exists():
            sparse = binary_points(files.points) if binary else text_points(files.points)
    except (ValueError, OSError) as error:
        remedy = "export the model again (colmap model_converter)"
        raise CatalogError(f"the COLMAP model is damaged ({error})", where=str(folder), remedy=remedy) from error
    known, bad = _usable(cameras)
    images, left_out = [], []
    for name, camera_id, quaternion, translation in poses:
        if camera_id not in known:
            problem = bad.get(camera_id, f"the model has no camera {camera_id}")
            left_out.append(LeftOut(name, problem, REMEDY))
            continue
        try:
            rotation = from_quaternion(quaternion)
        except ValueError as error:
            left_out.append(LeftOut(name, str(error), "orient the image again"))
            continue
        images.append(OrientedImage(name, known[camera_id], rotation, -rotation.T @ translation, str(camera_id)))
    kept, twice = in_order(images)
    finite = np.isfinite(sparse).all(axis=1)
    notes = [f"{int((~finite).sum()):,} sparse points are no finite numbers and left out"] if not finite.all() else []
    return OrientationModel(kept, sparse[finite], tuple(left_out + twice), tuple(notes))


def _found(folder: Path) -> _Files:
    for place in NESTED:
        for suffix in (".bin", ".txt"):
            files = _Files(*(folder / place / f"{stem}{suffix}" for stem in ("cameras", "images", "points3D")))
            if files.cameras.exists() and files.images.exists():
                return files
    raise CatalogError(
        "no COLMAP model here", where=str(folder), remedy="name the folder with cameras and images, .txt or .bin"
    )


def _usable(
    cameras: Iterable[tuple[int, str, int, int, tuple[float, ...]]],
) -> tuple[dict[int, Camera], dict[int, str]]:
    good: dict[int, Camera] = {}
    bad: dict[int, str] = {}
    for camera_id, model, width, height, params in cameras:
        try:
            good[camera_id] = camera_of(model, width, height, params)
        except ValueError as error:
            bad[camera_id] = str(error)
    return good, bad


def write_colmap(
    folder: str | Path,
    images: Iterable[OrientedImage],
    sparse: FloatArray,
    origin: tuple[float, float, float] = (0, 0, 0),
) -> list[Path]:
    """Write a COLMAP text model without tracks, with a camera for each head; the files written.

    Parameters
    ----------
    sparse : (N, 3) world metres
    origin : subtracted from all coordinates; large ones would cost digits of the translations
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    ordered = list(images)
    numbers: dict[tuple[str, Camera], int] = {}
    for image in ordered:
        numbers.setdefault((image.head, image.camera), len(numbers) + 1)
    texts = {
        "cameras.txt": _camera_lines(numbers),
        "images.txt": _image_lines(ordered, numbers, np.asarray(origin, np.float64)),
        "points3D.txt": _point_lines(np.asarray(sparse, np.float64) - origin),
    }
    for name, text in texts.items():
        (place / name).write_text(text, encoding="utf-8")
    return [place / name for name in texts]


def _camera_lines(numbers: Mapping[tuple[str, Camera], int]) -> str:
    lines = ["# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]"]
    for (_, camera), number in numbers.items():
        model, params = model_of(camera)
        lines.append(f"{number} {model} {camera.width} {camera.height} {' '.join(map(_digits, params))}")
    return "\n".join(lines) + "\n"


def _image_lines(images: list[OrientedImage], numbers: Mapping[tuple[str, Camera], int], origin: FloatArray) -> str:
    lines = ["# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then POINTS2D[] (none)"]
    for i, image in enumerate(images, 1):
        translation = -image.rotation @ (image.centre - origin)
        values = " ".join(_digits(v) for v in (*to_quaternion(image.rotation), *translation))
        lines += [f"{i} {values} {numbers[image.head, image.camera]} {image.name}", ""]
    return "\n".join(lines) + "\n"


def _point_lines(sparse: FloatArray) -> str:
    lines = ["# POINT3D_ID X Y Z R G B ERROR TRACK[] (none)"]
    lines += [f"{i} {_digits(x)} {_digits(y)} {_digits(z)} 128 128 128 0" for i, (x, y, z) in enumerate(sparse, 1)]
    return "\n".join(lines) + "\n"


def _digits(value: float) -> str:
    return repr(float(value))

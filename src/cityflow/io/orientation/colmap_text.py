"""The three text files of a COLMAP model as plain values."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cityflow.core.arrays import FloatArray

CameraLine = tuple[int, str, int, int, tuple[float, ...]]
ImageLine = tuple[str, int, FloatArray, FloatArray]


def text_cameras(path: Path) -> Iterator[CameraLine]:
    """Id, model, width, height, parameters of each camera. Raises ValueError with the line's number."""
    for number, line in _lines(path):
        if not line:
            continue
        try:
            camera_id, model, width, height, *params = line.split()
            yield int(camera_id), model, int(width), int(height), tuple(float(p) for p in params)
        except ValueError as error:
            raise ValueError(f"{path.name}, line {number}: {error}") from error


def text_images(path: Path) -> Iterator[ImageLine]:
    """Name, camera id, (4,) quaternion and (3,) translation of each image.

    Each image's line is followed by one of its points, which may be empty; some programs leave it away, which shows by the next line being an
    image's. Raises ValueError with the line's number.
    """
    points_next = False
    for number, line in _lines(path):
        if points_next and _is_points(line):
            points_next = False
            continue
        if not line:
            continue
        try:
            _, *pose, camera_id, name = line.split(maxsplit=9)
            values = np.array([float(v) for v in pose])
            if len(values) != 7 or not np.isfinite(values).all():
                raise ValueError("an image has four numbers of rotation and three of translation")
            yield name, int(camera_id), values[:4], values[4:]
        except ValueError as error:
            raise ValueError(f"{path.name}, line {number}: {error}") from error
        points_next = True


def _is_points(line: str) -> bool:
    fields = line.split()
    return len(fields) % 3 == 0 and all(_is_number(f) for f in fields[:12])


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def text_points(path: Path) -> FloatArray:
    """(N, 3) coordinates of the points, as they are in the file. Raises ValueError with the line's number."""
    values: list[tuple[float, float, float]] = []
    for number, line in _lines(path):
        if not line:
            continue
        try:
            _, x, y, z, *_ = line.split(maxsplit=4)
            values.append((float(x), float(y), float(z)))
        except ValueError as error:
            raise ValueError(f"{path.name}, line {number}: {error}") from error
    return np.array(values, np.float64).reshape(-1, 3)


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            if not line.startswith("#"):
                yield number, line.strip()

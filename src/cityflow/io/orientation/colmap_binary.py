"""The three binary files of a COLMAP model as plain values (little-endian, packed)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.io.orientation.colmap_cameras import BY_NUMBER
from cityflow.io.orientation.colmap_text import CameraLine, ImageLine

_COUNT = struct.Struct("<Q")
_CAMERA = struct.Struct("<iiQQ")
_IMAGE = struct.Struct("<i7di")
_POINT = struct.Struct("<Q3d3BdQ")
OBSERVATION_BYTES = 24
TRACK_BYTES = 8


class _Buffer:
    """Bytes read from front to back; what ends too early is a ValueError."""

    def __init__(self, path: Path) -> None:
        self.name, self.data, self.at = path.name, path.read_bytes(), 0

    def take(self, layout: struct.Struct) -> tuple[Any, ...]:
        try:
            values = layout.unpack_from(self.data, self.at)
        except struct.error as error:
            raise ValueError(f"{self.name} ends too early, at byte {self.at:,}") from error
        self.at += layout.size
        return values

    def text(self) -> str:
        end = self.data.find(b"\0", self.at)
        if end < 0:
            raise ValueError(f"{self.name} ends within a name, at byte {self.at:,}")
        value = self.data[self.at : end].decode("utf-8", "replace")
        self.at = end + 1
        return value

    def skip(self, size: int) -> None:
        self.at += size
        if self.at > len(self.data):
            raise ValueError(f"{self.name} ends too early, at byte {len(self.data):,}")


def binary_cameras(path: Path) -> Iterator[CameraLine]:
    """Id, model, width, height, parameters of each camera. Raises ValueError where the file is cut off or a model's number is unknown."""
    buffer = _Buffer(path)
    for _ in range(buffer.take(_COUNT)[0]):
        camera_id, number, width, height = buffer.take(_CAMERA)
        if number not in BY_NUMBER:
            raise ValueError(f"{path.name} has a camera model of the unknown number {number}")
        name, count = BY_NUMBER[number]
        yield camera_id, name, width, height, buffer.take(struct.Struct(f"<{count}d"))


def binary_images(path: Path) -> Iterator[ImageLine]:
    """Name, camera id, (4,) quaternion and (3,) translation of each image. Raises ValueError where the file is cut off."""
    buffer = _Buffer(path)
    for _ in range(buffer.take(_COUNT)[0]):
        _, *pose, camera_id = buffer.take(_IMAGE)
        name = buffer.text()
        buffer.skip(buffer.take(_COUNT)[0] * OBSERVATION_BYTES)
        yield name, camera_id, np.array(pose[:4]), np.array(pose[4:])


def binary_points(path: Path) -> FloatArray:
    """(N, 3) coordinates of the points. Raises ValueError where the file is cut off."""
    buffer = _Buffer(path)
    count = buffer.take(_COUNT)[0]
    if count * _POINT.size > len(buffer.data):
        raise ValueError(f"{path.name} is too short for {count:,} points")
    xyz = np.empty((count, 3))
    for i in range(count):
        _, x, y, z, *_, track = buffer.take(_POINT)
        xyz[i] = x, y, z
        buffer.skip(track * TRACK_BYTES)
    return xyz

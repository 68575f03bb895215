"""Collects convex faces of a scene and makes triangles of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.synthetic.mesh import Material, Part, TownMesh

Tint = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Look:
    """What a face is and how it is coloured: part, material, base colour (sRGB), unit (-1: none), seed of its pattern."""

    part: Part
    material: Material
    tint: Tint
    unit: int = -1
    seed: int = 0


@dataclass(frozen=True, slots=True)
class TextureFrame:
    """Origin (world metres) and unit vectors of a face's texture; (3,) each, or (K, 3) for one per face."""

    origin: FloatArray
    u: FloatArray
    v: FloatArray


@dataclass(slots=True)
class FaceSoup:
    """Batches of convex faces, all of one batch with the same number of corners."""

    _vertices: list[FloatArray] = field(default_factory=list)
    _triangles: list[IntArray] = field(default_factory=list)
    _frames: list[FloatArray] = field(default_factory=list)
    _looks: list[NDArray[np.int64]] = field(default_factory=list)
    _counts: list[int] = field(default_factory=list)
    _corners: int = 0

    def add(self, rings: FloatArray, look: Look, frame: TextureFrame) -> None:
        """Faces with corners `rings` (K, n, 3), world metres, counter-clockwise seen from outside."""
        faces, n, _ = rings.shape
        if faces == 0:
            return
        fan = np.column_stack([np.zeros(n - 2, np.int64), np.arange(1, n - 1), np.arange(2, n)])
        triangles = self._corners + (np.arange(faces) * n)[:, None, None] + fan
        self._vertices.append(rings.reshape(-1, 3))
        self._triangles.append(triangles.reshape(-1, 3))
        axes = [np.broadcast_to(a, (faces, 3)) for a in (frame.origin, frame.u, frame.v)]
        self._frames.append(np.repeat(np.concatenate(axes, axis=1), n - 2, axis=0))
        self._looks.append(np.array([look.part, look.material, *look.tint, look.unit, look.seed], np.int64))
        self._counts.append(faces * (n - 2))
        self._corners += faces * n

    def mesh(self) -> TownMesh:
        """All faces so far, in the order in which they came."""
        if not self._vertices:
            return _empty()
        frames = np.concatenate(self._frames)
        looks = np.repeat(np.array(self._looks), self._counts, axis=0)
        return TownMesh(
            np.concatenate(self._vertices),
            np.concatenate(self._triangles).astype(np.int32),
            looks[:, 0].astype(np.uint8),
            looks[:, 1].astype(np.uint8),
            looks[:, 5].astype(np.int32),
            looks[:, 2:5].astype(np.uint8),
            frames[:, :3].copy(),
            frames[:, 3:6].copy(),
            frames[:, 6:].copy(),
            looks[:, 6].astype(np.uint32),
        )


def _empty() -> TownMesh:
    def zeros(*shape: int) -> FloatArray:
        return np.zeros(shape)

    return TownMesh(
        zeros(0, 3),
        np.zeros((0, 3), np.int32),
        np.zeros(0, np.uint8),
        np.zeros(0, np.uint8),
        np.zeros(0, np.int32),
        np.zeros((0, 3), np.uint8),
        zeros(0, 3),
        zeros(0, 3),
        zeros(0, 3),
        np.zeros(0, np.uint32),
    )


def plane_frame(origin: FloatArray, normal: FloatArray) -> TextureFrame:
    """Texture frame of planes (…, 3): u along the contour lines, v up the slope; world x and y on level faces."""
    normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    flat = np.hypot(normal[..., 0], normal[..., 1]) < 1e-6
    along = np.stack([-normal[..., 1], normal[..., 0], np.zeros_like(flat, np.float64)], axis=-1)
    along = np.where(flat[..., None], np.array([1.0, 0.0, 0.0]), along)
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    return TextureFrame(origin, along, np.cross(normal, along))

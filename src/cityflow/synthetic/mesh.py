"""The synthetic town as triangles: what rays are cast against, by cameras and by scanners."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import ByteArray, FloatArray


class Part(IntEnum):
    """What a triangle belongs to."""

    GROUND = 0
    STREET = 1
    ROOF = 2
    WALL = 3
    OVERHANG = 4  # underside and edge of a roof overhang
    WINDOW = 5
    DOOR = 6
    FOLIAGE = 7
    TRUNK = 8
    CAR = 9
    WATER = 10
    BRIDGE = 11
    PIPE = 12
    CHIMNEY = 13


class Material(IntEnum):
    """How a triangle is coloured; a procedural texture each."""

    GRASS = 0
    ASPHALT = 1
    PAVING = 2
    SOIL = 3
    ROOF_TILE = 4
    SLATE = 5
    BITUMEN = 6
    GRAVEL = 7
    BRICK = 8
    PLASTER = 9
    WOOD = 10
    GLASS = 11
    METAL = 12
    LEAF = 13
    BARK = 14
    PAINT = 15
    WATER = 16
    CONCRETE = 17


@dataclass(frozen=True, slots=True)
class TownMesh:
    """Triangles with what a renderer and a truth map need of each.

    Attributes
    ----------
    vertices : (V, 3) float64, world metres
    triangles : (T, 3) int32, counter-clockwise seen from outside
    part : (T,) uint8, `Part`
    material : (T,) uint8, `Material`
    unit : (T,) int32, index of the unit in `Town.units`, -1 for none
    tint : (T, 3) uint8, base colour as sRGB
    texture_origin : (T, 3) float64 world metres; texture_u, texture_v : (T, 3) float64 unit vectors in the plane of the triangle. Texture
        coordinates of a point p are (p - origin)·u and (p - origin)·v, metres, so that all triangles of one face continue each other's pattern
    seed : (T,) uint32, makes the pattern of a face its own
    """

    vertices: FloatArray
    triangles: NDArray[np.int32]
    part: ByteArray
    material: ByteArray
    unit: NDArray[np.int32]
    tint: ByteArray
    texture_origin: FloatArray
    texture_u: FloatArray
    texture_v: FloatArray
    seed: NDArray[np.uint32]

"""How much of the sky a point sees, so that gaps, yards and the insides of trees are dark.

Visibility changes slowly, so it is cast from the points of a lattice laid on each face, anchored to the face and not to the image, and
interpolated between them. Points of the lattice are found as an image comes across them, in a hash table.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.core.parameters import Parameters
from cityflow.synthetic.caster import Scene, Surfaces
from cityflow.synthetic.mesh import Material

EMPTY = np.int64(-1)
FIRST_SLOTS = 1 << 16
OFF_SURFACE_M = 0.01
LEAF_CUBE_M = 0.5
UNDERSIDE_SHARE = 0.5
"""Of faces that look down: they see no sky, this dims what the ground throws at them."""


class AmbientParameters(Parameters):
    """Lattice and rays of the sky's visibility."""

    rays: int = Field(
        12, ge=0, le=256, description="directions that are tested per lattice point; 0: the sky is never occluded"
    )
    step_m: float = Field(1.0, gt=0.05, le=10, description="distance of lattice points, metres")


def sky_of(scene: Scene, parameters: AmbientParameters) -> SkyLattice:
    """The lattice of a scene, with what earlier images found: its values do not depend on who asked first."""
    known = scene.remembered.get(parameters)
    if not isinstance(known, SkyLattice):
        known = scene.remembered[parameters] = SkyLattice(scene, parameters)
    return known


class SkyLattice:
    """Sky visibility of one scene."""

    def __init__(self, scene: Scene, parameters: AmbientParameters) -> None:
        self.scene, self.parameters = scene, parameters
        self.face = _faces(scene.surfaces)
        self.count = 0
        self.keys = np.full(FIRST_SLOTS, EMPTY)
        self.values = np.ones(FIRST_SLOTS, np.float32)
        self.leaf: BoolArray = scene.surfaces.material == int(Material.LEAF)
        self.directions = _hemisphere(parameters.rays)

    def share(self, points: FloatArray, triangle: IntArray) -> Float32Array:
        """(N,) share of the sky in front of the face that is open at each point.

        Parameters
        ----------
        points : (N, 3) float64, metres from the scene's origin
        triangle : (N,) int64, on which each point lies; -1 for none
        """
        share = np.ones(len(points), np.float32)
        if self.parameters.rays == 0:
            return share
        step, surfaces = self.parameters.step_m, self.scene.surfaces
        faced = np.where(triangle >= 0, self.face[triangle], -1)
        complete = False
        while not complete:
            room = len(self.keys) // 2 - self.count
            new = NewPoints(np.empty(room, np.int64), np.empty(room, np.int64), np.empty((room, 3)))
            count, complete = _claim(points, faced, surfaces, self.leaf, step, self.keys, new)
            on = new.faces[:count]
            self.values[new.slots[:count]] = self._cast(new.places[:count], surfaces.normal[on], self.leaf[on])
            self.count += count
            if not complete:
                self._grow()
        _look_up(points, faced, surfaces, self.leaf, step, self.keys, self.values, share)
        return share

    def _cast(self, places: FloatArray, normal: FloatArray, leaf: BoolArray) -> Float32Array:
        """(M,) open shares of the sky; leaves look upwards."""
        normal = np.where(leaf[:, None], (0.0, 0.0, 1.0), normal)
        level = np.hypot(normal[:, 0], normal[:, 1])
        flat = level < 1e-6
        u = np.column_stack([-normal[:, 1], normal[:, 0], np.zeros(len(normal))]) / np.where(flat, 1.0, level)[:, None]
        u[flat] = (1.0, 0.0, 0.0)
        frames = np.stack([u, np.cross(normal, u), normal], axis=1)
        rays = np.einsum("rk,mkj->mrj", self.directions, frames).reshape(-1, 3)
        origins = np.repeat(places + OFF_SURFACE_M * normal, len(self.directions), axis=0)
        upward = rays[:, 2] > 0.0
        is_open = np.zeros(len(rays), bool)
        is_open[upward] = ~self.scene.occluded(origins[upward], rays[upward])
        shape = len(places), len(self.directions)
        total, seen = (v.reshape(shape).sum(axis=1) for v in (upward, is_open))
        return np.where(total > 0, seen / np.maximum(total, 1), UNDERSIDE_SHARE).astype(np.float32)

    def _grow(self) -> None:
        """Twice the slots, with what is known moved over."""
        keys, values = np.full(2 * len(self.keys), EMPTY), np.ones(2 * len(self.keys), np.float32)
        _move(self.keys, self.values, keys, values)
        self.keys, self.values = keys, values


def _faces(surfaces: Surfaces) -> IntArray:
    """(T,) first triangle of one seed in the same plane as each triangle, which stands for the face."""
    _, first, inverse = np.unique(_plane_keys(surfaces), return_index=True, return_inverse=True)
    return first[inverse].astype(np.int64)


def _hemisphere(count: int) -> FloatArray:
    """(count, 3) directions about +z, dense where a level surface gets most light (cosine law)."""
    number = np.arange(count) + 0.5
    radius = np.sqrt(number / max(count, 1))
    angle = number * (np.pi * (3.0 - np.sqrt(5.0)))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1.0 - radius**2)])


@njit(cache=True, nogil=True)
def _mixed(h: Any) -> Any:
    """63 bits that look random."""
    v = np.uint64(h)
    v ^= v >> np.uint64(31)
    v *= np.uint64(0x9E3779B97F4A7C15)
    v ^= v >> np.uint64(29)
    v *= np.uint64(0xC2B2AE3D27D4EB4F)
    v ^= v >> np.uint64(32)
    return np.int64(v >> np.uint64(1))


@njit(cache=True, nogil=True)
def _plane_key(k: int, surfaces: Surfaces) -> Any:
    """The same for triangles of one seed in one plane."""
    h = _mixed(surfaces.seed[k] + 7)
    for j in range(3):
        h = _mixed(h + np.int64(np.floor(surfaces.normal[k, j] * 5000.0 + 0.5)))
    return _mixed(h + np.int64(np.floor(surfaces.offset[k] * 200.0 + 0.5)))


@njit(cache=True, nogil=True)
def _plane_keys(surfaces: Surfaces) -> IntArray:
    keys = np.empty(len(surfaces.seed), np.int64)
    for k in range(len(keys)):
        keys[k] = _plane_key(k, surfaces)
    return keys


@njit(cache=True, nogil=True)
def _leaf_key(point: FloatArray) -> Any:
    """The same for all leaves in one cube."""
    h = np.int64(3)
    for j in range(3):
        h = _mixed(h + np.int64(np.floor(point[j] / LEAF_CUBE_M)))
    return h


@njit(cache=True, nogil=True)
def _slot(keys: IntArray, key: Any) -> Any:
    """Where a key stands, or the empty place where it belongs."""
    mask = len(keys) - 1
    at = key & mask
    while keys[at] != EMPTY and keys[at] != key:
        at = (at + 1) & mask
    return at


@njit(cache=True, nogil=True)
def _in_face(point: FloatArray, k: int, surfaces: Surfaces, leaf: BoolArray) -> tuple[float, float]:
    """Texture coordinates; for leaves, that have one value per cube, anything that changes with the point."""
    if leaf[k]:
        return 100.0 * point[0] + point[2], 100.0 * point[1] - point[2]
    frame, s, t = surfaces.texture[k], 0.0, 0.0
    for j in range(3):
        s += (point[j] - frame[0, j]) * frame[1, j]
        t += (point[j] - frame[0, j]) * frame[2, j]
    return s, t


class NewPoints(NamedTuple):
    """Room for new lattice points: slot, triangle, and (N, 3) place of each."""

    slots: IntArray
    faces: IntArray
    places: FloatArray


@njit(cache=True, nogil=True)
def _claim(
    points: FloatArray,
    triangle: IntArray,
    surfaces: Surfaces,
    leaf: BoolArray,
    step: float,
    keys: IntArray,
    new: NewPoints,
) -> tuple[int, bool]:
    """Enters the lattice points about all samples into `keys`; slots, triangles and places of new ones go to `new`.

    Returns how many there are, and whether they found room.
    """
    slots, faces, places = new
    count, last = 0, (np.int64(-1), np.int64(0), np.int64(0))
    for n in range(len(triangle)):
        k = triangle[n]
        if k < 0:
            continue
        s, t = _in_face(points[n], k, surfaces, leaf)
        i, j = np.int64(np.floor(s / step)), np.int64(np.floor(t / step))
        if last == (k, i, j):
            continue
        last = (k, i, j)
        face = _leaf_key(points[n]) if leaf[k] else _mixed(k)
        for corner in range(1 if leaf[k] else 4):
            ci, cj = (0, 0) if leaf[k] else (i + (corner & 1), j + (corner >> 1))
            key = _mixed(_mixed(face + ci) + cj)
            at = _slot(keys, key)
            if keys[at] == key:
                continue
            if count == len(slots):
                return count, False
            keys[at] = key
            slots[count], faces[count] = at, k
            _place(points[n], (ci * step, cj * step), k, surfaces, leaf, places[count])
            count += 1
    return count, True


@njit(cache=True, nogil=True)
def _place(
    point: FloatArray, at: tuple[float, float], k: int, surfaces: Surfaces, leaf: BoolArray, out: FloatArray
) -> None:
    """Where a lattice point is: the middle of a cube of leaves, or `at` texture coordinates in a face's plane."""
    if leaf[k]:
        for j in range(3):
            out[j] = (np.floor(point[j] / LEAF_CUBE_M) + 0.5) * LEAF_CUBE_M
        return
    frame, axis = surfaces.texture[k], np.empty(3)
    along, off = 0.0, surfaces.offset[k]
    for j in range(3):
        out[j] = frame[0, j] + at[0] * frame[1, j] + at[1] * frame[2, j]
        # the terrain's frame is level whereas its triangles slope: the way into the plane is along the frame's own normal
        axis[j] = frame[1, (j + 1) % 3] * frame[2, (j + 2) % 3] - frame[1, (j + 2) % 3] * frame[2, (j + 1) % 3]
        along += axis[j] * surfaces.normal[k, j]
        off -= surfaces.normal[k, j] * out[j]
    if abs(along) > 0.2:
        for j in range(3):
            out[j] += axis[j] * off / along


@njit(cache=True, nogil=True)
def _look_up(
    points: FloatArray,
    triangle: IntArray,
    surfaces: Surfaces,
    leaf: BoolArray,
    step: float,
    keys: IntArray,
    values: Float32Array,
    share: Float32Array,
) -> None:
    """Bilinear between the four lattice points about each sample."""
    last = (np.int64(-1), np.int64(0), np.int64(0))
    four = np.ones(4)
    for n in range(len(triangle)):
        k = triangle[n]
        if k < 0:
            continue
        s, t = _in_face(points[n], k, surfaces, leaf)
        i, j = np.int64(np.floor(s / step)), np.int64(np.floor(t / step))
        if last != (k, i, j):
            last = (k, i, j)
            face = _leaf_key(points[n]) if leaf[k] else _mixed(k)
            for corner in range(4):
                ci, cj = (0, 0) if leaf[k] else (i + (corner & 1), j + (corner >> 1))
                four[corner] = values[_slot(keys, _mixed(_mixed(face + ci) + cj))]
        fs, ft = s / step - i, t / step - j
        share[n] = (four[0] * (1 - fs) + four[1] * fs) * (1 - ft) + (four[2] * (1 - fs) + four[3] * fs) * ft


@njit(cache=True, nogil=True)
def _move(keys: IntArray, values: Float32Array, into: IntArray, new_values: Float32Array) -> None:
    for i in range(len(keys)):
        if keys[i] != EMPTY:
            at = _slot(into, keys[i])
            into[at], new_values[at] = keys[i], values[i]

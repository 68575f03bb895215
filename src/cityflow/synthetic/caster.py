"""A town mesh made ready for rays: which triangle a ray meets first, and where exactly."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.kernels import njit
from cityflow.synthetic.mesh import Part, TownMesh

NOTHING = -1
LEVEL_PARTS = (Part.GROUND, Part.STREET, Part.WATER, Part.BRIDGE)
"""Their patterns are laid out on the map, so that neighbouring triangles of the terrain continue each other."""


class Surfaces(NamedTuple):
    """What is known of each triangle, (T, …); places are metres from the scene's origin.

    Attributes
    ----------
    normal : (T, 3) float64 unit vectors;  offset : (T,) float64, normal · any point of the triangle
    texture : (T, 3, 3) float64 rows origin, u, v
    tint : (T, 3) float32, linear reflectance;  material, part : (T,) uint8;  seed : (T,) int64
    """

    normal: FloatArray
    offset: FloatArray
    texture: FloatArray
    tint: Float32Array
    material: ByteArray
    part: ByteArray
    seed: IntArray


class Scene:
    """A mesh with its search tree; serves any number of images.

    Parameters
    ----------
    mesh : of one chunk of the town
    threads : of the ray caster

    Attributes
    ----------
    remembered : what algorithms found out about the mesh and want to know again for the next image
    """

    def __init__(self, mesh: TownMesh, threads: int = 1) -> None:
        import open3d as o3d

        self.mesh = mesh
        self.threads = threads
        self.remembered: dict[Hashable, object] = {}
        # whole metres, so that nothing is rounded when it is taken off
        self.origin: FloatArray = np.floor((mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2)
        self.surfaces = _surfaces(mesh, self.origin)
        self._tensor = cast(Any, o3d.core.Tensor)
        self._tree = o3d.t.geometry.RaycastingScene(nthreads=threads)
        local = np.ascontiguousarray(mesh.vertices - self.origin, np.float32)
        self._tree.add_triangles(self._tensor(local), self._tensor(np.ascontiguousarray(mesh.triangles, np.uint32)))

    def first_hits(self, origin: FloatArray, directions: FloatArray) -> tuple[IntArray, FloatArray]:
        """Triangle that each ray meets first, or NOTHING, and the length to it in units of `directions`, infinite for nothing.

        Parameters
        ----------
        origin : (3,) or (N, 3) float64, metres from the scene's origin
        directions : (N, 3) float64, of any length
        """
        found: dict[str, Any] = self._tree.cast_rays(self._rays(origin, directions), nthreads=self.threads)
        ids = found["primitive_ids"].numpy()
        triangles = np.where(ids == np.uint32(0xFFFFFFFF), NOTHING, ids.astype(np.int64))
        near = found["t_hit"].numpy().astype(np.float64)
        _refine(
            near, np.broadcast_to(np.asarray(origin, float), directions.shape), directions, triangles, self.surfaces
        )
        return triangles, near

    def occluded(self, origin: FloatArray, directions: FloatArray) -> BoolArray:
        """(N,) whether anything stands in the way of each ray."""
        return np.asarray(
            self._tree.test_occlusions(self._rays(origin, directions), nthreads=self.threads).numpy(), bool
        )

    def _rays(self, origin: FloatArray, directions: FloatArray) -> Any:
        rays = np.empty((len(directions), 6), np.float32)
        rays[:, :3] = origin
        rays[:, 3:] = directions
        return self._tensor(rays)


def _surfaces(mesh: TownMesh, origin: FloatArray) -> Surfaces:
    corners = (mesh.vertices - origin)[mesh.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(length > 0, length, 1.0)
    texture = np.stack([mesh.texture_origin - origin, mesh.texture_u, mesh.texture_v], axis=1)
    level = np.isin(mesh.part, [int(p) for p in LEVEL_PARTS])
    texture[level] = np.stack([-origin, [1.0, 0, 0], [0, 1.0, 0]])
    return Surfaces(
        normal,
        np.einsum("ij,ij->i", normal, corners[:, 0]),
        texture,
        linear(mesh.tint),
        mesh.material,
        mesh.part,
        mesh.seed.astype(np.int64),
    )


def linear(srgb: NDArray[np.uint8]) -> Float32Array:
    """Reflectance 0…1 of sRGB colours (IEC 61966-2-1)."""
    c = srgb.astype(np.float64) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4).astype(np.float32)


@njit(cache=True, nogil=True)
def _refine(
    length: FloatArray, origin: FloatArray, directions: FloatArray, triangles: IntArray, surfaces: Surfaces
) -> None:
    """Replaces the tree's float32 lengths by those to the triangles' planes, unless the ray grazes the plane."""
    for i in range(len(triangles)):
        k = triangles[i]
        if k < 0:
            continue
        above, slope = surfaces.offset[k], 0.0
        for j in range(3):
            above -= surfaces.normal[k, j] * origin[i, j]
            slope += surfaces.normal[k, j] * directions[i, j]
        if abs(slope) > 1e-9 and abs(above / slope - length[i]) < 1e-4 * length[i]:
            length[i] = above / slope

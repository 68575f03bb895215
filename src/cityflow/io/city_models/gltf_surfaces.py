"""The faces of a tile's buildings as triangles with all vertex attributes, one batch per page of an atlas.

Every face has corners of its own, because neighbours share neither normal nor texture coordinates.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building, Face, Lod, Polyhedron
from cityflow.core.texture import BuildingTexture, Colour, FaceTexture, PlainFace, Shell
from cityflow.geometry.polygon_triangulation import triangulate_faces
from cityflow.geometry.polyhedron import face_arrays, project, projection_normals
from cityflow.io.city_models.appearance import BARE, Appearance, Look, looks_of
from cityflow.io.city_models.obj import MATERIALS

UNTEXTURED = -1


@dataclass(frozen=True, slots=True)
class SurfaceRow:
    """What is said of one face: its building by number, and how it looks if not as it always did."""

    building: int
    face: Face
    look: Look | None


@dataclass(frozen=True, slots=True, eq=False)
class Surfaces:
    """All faces of some buildings.

    Attributes
    ----------
    xyz : (C, 3) float64, world metres, of every corner
    uvd : (C, 3) u from the left, v from below, d in metres; zero where the face has no texture
    face : (C,) index of each corner's face among `rows`
    triangles : (T, 3) positions among the corners, counter-clockwise seen from outside
    page : (F,) page of each face, or `UNTEXTURED`
    colour : (F, 3) uint8, sRGB, of faces without a texture
    rows : what is said of each face
    """

    xyz: FloatArray
    uvd: FloatArray
    face: IntArray
    triangles: IntArray
    page: IntArray
    colour: IntArray
    rows: tuple[SurfaceRow, ...]

    @property
    def building(self) -> IntArray:
        """(F,) building of each face."""
        return np.array([row.building for row in self.rows], np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Corners and triangles that share a material: positions among `Surfaces`' corners, and (T, 3) positions among these."""

    page: int
    corners: IntArray
    triangles: IntArray


def surfaces_of(buildings: Sequence[Building], appearance: Appearance, lod: Lod = Lod.LOD22) -> Surfaces:
    """Triangles, colours and texture coordinates of the buildings at one level of detail.

    Textures count for LoD2.2 only: coarser solids have other faces.
    """
    parts = [_shell(*shell) for shell in _shells(buildings, appearance if lod is Lod.LOD22 else BARE, lod)]
    corners = np.cumsum([0, *(len(p.xyz) for p in parts)])[:-1]
    faces = np.cumsum([0, *(len(p.rows) for p in parts)])[:-1]
    return Surfaces(
        xyz=np.concatenate([np.empty((0, 3)), *(p.xyz for p in parts)]),
        uvd=np.concatenate([np.empty((0, 3)), *(p.uvd for p in parts)]),
        face=_joined([p.face + n for p, n in zip(parts, faces, strict=True)]),
        triangles=_joined([p.triangles + n for p, n in zip(parts, corners, strict=True)], (0, 3)),
        page=_joined([p.page for p in parts]),
        colour=_joined([p.colour for p in parts], (0, 3)),
        rows=tuple(row for p in parts for row in p.rows),
    )


def batches(surfaces: Surfaces) -> Iterator[Batch]:
    """A batch per page, in their order, the untextured faces first."""
    page = surfaces.page[surfaces.face[surfaces.triangles[:, 0]]]
    for number in np.unique(page).tolist():
        corners, triangles = np.unique(surfaces.triangles[page == number], return_inverse=True)
        yield Batch(number, corners, triangles.reshape(-1, 3))


def face_normals(xyz: FloatArray, surfaces: Surfaces) -> FloatArray:
    """(F, 3) unit normals of faces whose corners stand at `xyz` (C, 3); upwards where a face has no area."""
    a, b, c = (xyz[surfaces.triangles[:, i]] for i in range(3))
    vectors = np.zeros((len(surfaces.rows), 3))
    np.add.at(vectors, surfaces.face[surfaces.triangles[:, 0]], np.cross(b - a, c - a))
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, lengths, out=np.tile([0.0, 0.0, 1.0], (len(vectors), 1)), where=lengths > 0)


def _shells(
    buildings: Sequence[Building], appearance: Appearance, lod: Lod
) -> Iterator[tuple[int, Shell, Polyhedron, BuildingTexture]]:
    for number, building in enumerate(buildings):
        if lod in building.solids:
            yield number, "solid", building.solids[lod], appearance.of(building)
        if lod is Lod.LOD22 and building.beyond is not None:
            yield number, "beyond", building.beyond, appearance.of(building)
        for one in building.installations if lod is Lod.LOD22 else ():
            if one.is_of_solid:
                continue
            yield number, "installation", one.surfaces, BARE.of(building)


def _shell(number: int, shell: Shell, solid: Polyhedron, texture: BuildingTexture) -> Surfaces:
    arrays = face_arrays(solid)
    start = arrays.ring_start[arrays.face_start]
    triangles, uvd = np.empty((0, 3), np.int64), np.zeros((len(arrays.corners), 3))
    if len(arrays.corners):
        flat = project(arrays, projection_normals(arrays))
        triangles, _ = triangulate_faces(flat, arrays.ring_start, arrays.face_start)
    looks = looks_of(texture, shell)
    rows = tuple(SurfaceRow(number, face, looks.get(index)) for index, face in enumerate(solid.faces))
    for index, look in looks.items():
        if isinstance(look, FaceTexture):
            uvd[start[index] : start[index + 1]] = np.concatenate(look.rings)
    return Surfaces(
        xyz=np.asarray(solid.vertices, np.float64).reshape(-1, 3)[arrays.corners],
        uvd=uvd,
        face=np.repeat(np.arange(len(rows)), np.diff(start)),
        triangles=triangles,
        page=np.array([row.look.page if isinstance(row.look, FaceTexture) else UNTEXTURED for row in rows], np.int64),
        colour=np.array([_colour(row) for row in rows], np.int64).reshape(-1, 3),
        rows=rows,
    )


def _colour(row: SurfaceRow) -> Colour:
    if isinstance(row.look, PlainFace):
        return row.look.colour
    r, g, b = MATERIALS["party_wall" if row.face.neighbour is not None else row.face.semantic.name.lower()]
    return round(r * 255), round(g * 255), round(b * 255)


def _joined(arrays: Sequence[IntArray], shape: tuple[int, ...] = (0,)) -> IntArray:
    return np.concatenate([np.empty(shape, np.int64), *arrays])

"""glTF 2.0, binary: the buildings of a tile batched by page of their atlas, with attributes; or its terrain under an ortho.

Positions are 32-bit floats about the origin of the tile's frame. glTF's y is up, so east, north, up become x, −z, y; readers of
3D Tiles turn them back. Feature ids (EXT_mesh_features) name a row of the table of buildings and one of the table of surfaces
(EXT_structural_metadata). Textures in the geometry of their root image have a third attribute, `_UVD`: (u·d, v·d, d), which a shader
interpolates and divides; plain coordinates stand beside it for readers without such a shader.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building, Lod, Semantic
from cityflow.io.attributes import described
from cityflow.io.city_models.appearance import BARE, Appearance, attributes_of_look
from cityflow.io.city_models.gltf_buffer import GltfBuffer
from cityflow.io.city_models.gltf_materials import Materials, linear, vertex_colours
from cityflow.io.city_models.gltf_metadata import EXTENSION as METADATA
from cityflow.io.city_models.gltf_metadata import Classes, Column, Table, columns_of, structural_metadata
from cityflow.io.city_models.gltf_surfaces import UNTEXTURED, Batch, Surfaces, batches, face_normals, surfaces_of
from cityflow.io.city_models.obj import MATERIALS
from cityflow.io.globe_frame import TileFrame

Json = Any
FEATURES = "EXT_mesh_features"
BUILDING, SURFACE = "building", "surface"
SEMANTICS = tuple(semantic.value for semantic in Semantic)
TERRAIN_MATERIAL = "terrain"


@dataclass(frozen=True, slots=True)
class GltfStyle:
    """How a file is written.

    Attributes
    ----------
    attribution : whom viewers name as the source
    lod : of the buildings
    pictures : contents of pages by path; those given are embedded, all others stay files beside
    """

    attribution: str = ""
    lod: Lod = Lod.LOD22
    pictures: Mapping[str, bytes] = field(default_factory=dict)


PLAIN_STYLE = GltfStyle()


def write_buildings_glb(
    name: str,
    buildings: Sequence[Building],
    frame: TileFrame,
    appearance: Appearance = BARE,
    style: GltfStyle = PLAIN_STYLE,
) -> bytes:
    """The buildings as one mesh, a primitive for each page and one for all faces without a texture.

    Parameters
    ----------
    appearance : of the folder that the file goes to; images are named from there. Triplets are written where its textures are not rectified

    Returns
    -------
    the file; empty where no building has a face at this level of detail
    """
    surfaces = surfaces_of(buildings, appearance, style.lod)
    if not len(surfaces.triangles):
        return b""
    buffer = GltfBuffer()
    materials = Materials(appearance, buffer, style.pictures)
    xyz = frame.local(surfaces.xyz)
    writer = _Primitives(surfaces, y_up(xyz), y_up(face_normals(xyz, surfaces)), materials)
    primitives = [writer.primitive(batch) for batch in batches(surfaces)]
    document = document_of(name, primitives, materials, style.attribution)
    document["extensionsUsed"] = sorted({FEATURES, METADATA, *materials.extensions})
    document["extensions"] = {METADATA: structural_metadata(_tables(buildings, surfaces), buffer)}
    return buffer.glb(document)


def write_terrain_glb(
    name: str,
    vertices: FloatArray,
    triangles: IntArray,
    frame: TileFrame,
    appearance: Appearance = BARE,
    style: GltfStyle = PLAIN_STYLE,
) -> bytes:
    """A terrain with smooth normals, under the ortho of `appearance` where it has one.

    Parameters
    ----------
    vertices : (V, 3) world metres
    triangles : (T, 3) vertex numbers, counter-clockwise seen from above

    Returns
    -------
    the file; empty where there is no triangle
    """
    used, triangles = np.unique(triangles, return_inverse=True)
    if not len(used):
        return b""
    buffer, triangles = GltfBuffer(), triangles.reshape(-1, 3)
    materials = Materials(appearance, buffer, style.pictures)
    vertices = vertices[used]
    xyz = frame.local(vertices)
    attributes = {
        "POSITION": buffer.attribute(y_up(xyz).astype(np.float32), bounds=True),
        "NORMAL": buffer.attribute(y_up(smooth_normals(xyz, triangles)).astype(np.float32)),
    }
    if appearance.drape is None:
        material = materials.plain(TERRAIN_MATERIAL, linear(np.array(MATERIALS[TERRAIN_MATERIAL]) * 255))
    else:
        uv = from_above(appearance.drape.uv(vertices[:, :2]))
        attributes["TEXCOORD_0"] = buffer.attribute(uv.astype(np.float32))
        material = materials.page(appearance.drape.page)
    primitive = {"attributes": attributes, "indices": buffer.indices(triangles, len(xyz)), "material": material}
    return buffer.glb(document_of(name, [primitive], materials, style.attribution))


def y_up(xyz: FloatArray) -> FloatArray:
    """(N, 3) east, north, up → x, y, z of glTF."""
    return np.column_stack([xyz[:, 0], xyz[:, 2], -xyz[:, 1]])


def from_above(uv: FloatArray) -> FloatArray:
    """(N, 2) texture coordinates from the lower left corner → from the upper left one, as glTF counts."""
    return np.column_stack([uv[:, 0], 1 - uv[:, 1]])


def triplets(uvd: FloatArray) -> FloatArray:
    """(N, 3) u, v from the lower left corner, and d → (u·d, v·d, d) with v from the upper left one."""
    return np.column_stack([from_above(uvd[:, :2]) * uvd[:, 2:], uvd[:, 2]])


@dataclass(frozen=True, slots=True, eq=False)
class _Primitives:
    """Writes batches of `surfaces`; `xyz` of corners and `normals` of faces are in glTF's axes."""

    surfaces: Surfaces
    xyz: FloatArray
    normals: FloatArray
    materials: Materials

    def primitive(self, batch: Batch) -> Json:
        buffer, corners = self.materials.buffer, batch.corners
        face = self.surfaces.face[corners]
        attributes = {
            "POSITION": buffer.attribute(self.xyz[corners].astype(np.float32), bounds=True),
            "NORMAL": buffer.attribute(self.normals[face].astype(np.float32)),
        }
        if batch.page == UNTEXTURED:
            attributes["COLOR_0"] = buffer.attribute(vertex_colours(self.surfaces.colour[face]), normalized=True)
            material = self.materials.plain("plain")
        else:
            attributes |= dict(self._coordinates(corners))
            material = self.materials.page(self.materials.appearance.pages()[batch.page])
        ids = (self.surfaces.building[face], face)
        for number, of_vertex in enumerate(ids):
            attributes[f"_FEATURE_ID_{number}"] = buffer.attribute(of_vertex.astype(np.float32))
        features = [
            {"featureCount": len(np.unique(found)), "attribute": i, "propertyTable": i, "label": label}
            for i, (found, label) in enumerate(zip(ids, (BUILDING, SURFACE), strict=True))
        ]
        return {
            "attributes": attributes, "indices": buffer.indices(batch.triangles, len(corners)), "material": material,
            "extensions": {FEATURES: {"featureIds": features}},
        }  # fmt: skip

    def _coordinates(self, corners: IntArray) -> Iterator[tuple[str, int]]:
        uvd, textures = self.surfaces.uvd[corners], self.materials.appearance.textures
        yield "TEXCOORD_0", self.materials.buffer.attribute(from_above(uvd[:, :2]).astype(np.float32))
        if textures is not None and not textures.rectified:
            yield "_UVD", self.materials.buffer.attribute(triplets(uvd).astype(np.float32))


def _tables(buildings: Sequence[Building], surfaces: Surfaces) -> tuple[Table, Table]:
    """Row i of the first is building i, row i of the second face i."""
    ids = Column("id", [building.id for building in buildings])
    types = np.array([SEMANTICS.index(row.face.semantic.value) for row in surfaces.rows], np.uint8)
    columns = columns_of([{} if row.look is None else attributes_of_look(row.look) for row in surfaces.rows])
    of_faces: tuple[Column | Classes, ...] = (
        Classes("type", types, SEMANTICS),
        Column("building", surfaces.building.tolist(), "row of the table of buildings"),
        Column("neighbour", [row.face.neighbour for row in surfaces.rows], "building behind a party wall"),
        *columns,
    )
    return (
        Table(BUILDING, len(buildings), (ids, *columns_of([described(building) for building in buildings]))),
        Table(SURFACE, len(surfaces.rows), of_faces),
    )


def document_of(name: str, primitives: list[Json], materials: Materials, attribution: str) -> dict[str, Json]:
    """A document of one mesh without its buffer; `attribution` is whom viewers name as the source."""
    asset = {"version": "2.0", "generator": "cityflow"}
    if attribution:
        asset["copyright"] = attribution
    document = {
        "asset": asset, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"name": name, "mesh": 0}],
        "meshes": [{"name": name, "primitives": primitives}], **materials.json,
    }  # fmt: skip
    return {**document, "extensionsUsed": materials.extensions}


def smooth_normals(xyz: FloatArray, triangles: IntArray) -> FloatArray:
    """(V, 3) unit normals: means of the triangles around, by area; upwards where these cancel."""
    a, b, c = (xyz[triangles[:, i]] for i in range(3))
    vectors = np.zeros_like(xyz)
    for corner in triangles.T:
        np.add.at(vectors, corner, np.cross(b - a, c - a))
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, lengths, out=np.tile([0.0, 0.0, 1.0], (len(vectors), 1)), where=lengths > 0)

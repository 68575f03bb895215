"""What stands far away as binary glTF: terrain under a small picture, and blocks, each with the row of its building."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Semantic
from cityflow.core.coarse import Blocks, Coarse
from cityflow.core.texture import Drape, TexturePage, TextureSet
from cityflow.geometry.polygon_triangulation import triangulate_polygon
from cityflow.io.attributes import STATUS_KEY
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.gltf import (
    BUILDING,
    FEATURES,
    SEMANTICS,
    SURFACE,
    TERRAIN_MATERIAL,
    document_of,
    from_above,
    smooth_normals,
    y_up,
)
from cityflow.io.city_models.gltf_buffer import GltfBuffer
from cityflow.io.city_models.gltf_materials import Materials, linear, vertex_colours
from cityflow.io.city_models.gltf_metadata import EXTENSION as METADATA
from cityflow.io.city_models.gltf_metadata import Classes, Column, Table, structural_metadata
from cityflow.io.city_models.obj_materials import MATERIALS
from cityflow.io.globe_frame import TileFrame
from cityflow.io.images.image_write import jpeg_bytes

Json = Any
PICTURE_QUALITY = 80
"""Of JPEG; set by hand."""
ROOF, WALL = SEMANTICS.index(Semantic.ROOF.value), SEMANTICS.index(Semantic.WALL.value)
_PICTURE = "ground.jpg"


@dataclass(slots=True)
class _Corners:
    """Corners of blocks as they are added, each face with its own, and their triangles."""

    xyz: list[FloatArray] = field(default_factory=list)
    normals: list[FloatArray] = field(default_factory=list)
    blocks: list[IntArray] = field(default_factory=list)
    classes: list[IntArray] = field(default_factory=list)
    triangles: list[IntArray] = field(default_factory=list)
    count: int = 0

    def add(self, block: int, kind: int, xyz: FloatArray, normals: FloatArray, triangles: IntArray) -> None:
        self.xyz.append(xyz)
        self.normals.append(normals)
        self.blocks.append(np.full(len(xyz), block))
        self.classes.append(np.full(len(xyz), kind))
        self.triangles.append(triangles + self.count)
        self.count += len(xyz)


def write_coarse_glb(name: str, coarse: Coarse, frame: TileFrame, attribution: str = "", is_whole: bool = False) -> bytes:  # fmt: skip
    """The file: a mesh of terrain and blocks, a primitive each.

    Parameters
    ----------
    frame : of the vertices
    is_whole : whether its node puts it into the frame of the whole; else the tile that shows it does
    """
    buffer = GltfBuffer()
    pictures = {} if coarse.picture is None else {_PICTURE: jpeg_bytes(coarse.picture, PICTURE_QUALITY)}
    textures = None if coarse.picture is None else TextureSet(True, (), {})
    materials = Materials(Appearance("", textures), buffer, pictures)
    primitives = []
    if len(coarse.triangles):
        primitives.append(_terrain(coarse, frame, materials))
    corners = _corners(coarse.blocks)
    if corners.count:
        primitives.append(_blocks(coarse.blocks, corners, frame, materials))
    if not primitives:
        return b""
    document = document_of(name, primitives, materials, attribution)
    document["asset"]["extras"] = {"isFar": True}
    if is_whole:
        document["nodes"][0]["matrix"] = _matrix(frame)
    if corners.count:
        document["extensionsUsed"] = sorted({FEATURES, METADATA, *materials.extensions})
        document["extensions"] = {METADATA: structural_metadata(_tables(coarse.blocks), buffer)}
    return buffer.glb(document)


def places_of(coarse: Coarse) -> FloatArray:
    """(N, 3) world metres, of all vertices that are written."""
    plans = [np.asarray(plan.exterior.coords)[:, :2] for plan in coarse.blocks.plans]
    ends = [np.column_stack([xy, np.full(len(xy), z)]) for xy, pair in zip(plans, coarse.blocks.heights, strict=True) for z in pair]  # fmt: skip
    return np.concatenate([np.empty((0, 3)), coarse.vertices, *ends])


def _terrain(coarse: Coarse, frame: TileFrame, materials: Materials) -> Json:
    buffer, xyz = materials.buffer, frame.local(coarse.vertices)
    attributes = {
        "POSITION": buffer.attribute(y_up(xyz).astype(np.float32), bounds=True),
        "NORMAL": buffer.attribute(y_up(smooth_normals(xyz, coarse.triangles)).astype(np.float32)),
    }
    if coarse.picture is None:
        material = materials.plain(TERRAIN_MATERIAL, linear(np.array(MATERIALS[TERRAIN_MATERIAL]) * 255))
    else:
        page = TexturePage(_PICTURE, coarse.picture.shape[1], coarse.picture.shape[0], "image/jpeg")
        uv = from_above(Drape(page, coarse.extent).uv(coarse.vertices[:, :2]))
        attributes["TEXCOORD_0"] = buffer.attribute(uv.astype(np.float32))
        material = materials.page(page)
    return {"attributes": attributes, "indices": buffer.indices(coarse.triangles, len(xyz)), "material": material}


def _corners(blocks: Blocks) -> _Corners:
    """Roof and walls of all blocks, world metres; normals up and square to the walls, in plan."""
    found = _Corners()
    for number, (plan, (floor, roof)) in enumerate(zip(blocks.plans, blocks.heights.tolist(), strict=True)):
        rings = rings_of(plan)
        flat = np.concatenate(rings)
        top = np.column_stack([flat, np.full(len(flat), roof)])
        found.add(number, ROOF, top, np.tile([0.0, 0.0, 1.0], (len(top), 1)), triangulate_polygon(rings))
        for ring in rings:
            found.add(number, WALL, *_walls(ring, floor, roof))
    return found


def rings_of(plan: Polygon) -> list[FloatArray]:
    """Exterior, counter-clockwise, then holes, clockwise: (n, 2) each, without the repeated last point."""
    found = []
    for ring, is_left in ((plan.exterior, True), *((hole, False) for hole in plan.interiors)):
        xy = np.asarray(ring.coords)[:-1, :2]
        found.append(xy if ring.is_ccw is is_left else xy[::-1])
    return found


def _walls(ring: FloatArray, floor: float, roof: float) -> tuple[FloatArray, FloatArray, IntArray]:
    """Corners (4 n, 3), normals and triangles of the walls over a ring."""
    n, after = len(ring), np.roll(ring, -1, axis=0)
    plan = np.stack([ring, after, after, ring], axis=1).reshape(-1, 2)
    xyz = np.column_stack([plan, np.tile([floor, floor, roof, roof], n)])
    way = after - ring
    outward = np.column_stack([way[:, 1], -way[:, 0]]) / np.maximum(np.hypot(*way.T), 1e-9)[:, None]
    normals = np.repeat(np.column_stack([outward, np.zeros(n)]), 4, axis=0)
    first = 4 * np.arange(n)[:, None, None]
    return xyz, normals, (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)


def _blocks(blocks: Blocks, corners: _Corners, frame: TileFrame, materials: Materials) -> Json:
    buffer = materials.buffer
    block, kind = np.concatenate(corners.blocks), np.concatenate(corners.classes)
    xyz = frame.local(np.concatenate(corners.xyz))
    colour: NDArray[np.uint8] = blocks.colours[block, np.where(kind == ROOF, 0, 1)]
    attributes = {
        "POSITION": buffer.attribute(y_up(xyz).astype(np.float32), bounds=True),
        "NORMAL": buffer.attribute(y_up(np.concatenate(corners.normals)).astype(np.float32)),
        "COLOR_0": buffer.attribute(vertex_colours(colour), normalized=True),
        "_FEATURE_ID_0": buffer.attribute(block.astype(np.float32)),
        "_FEATURE_ID_1": buffer.attribute(kind.astype(np.float32)),
    }
    features = [
        {"featureCount": len(np.unique(ids)), "attribute": i, "propertyTable": i, "label": label}
        for i, (ids, label) in enumerate(((block, BUILDING), (kind, SURFACE)))
    ]
    return {
        "attributes": attributes, "indices": buffer.indices(np.concatenate(corners.triangles), len(xyz)),
        "material": materials.plain("plain"), "extensions": {FEATURES: {"featureIds": features}},
    }  # fmt: skip


def _tables(blocks: Blocks) -> tuple[Table, Table]:
    """Row i of the first is block i; of the second, a class of surfaces."""
    known: NDArray[np.bool_] = np.isfinite(blocks.figures)
    nmad, rmse = (
        [float(v) if is_known else None for v, is_known in zip(blocks.figures[:, k], known[:, k], strict=True)]
        for k in range(2)
    )
    columns = (
        Column("id", blocks.ids), Column(STATUS_KEY, blocks.status), Column("verdict", [v or None for v in blocks.verdict]),
        Column("nmad", nmad), Column("rmse", rmse),
    )  # fmt: skip
    types = Classes("type", np.arange(len(SEMANTICS), dtype=np.uint8), SEMANTICS)
    return Table(BUILDING, len(blocks), columns), Table(SURFACE, len(SEMANTICS), (types,))


def _matrix(frame: TileFrame) -> list[float]:
    """That of a node which puts the frame's vertices into the whole, in glTF's axes: 16 numbers, column after column."""
    turn = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    matrix = turn.T @ np.array(frame.matrix).reshape(4, 4).T @ turn
    return [float(value) for value in matrix.T.reshape(-1)]

"""The export format ``glb``: read back with trimesh, solids judged by it."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from cityflow.core.building import Building, Lod
from cityflow.core.reference import Reference
from cityflow.core.texture import Drape
from cityflow.io.city_models.obj import MATERIALS
from cityflow.io.export_formats.formats import written
from cityflow.io.export_formats.tile import CityTile
from painted_faces import painted

BOUNDS = (85000.0, 447500.0, 85100.0, 447600.0)
GROUND = np.array(
    [[85000.0, 447500.0, 1.0], [85100.0, 447500.0, 1.0], [85100.0, 447600.0, 2.0], [85000.0, 447600.0, 2.0]]
)
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def tile_of(buildings: list[Building], reference: Reference, **more: Any) -> CityTile:
    surface = (GROUND, TRIANGLES)
    return CityTile("t", BOUNDS, tuple(buildings), surface, [surface], reference, "A town", "2026-01-01", **more)


def document(data: bytes) -> dict[str, Any]:
    length = struct.unpack("<I", data[12:16])[0]
    tree: dict[str, Any] = json.loads(data[20 : 20 + length])
    return tree


def glb(tile: CityTile) -> bytes:
    ((path, data),) = written("glb", tile)
    assert path == "products/glb/t.glb"
    return data


def test_buildings_are_nodes_with_their_attributes_and_solids(
    neighbours: list[Building], amersfoort: Reference, tmp_path: Path
) -> None:
    solids = [replace(building, beyond=None) for building in neighbours]
    (tmp_path / "t.glb").write_bytes(glb(tile_of(solids, amersfoort)))
    scene = trimesh.load_scene(tmp_path / "t.glb")
    assert set(scene.geometry) == {"terrain", *(b.id for b in neighbours)}
    origin = np.array(scene.metadata["origin"])
    assert scene.metadata["crs"] == amersfoort.code
    for building in neighbours:
        mesh = scene.geometry[building.id]
        assert mesh.metadata["id"] == building.id
        x, y, z = mesh.vertices.T
        world = np.column_stack([x, -z, y]) + origin
        solid = building.solids[Lod.LOD22]
        assert world.min(axis=0) == pytest.approx(solid.vertices.min(axis=0), abs=1e-4)
        assert world.max(axis=0) == pytest.approx(solid.vertices.max(axis=0), abs=1e-4)
        closed = trimesh.Trimesh(np.round(mesh.vertices, 3), mesh.faces)
        assert closed.is_volume, "closed, and faces look outwards"
    green = np.round(np.array(MATERIALS["terrain"]) * 255)
    assert scene.geometry["terrain"].visual.vertex_colors[0][:3].tolist() == green.tolist()


def test_pages_stay_files_beside(neighbours: list[Building], amersfoort: Reference, tmp_path: Path) -> None:
    paint = painted(neighbours, rectified=True)
    data = glb(
        tile_of(neighbours, amersfoort, rectified=paint.textures, raw=painted(neighbours, rectified=False).textures)
    )
    tree = document(data)
    named = sorted(image["uri"] for image in tree["images"])
    assert named == sorted(f"../{p.path.removeprefix('products/')}" for p in paint.textures.pages)
    assert {
        m["name"]: tree["images"][m["pbrMetallicRoughness"]["baseColorTexture"]["index"]]["uri"]
        for m in tree["materials"]
    } == {name: name for name in named}
    nodes = [node["name"] for node in tree["nodes"]]
    assert len(nodes) == len(set(nodes))
    assert glb(tile_of(neighbours, amersfoort, rectified=paint.textures)) == data, (
        "the same bytes, whatever the raw ones"
    )


def test_a_tile_without_anything_leaves_no_file(amersfoort: Reference) -> None:
    empty = CityTile("t", BOUNDS, (), (GROUND, TRIANGLES[:0]), [], amersfoort, "", "")
    assert list(written("glb", empty)) == []


def test_terrain_under_an_ortho(amersfoort: Reference, neighbours: list[Building]) -> None:
    page = painted(neighbours, rectified=True).textures.pages[0]
    tree = document(glb(tile_of([], amersfoort, drape=Drape(page, BOUNDS))))
    assert tree["images"][0]["uri"].endswith(page.path.rsplit("/", 1)[-1])
    assert "TEXCOORD_0" in tree["meshes"][0]["primitives"][0]["attributes"]

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cityflow.core.building import Building, Face, Lod, Polyhedron, Semantic
from cityflow.core.reference import Reference
from cityflow.geometry.polyhedron import volume
from cityflow.io.city_models.cityjson import Transform
from cityflow.io.city_models.obj import MATERIALS, write_obj

ORIGIN = Transform(84000, 447000, 0)
Terrain = tuple[np.ndarray, np.ndarray]


@pytest.fixture
def files(buildings: list[Building], terrain: Terrain, amersfoort: Reference) -> dict[str, bytes]:
    return write_obj("340_1790", buildings, amersfoort, ORIGIN, [("340_1790", *terrain)])


@pytest.fixture
def bodies(files: dict[str, bytes], tmp_path: Path) -> list[trimesh.Trimesh]:
    """The connected parts of the file as trimesh reads it, terrain last, houses by x."""
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    mesh = trimesh.load_mesh(str(tmp_path / "340_1790.obj"), process=False, skip_materials=True)
    mesh.merge_vertices()
    return sorted(mesh.split(only_watertight=False), key=lambda part: (not part.is_watertight, part.bounds[0, 0]))


def test_trimesh_finds_closed_solids_of_the_right_volume(
    bodies: list[trimesh.Trimesh], buildings: list[Building]
) -> None:
    for building, mesh in zip(buildings[:3], bodies, strict=False):
        solid = building.solids[Lod.LOD22]
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.volume == pytest.approx(volume(solid), abs=1e-3)
        assert mesh.bounds[0] == pytest.approx(solid.vertices.min(axis=0) - [84000, 447000, 0], abs=1e-4)
        assert mesh.bounds[1] == pytest.approx(solid.vertices.max(axis=0) - [84000, 447000, 0], abs=1e-4)


def test_the_terrain_looks_up(bodies: list[trimesh.Trimesh], terrain: Terrain) -> None:
    assert len(bodies) == 4
    relief = bodies[3]
    assert len(relief.faces) == len(terrain[1])
    assert (relief.face_normals[:, 2] > 0).all()
    assert relief.bounds[:, 2] == pytest.approx([terrain[0][:, 2].min(), terrain[0][:, 2].max()])


def test_materials_are_defined_and_party_walls_have_their_own(files: dict[str, bytes]) -> None:
    defined = [line.split()[1] for line in files["340_1790.mtl"].decode().splitlines() if line.startswith("newmtl")]
    assert defined == list(MATERIALS)
    house = files["340_1790.obj"].decode().split("\no ")[1]
    used = [line.split()[1] for line in house.splitlines() if line.startswith("usemtl")]
    assert used == ["ground", "wall", "party_wall", "wall", "roof"]


def test_the_sidecar_says_where_and_what(files: dict[str, bytes], buildings: list[Building]) -> None:
    said = json.loads(files["340_1790.json"])
    assert (said["crs"], said["vertical_datum"], said["offset"]) == ("EPSG:7415", "NAP height", [84000, 447000, 0])
    objects = {line.split()[1] for line in files["340_1790.obj"].decode().splitlines() if line.startswith("o ")}
    assert objects <= said["objects"].keys() | set(said["terrain"])
    assert [o["id"] for o in said["objects"].values()] == [b.id for b in buildings]
    assert said["objects"]["b-0503100000018603"]["attributes"]["nmad_m"] == 0.3
    assert {o["attributes"]["cityflow_status"] for o in said["objects"].values()} == {"done", "degraded", "refused"}


def test_a_local_frame_names_no_crs(gable: Building, local: Reference) -> None:
    said = json.loads(write_obj("t", [gable], local, ORIGIN)["t.json"])
    assert said["crs"] is said["crs_wkt"] is None


def test_concave_faces_become_triangles_and_plain_ones_stay(gable: Building, local: Reference) -> None:
    xyz = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [1, 1, 0], [0, 0, 1]], float)
    arrow = Face(((0, 1, 4, 3),), Semantic.ROOF)
    square, triangle = Face(((0, 1, 2, 3),), Semantic.ROOF), Face(((0, 1, 5),), Semantic.WALL)
    building = replace(gable, solids={Lod.LOD22: Polyhedron(xyz, (arrow, square, triangle))})
    lines = write_obj("t", [building], local, Transform())["t.obj"].decode().splitlines()
    faces = [tuple(map(int, line.split()[1:])) for line in lines if line.startswith("f ")]
    assert [len(f) for f in faces] == [3, 3, 4, 3]
    # the notch of the arrow is at vertex 5: both triangles have it, none crosses it
    assert all(5 in f for f in faces[:2])


def test_the_same_buildings_give_the_same_bytes(buildings: list[Building], local: Reference) -> None:
    assert write_obj("t", buildings, local, ORIGIN) == write_obj("t", buildings, local, ORIGIN)

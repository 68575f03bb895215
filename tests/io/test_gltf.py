"""glTF files read by others: every triangle shows its own face's colour, triplets are exact, attributes come back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from shapely import Polygon
from trimesh.resolvers import FilePathResolver

from cityflow.core.building import Building, Face, Lod, Polyhedron, Scalar, Semantic
from cityflow.core.texture import (
    BuildingTexture,
    Drape,
    FaceFigures,
    FaceKey,
    FaceTexture,
    Shell,
    TexturePage,
    TextureSet,
)
from cityflow.geometry.polyhedron import face_areas, face_normals, volume
from cityflow.io.attributes import described
from cityflow.io.city_models.appearance import BARE, Appearance
from cityflow.io.city_models.gltf import SEMANTICS, GltfStyle, write_buildings_glb, write_terrain_glb
from cityflow.io.globe_frame import frame_at
from glb_reading import Glb
from painted_faces import GROUND_COLOUR, Painted, painted

FOLDER = "products/tiles3d/1_2"
FRAME = frame_at(None, (85000.0, 447500.0, 0.0))


def _zup(xyz: np.ndarray) -> np.ndarray:
    """What a reader of 3D Tiles does with glTF's axes."""
    return np.column_stack([xyz[:, 0], -xyz[:, 2], xyz[:, 1]]).astype(float)


def _shells(buildings: list[Building]) -> Iterator[tuple[Building, FaceKey, Polyhedron, Face]]:
    """Building, key, solid and face of every row of the table of surfaces."""
    for building in buildings:
        shells: list[tuple[Shell, Polyhedron | None]]
        shells = [("solid", building.solids.get(Lod.LOD22)), ("beyond", building.beyond)]
        for shell, solid in shells:
            if solid is not None:
                for index, face in enumerate(solid.faces):
                    yield building, (shell, index), solid, face


def _read(path: Path) -> list[Any]:
    scene = trimesh.load_scene(path, process=False, resolver=FilePathResolver(str(path), allow_anywhere=True))
    return list(scene.geometry.values())


def _written(paint: Painted, buildings: list[Building], run: Path) -> Path:
    paint.save(run)
    path = run / FOLDER / "buildings.glb"
    path.parent.mkdir(parents=True)
    path.write_bytes(write_buildings_glb("1_2", buildings, FRAME, Appearance(FOLDER, paint.textures)))
    return path


@pytest.mark.parametrize("rectified", [True, False])
def test_every_triangle_has_the_colour_of_its_face_in_trimesh(
    neighbours: list[Building], buildings: list[Building], tmp_path: Path, rectified: bool
) -> None:
    """Pages are found beside the file, and v counts the right way; holes, overhangs and both pages take part."""
    city = [*neighbours, *buildings]
    paint = painted(city, rectified=rectified)
    meshes = _read(_written(paint, city, tmp_path))
    rows = list(_shells(city))
    seen = set()
    for mesh in meshes:
        if mesh.visual.uv is None:
            continue
        uv = mesh.visual.uv[mesh.faces].mean(axis=1)
        colours = mesh.visual.material.to_color(uv)[:, :3]
        face = mesh.vertex_attributes["_FEATURE_ID_1"].reshape(-1)[mesh.faces[:, 0]].astype(int)
        for number, colour in zip(face.tolist(), colours.tolist(), strict=True):
            building, key, _, _ = rows[number]
            assert tuple(colour) == paint.colours[building.id, key]
            seen.add((building.id, key))
    assert seen == set(paint.colours)


def test_geometry_is_that_of_the_solids(neighbours: list[Building]) -> None:
    glb = Glb.of(write_buildings_glb("t", neighbours, FRAME, Appearance(FOLDER, painted(neighbours).textures)))
    rows = list(_shells(neighbours))
    area, volumes = np.zeros(len(rows)), np.zeros(len(neighbours))
    for primitive in glb.primitives:
        at, triangles = glb.attributes(primitive), glb.triangles(primitive)
        xyz = _zup(at["POSITION"])
        normals = _zup(at["NORMAL"])
        a, b, c = (xyz[triangles[:, i]] for i in range(3))
        twice = np.cross(b - a, c - a)
        faces = at["_FEATURE_ID_1"][triangles[:, 0]].astype(int)
        np.add.at(area, faces, np.linalg.norm(twice, axis=1) / 2)
        assert (np.einsum("ij,ij->i", twice, normals[triangles[:, 0]]) > 0).all()
        in_solid = np.array([rows[f][1][0] == "solid" for f in faces])
        of = at["_FEATURE_ID_0"][triangles[:, 0]].astype(int)
        np.add.at(volumes, of[in_solid], (np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)[in_solid])
        for number in np.unique(faces):
            _, key, solid, _ = rows[number]
            expected = face_normals(solid)[key[1]]
            assert normals[at["_FEATURE_ID_1"] == number] == pytest.approx(
                np.tile(expected, ((at["_FEATURE_ID_1"] == number).sum(), 1)), abs=2e-6
            )
    expected_area = [face_areas(solid)[key[1]] for _, key, solid, _ in rows]
    assert area == pytest.approx(expected_area, abs=1e-3)
    assert volumes == pytest.approx([volume(b.solids[Lod.LOD22]) for b in neighbours], rel=1e-5)


def test_triplets_are_exact_and_divide_to_the_plain_coordinates(neighbours: list[Building]) -> None:
    paint = painted(neighbours, rectified=False)
    glb = Glb.of(write_buildings_glb("t", neighbours, FRAME, Appearance(FOLDER, paint.textures)))
    rows = list(_shells(neighbours))
    checked = 0
    for primitive in glb.primitives:
        at = glb.attributes(primitive)
        if "TEXCOORD_0" not in at:
            assert "_UVD" not in at
            continue
        assert at["_UVD"][:, :2] / at["_UVD"][:, 2:] == pytest.approx(at["TEXCOORD_0"], abs=2e-7)
        for number in np.unique(at["_FEATURE_ID_1"]).astype(int):
            building, key, _, _ = rows[number]
            rings = np.concatenate(paint.textures.buildings[building.id].faces[key].rings)
            expected = np.column_stack([rings[:, 0] * rings[:, 2], (1 - rings[:, 1]) * rings[:, 2], rings[:, 2]])
            assert (at["_UVD"][at["_FEATURE_ID_1"] == number] == expected.astype(np.float32)).all()
            checked += 1
    assert checked == len(paint.colours)


def test_triplets_keep_a_photograph_straight_where_plain_coordinates_bend_it() -> None:
    """A façade of 12 × 9 m, steeply seen: any place on it, divided, is the camera's pixel; plain interpolation is pixels off."""
    eye, forward, focal = np.array([9.0, -14.0, 16.0]), np.array([-0.1, 0.8, -0.6]), 2048.0
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(forward, right), forward])

    def pixels(xyz: np.ndarray) -> np.ndarray:
        seen = (xyz - eye) @ axes.T
        return np.asarray(seen[:, :2] / seen[:, 2:] * focal + 4096)

    corners = np.array([(0.0, 0, 0), (12, 0, 0), (12, 0, 9), (0, 0, 9)])
    # The distance from the plane through the camera's centre that is parallel to its picture.
    d = (corners - eye) @ forward
    place = pixels(corners) / 8192
    rings = (np.column_stack([place[:, 0], 1 - place[:, 1], d]),)
    face = FaceTexture(0, rings, FaceFigures(0.1, 0.0, 1, 1, 0.0, 0.0))
    solid = Polyhedron(corners, (Face(((0, 1, 2, 3),), Semantic.WALL),))
    building = Building("b", Polygon(corners[:, :2]), 0.0, {Lod.LOD22: solid})
    page = TexturePage("products/textures/p.png", 8192, 8192, "image/png")
    textures = TextureSet(False, (page,), {"b": BuildingTexture({("solid", 0): face})})
    frame = frame_at(None, (0.0, 0.0, 0.0))
    glb = Glb.of(write_buildings_glb("t", [building], frame, Appearance(FOLDER, textures)))
    (primitive,) = glb.primitives
    at, triangles = glb.attributes(primitive), glb.triangles(primitive)
    weights = np.random.default_rng(4).dirichlet((1, 1, 1), (len(triangles), 200))

    def inside(values: np.ndarray) -> np.ndarray:
        return np.asarray(np.einsum("tsc,tcv->tsv", weights, values[triangles]).reshape(-1, values.shape[1]))

    truth = pixels(inside(_zup(at["POSITION"])))
    triplets = inside(at["_UVD"].astype(float))
    divided = triplets[:, :2] / triplets[:, 2:] * 8192
    assert np.abs(divided - truth).max() < 0.01
    assert np.abs(inside(at["TEXCOORD_0"].astype(float)) * 8192 - truth).max() > 50


def test_rectified_textures_have_no_triplets(gable: Building) -> None:
    glb = Glb.of(write_buildings_glb("t", [gable], FRAME, Appearance(FOLDER, painted([gable]).textures)))
    assert not any("_UVD" in primitive["attributes"] for primitive in glb.primitives)


def test_one_primitive_per_page_and_one_for_the_rest(buildings: list[Building]) -> None:
    """Only pages that faces are on are named, by a path from the file's folder."""
    paint = painted(buildings, pages=5)
    glb = Glb.of(write_buildings_glb("t", buildings, FRAME, Appearance(FOLDER, paint.textures)))
    pictures = [glb.picture(primitive) for primitive in glb.primitives]
    assert [p and p["uri"] for p in pictures] == [None, *(f"../../textures/page_{i}.png" for i in range(3))]


def test_names_of_pages_are_quoted(gable: Building) -> None:
    textures = painted([gable], pages=1).textures
    page = replace(textures.pages[0], path="products/textures/ü a#1.png")
    glb = Glb.of(write_buildings_glb("t", [gable], FRAME, Appearance(FOLDER, replace(textures, pages=(page,)))))
    assert glb.picture(glb.primitives[1])["uri"] == "../../textures/%C3%BC%20a%231.png"


def test_attributes_of_buildings_and_faces_come_back(neighbours: list[Building]) -> None:
    paint = painted(neighbours)
    glb = Glb.of(write_buildings_glb("t", neighbours, FRAME, Appearance(FOLDER, paint.textures)))
    table = glb.table(0)
    assert table.pop("id") == [b.id for b in neighbours]
    for number, building in enumerate(neighbours):
        said = described(building)
        for name, values in table.items():
            expected = said.get(name)
            has_gaps = any(name not in described(b) for b in neighbours)
            assert values[number] == (str(expected).lower() if has_gaps and isinstance(expected, bool) else expected), (
                name
            )
        assert all(name in table for name, value in said.items() if value not in (None, ""))
    rows, surfaces = list(_shells(neighbours)), glb.table(1)
    assert surfaces["type"] == [face.semantic.value for _, _, _, face in rows]
    assert surfaces["building"] == [neighbours.index(building) for building, _, _, _ in rows]
    assert surfaces["neighbour"] == [face.neighbour for _, _, _, face in rows]
    textured = [(b.id, key) in paint.colours for b, key, _, _ in rows]
    assert surfaces["texture_gsd_m"] == [0.08 if has else None for has in textured]
    assert surfaces["texture_images"] == [6 if has else None for has in textured]


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([True, False, True] * 5, [True, False, True] * 5),
        ([True, None, False], ["true", None, "false"]),
        ([1, None, -2147483647 - 1], [1.0, None, -2147483648.0]),
        ([1, None, -7], [1, None, -7]),
        ([5, 2**40, None], [5.0, float(2**40), None]),
        ([2**60 + 1, 3], [str(2**60 + 1), "3"]),
        ([1, 2.5, None, -9999.0], [1.0, 2.5, None, -9999.0]),
        (["ä", None, "", "b\u2028"], ["ä", None, None, "b\u2028"]),
        ([1, "a", None], ["1", "a", None]),
    ],
)
def test_columns_keep_their_values(gable: Building, values: list[Scalar], expected: list[Scalar]) -> None:
    """Each column in the narrowest type that holds it; gaps stay gaps, text cannot tell an empty one from one."""
    city = [replace(gable, id=str(i), attributes={"1 ü/x": v}) for i, v in enumerate(values)]
    glb = Glb.of(write_buildings_glb("t", city, FRAME))
    table = glb.table(0)
    assert table["1 ü/x"] == expected
    assert [type(v) for v in table["1 ü/x"]] == [type(v) for v in expected]


def test_columns_without_values_or_with_hostile_names(gable: Building) -> None:
    city = [replace(gable, attributes={"gone": None, "a b": 1, "a_b": 2, "a-b": 3, "id": "own", "9": 4, "": 5})]
    glb = Glb.of(write_buildings_glb("t", city, FRAME))
    properties = glb.document["extensions"]["EXT_structural_metadata"]["schema"]["classes"]["building"]["properties"]
    named = {key: said["name"] for key, said in properties.items()}
    assert named["a_b"] == "a b"
    assert named["a_b_2"] == "a_b"
    assert named["a_b_3"] == "a-b"
    assert (named["id"], named["id_2"]) == ("id", "id")
    assert (named["_9"], named["_"]) == ("9", "")
    assert "gone" not in named.values()


def test_plain_faces_have_their_colour(gable: Building) -> None:
    """Colours of vertices are linear light; read back as sRGB they are what was asked for."""
    glb = Glb.of(write_buildings_glb("t", [gable], FRAME, Appearance(FOLDER, painted([gable]).textures)))
    at = glb.attributes(next(p for p in glb.primitives if glb.picture(p) is None))
    linear = at["COLOR_0"][:, :3] / 65535
    srgb = np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055) * 255
    types = [glb.table(1)["type"][int(i)] for i in at["_FEATURE_ID_1"]]
    assert set(types) == {SEMANTICS[0]}
    assert srgb == pytest.approx(np.tile(GROUND_COLOUR, (len(srgb), 1)), abs=0.05)


@pytest.mark.parametrize("textured", [True, False])
def test_plain_faces_are_lit_only_where_no_photograph_is(gable: Building, textured: bool) -> None:
    """A viewer's sun would make shaded walls black beside photographs, which have their light; without any it shows shapes."""
    appearance = Appearance(FOLDER, painted([gable]).textures) if textured else BARE
    document = Glb.of(write_buildings_glb("t", [gable], FRAME, appearance)).document
    unlit = ["KHR_materials_unlit" in material.get("extensions", ()) for material in document["materials"]]
    assert unlit == ([True, True] if textured else [False])
    assert ("KHR_materials_unlit" in document["extensionsUsed"]) == textured


def test_embedded_pages_need_no_file(gable: Building, tmp_path: Path) -> None:
    paint = painted([gable])
    paint.save(tmp_path)
    page = paint.textures.pages[0].path
    style = GltfStyle("© A", pictures={page: (tmp_path / page).read_bytes()})
    data = write_buildings_glb("t", [gable], FRAME, Appearance(FOLDER, paint.textures), style)
    alone = tmp_path / "alone" / "t.glb"
    alone.parent.mkdir()
    alone.write_bytes(data)
    pictures = [mesh.visual.material.baseColorTexture for mesh in _read(alone) if mesh.visual.uv is not None]
    assert len(pictures) == 1
    assert (np.asarray(pictures[0].convert("RGB")) == paint.pixels[page]).all()
    assert Glb.of(data).document["asset"]["copyright"] == "© A"


def test_coarser_solids_are_plain(gable: Building) -> None:
    appearance = Appearance(FOLDER, painted([gable]).textures)
    glb = Glb.of(write_buildings_glb("t", [gable], FRAME, appearance, GltfStyle(lod=Lod.LOD12)))
    assert "images" not in glb.document
    assert len(glb.table(1)["type"]) == len(gable.solids[Lod.LOD12].faces)


def test_nothing_to_write_gives_no_file(buildings: list[Building]) -> None:
    assert write_buildings_glb("t", [], FRAME) == b""
    assert write_buildings_glb("t", buildings[-1:], FRAME) == b""
    assert write_terrain_glb("t", np.empty((0, 3)), np.empty((0, 3), np.int64), FRAME) == b""


def test_terrain_lies_under_its_ortho(terrain: tuple[np.ndarray, np.ndarray], tmp_path: Path) -> None:
    """The ortho's colour says where on the ground a pixel is; trimesh finds it there."""
    vertices, triangles = terrain
    x_0, y_0, side = 84950.0, 447480.0, 64.0
    ramp = np.arange(256, dtype=np.uint8)
    pixels = np.zeros((256, 256, 3), np.uint8)
    pixels[..., 0], pixels[..., 1] = ramp, ramp[::-1, None]
    page = TexturePage("products/textures/ortho.png", 256, 256, "image/png")
    (tmp_path / "products/textures").mkdir(parents=True)
    Image.fromarray(pixels).save(tmp_path / page.path)
    drape = Drape(page, (x_0, y_0, x_0 + side, y_0 + side))
    path = tmp_path / FOLDER / "terrain.glb"
    path.parent.mkdir(parents=True)
    path.write_bytes(write_terrain_glb("t", vertices, triangles, FRAME, Appearance(FOLDER, drape=drape)))
    (mesh,) = _read(path)
    xyz = _zup(mesh.vertices) + FRAME.origin
    assert np.abs(xyz - vertices).max() < 1e-4
    metres = mesh.visual.material.to_color(mesh.visual.uv)[:, :2].astype(float) * side / 256
    assert np.abs(metres - (xyz[:, :2] - (x_0, y_0))).max() < side / 256 * 1.01
    assert (mesh.face_normals[:, 1] > 0).all()


def test_same_input_same_bytes(neighbours: list[Building]) -> None:
    appearance = Appearance(FOLDER, painted(neighbours, rectified=False).textures)
    assert write_buildings_glb("t", neighbours, FRAME, appearance) == write_buildings_glb(
        "t", neighbours, FRAME, appearance
    )

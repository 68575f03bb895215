"""Tilesets walked as a viewer walks them: volumes hold what is in them, every file is reached once, vertices stand where they should."""

from __future__ import annotations

import json
import posixpath
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from pyproj import Transformer

from cityflow.core.building import Building, Lod
from cityflow.core.reference import Reference
from cityflow.io.city_models.tiles3d import FOLDER, PORTABLE, RAW, About, Scene, tile_files
from cityflow.io.city_models.tiles3d_tree import TILES_PER_FILE, city_tilesets
from cityflow.io.geoid import shipped_geoid
from cityflow.io.globe import globe_of
from cityflow.io.globe_frame import TileFrame, frame_at
from glb_reading import Glb
from painted_faces import painted

Json = Any
BOUNDS = (84960.0, 447490.0, 85060.0, 447590.0)


@dataclass(frozen=True)
class Visited:
    """A tile that a viewer comes by: file, tile, matrix to the whole, boxes around it (matrix, box) and their errors."""

    file: str
    tile: Json
    matrix: np.ndarray
    around: tuple[tuple[np.ndarray, list[float]], ...]
    errors: tuple[float, ...]


def walk(files: Mapping[str, bytes], file: str) -> Iterator[Visited]:
    """Every tile of a tileset and of those it refers to."""
    pending: list[tuple[str, Json, np.ndarray, tuple[Any, ...], tuple[float, ...]]]
    pending = [(file, json.loads(files[file])["root"], np.eye(4), (), (np.inf,))]
    while pending:
        name, tile, parent, around, errors = pending.pop()
        local = np.array(tile["transform"]).reshape(4, 4).T if "transform" in tile else np.eye(4)
        matrix = parent @ local
        around = (*around, (matrix, tile["boundingVolume"]["box"]))
        errors = (*errors, tile["geometricError"])
        yield Visited(name, tile, matrix, around, errors)
        for child in tile.get("children", []):
            pending.append((name, child, matrix, around, errors))
        uri = tile.get("content", {}).get("uri", "")
        if uri.endswith(".json"):
            assert "children" not in tile
            there = posixpath.normpath(posixpath.join(posixpath.dirname(name), uri))
            pending.append((there, json.loads(files[there])["root"], matrix, around, errors))


def beyond(box: list[float], matrix: np.ndarray, points: np.ndarray) -> float:
    """How far, metres, the farthest of some points of the whole stands out of a box."""
    centre = matrix[:3, :3] @ box[:3] + matrix[:3, 3]
    sides = np.array(box[3:]).reshape(3, 3) @ matrix[:3, :3].T
    lengths = np.linalg.norm(sides, axis=1)
    return float((np.abs((points - centre) @ (sides / lengths[:, None]).T) - lengths).max())


def positions(glb: Glb, matrix: np.ndarray) -> np.ndarray:
    xyz = np.concatenate([glb.attributes(p)["POSITION"] for p in glb.primitives]).astype(float)
    return np.asarray(np.column_stack([xyz[:, 0], -xyz[:, 2], xyz[:, 1]]) @ matrix[:3, :3].T + matrix[:3, 3])


@pytest.fixture
def frame(amersfoort: Reference) -> TileFrame:
    return frame_at(globe_of(amersfoort, BOUNDS), (85010.0, 447540.0, 0.0))


@pytest.fixture
def about(frame: TileFrame, amersfoort: Reference) -> About:
    assert frame.globe is not None
    return About("Town", "© Province", "2024-05-01", amersfoort.code, frame.globe.placing)


@pytest.fixture
def scene(neighbours: list[Building], terrain: tuple[np.ndarray, np.ndarray]) -> Scene:
    flat, raw = painted(neighbours).textures, painted(neighbours, rectified=False).textures
    return Scene("85_447", neighbours, terrain, flat, raw)


def test_both_sets_share_the_terrain(scene: Scene, frame: TileFrame, about: About) -> None:
    files = tile_files(scene, frame, about)
    names = {path.removeprefix(f"{FOLDER}/85_447/") for path in files}
    assert names == {"buildings.glb", "buildings_raw.glb", "terrain.glb", PORTABLE, RAW}
    for tileset, buildings in ((PORTABLE, "buildings.glb"), (RAW, "buildings_raw.glb")):
        tiles = [v.tile for v in walk(files, f"{FOLDER}/85_447/{tileset}")]
        assert [t["content"]["uri"] for t in tiles if "content" in t] == [buildings, "terrain.glb"]
    raw = Glb.of(files[f"{FOLDER}/85_447/buildings_raw.glb"])
    assert [("_UVD" in p["attributes"]) for p in raw.primitives] == [False, True, True]


@pytest.mark.parametrize("name", [PORTABLE, RAW])
def test_vertices_stand_where_proj_puts_them(scene: Scene, frame: TileFrame, about: About, name: str) -> None:
    """Through tree, tileset and 32-bit floats, within a centimetre; and no vertex leaves a box around it."""
    files = dict(tile_files(scene, frame, about))
    files |= city_tilesets({p: d for p, d in files.items() if p.endswith(f"/{name}")}, about, name)
    flat, ecef = Transformer.from_crs(28992, 4326, always_xy=True), Transformer.from_crs(4979, 4978, always_xy=True)

    def expected(xyz: np.ndarray) -> np.ndarray:
        lon, lat = flat.transform(xyz[:, 0], xyz[:, 1])
        return np.column_stack(ecef.transform(lon, lat, xyz[:, 2] - 0.005 + shipped_geoid().undulation(lon, lat)))

    found = {}
    for visited in walk(files, f"{FOLDER}/{name}"):
        uri = visited.tile.get("content", {}).get("uri", "")
        if uri.endswith(".glb"):
            points = positions(Glb.of(files[posixpath.join(posixpath.dirname(visited.file), uri)]), visited.matrix)
            assert max(beyond(box, matrix, points) for matrix, box in visited.around) < 0
            assert min(beyond(box, matrix, points) for matrix, box in visited.around[-1:]) > -0.02
            found[uri] = points
    terrain = expected(scene.terrain[0])
    assert np.linalg.norm(found["terrain.glb"] - terrain, axis=1).max() < 0.01
    solids = [b.solids[Lod.LOD22] for b in scene.buildings] + [b.beyond for b in scene.buildings if b.beyond]
    corners = np.concatenate([s.vertices[list(r)] for s in solids for f in s.faces for r in f.rings])
    houses = next(points for uri, points in found.items() if uri.startswith("buildings"))
    nearest = np.linalg.norm(expected(corners)[:, None] - houses[None], axis=2)
    assert nearest.min(axis=1).max() < 0.01
    assert nearest.min(axis=0).max() < 0.01


def test_tilesets_say_what_was_done(scene: Scene, frame: TileFrame, about: About) -> None:
    files = tile_files(scene, frame, about)
    tileset = json.loads(files[f"{FOLDER}/85_447/{PORTABLE}"])
    assert tileset["asset"]["version"] == "1.1"
    said = tileset["metadata"]["properties"]
    assert said.keys() == tileset["schema"]["classes"]["tileset"]["properties"].keys()
    assert (said["title"], said["attribution"], said["source_crs"]) == ("Town", "© Province", "EPSG:7415")
    assert said["vertical_datum"] == "NAP height"
    assert "EGM96" in said["geoid"]
    assert Glb.of(files[f"{FOLDER}/85_447/buildings.glb"]).document["asset"]["copyright"] == "© Province"


def test_tiles_without_something_leave_it_out(scene: Scene, frame: TileFrame, about: About) -> None:
    empty = (np.empty((0, 3)), np.empty((0, 3), np.int64))
    bare = Scene("t", scene.buildings, empty)
    assert {p.rsplit("/", 1)[1] for p in tile_files(bare, frame, about)} == {"buildings.glb", PORTABLE}
    ground = Scene("t", [], scene.terrain, raw=scene.raw, rectified=scene.rectified)
    assert {p.rsplit("/", 1)[1] for p in tile_files(ground, frame, about)} == {"terrain.glb", PORTABLE, RAW}
    assert tile_files(Scene("t", [], empty), frame, about) == {}
    assert city_tilesets({}, about) == {}


def test_a_local_frame_has_no_place_unless_it_is_given_one(scene: Scene) -> None:
    frame, about = frame_at(None, (85010.0, 447540.0, 0.0)), About("Town")
    files = dict(tile_files(scene, frame, about))
    path = f"{FOLDER}/85_447/{PORTABLE}"
    files |= city_tilesets({path: files[path]}, about)
    last = [v for v in walk(files, f"{FOLDER}/{PORTABLE}") if v.tile.get("content", {}).get("uri") == "terrain.glb"][-1]
    points = positions(Glb.of(files[f"{FOLDER}/85_447/terrain.glb"]), last.matrix)
    assert np.abs(points - scene.terrain[0]).max() < 1e-4
    assert "transform" not in json.loads(files[f"{FOLDER}/{PORTABLE}"])["root"]
    given = [1.0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1]
    placed = dict(files) | city_tilesets({path: files[path]}, about, root_transform=given)
    last = [v for v in walk(placed, f"{FOLDER}/{PORTABLE}") if v.tile.get("content", {}).get("uri") == "terrain.glb"][
        -1
    ]
    assert (
        np.abs(
            positions(Glb.of(files[f"{FOLDER}/85_447/terrain.glb"]), last.matrix) - scene.terrain[0] - (7, 8, 9)
        ).max()
        < 1e-4
    )


def _many(count: int, terrain: tuple[np.ndarray, np.ndarray], amersfoort: Reference, about: About) -> dict[str, bytes]:
    """Tilesets of `count` × `count` tiles of 500 m, each with one small terrain."""
    globe = globe_of(amersfoort, (80000.0, 440000.0, 80000.0 + 500 * count, 440000.0 + 500 * count))
    files: dict[str, bytes] = {}
    for row in range(count):
        for col in range(count):
            x, y = 80000.0 + 500 * col, 440000.0 + 500 * row
            vertices = (terrain[0] - (84960, 447490, 0)) * (500 / 11, 500 / 11, 1) + (x, y, 0)
            scene = Scene(f"{col}_{row}", [], (vertices, terrain[1]))
            files |= tile_files(scene, frame_at(globe, (x + 250, y + 250, 0.0)), about)
    return files


def test_many_tiles_hang_on_a_tree(terrain: tuple[np.ndarray, np.ndarray], amersfoort: Reference, about: About) -> None:
    """No tile has more than four children, no file more than its share, every ground tile is reached once, errors fall."""
    files = _many(20, terrain, amersfoort, about)
    tilesets = {p: d for p, d in files.items() if p.endswith(PORTABLE)}
    tree = city_tilesets(tilesets, about)
    assert 4 < len(tree) <= 17
    reached, in_file = [], dict.fromkeys(tree, 0)
    for visited in walk({**files, **tree}, f"{FOLDER}/{PORTABLE}"):
        assert len(visited.tile.get("children", ())) <= 4
        uri = visited.tile.get("content", {}).get("uri", "")
        if uri.endswith("/tileset.json"):
            reached.append(uri)
            in_file[visited.file] += 1
        assert all(a >= b for a, b in zip(visited.errors[:-1], visited.errors[1:], strict=True))
        if uri == "terrain.glb":
            points = positions(Glb.of(files[posixpath.join(posixpath.dirname(visited.file), uri)]), visited.matrix)
            assert max(beyond(box, matrix, points) for matrix, box in visited.around) < 0
    assert sorted(reached) == sorted(p.removeprefix(f"{FOLDER}/") for p in tilesets)
    assert max(in_file.values()) <= TILES_PER_FILE
    assert tree == city_tilesets(dict(reversed(tilesets.items())), about)


def test_tiles_at_the_same_place_do_not_hang_the_tree(scene: Scene, frame: TileFrame, about: About) -> None:
    data = tile_files(scene, frame, about)[f"{FOLDER}/85_447/{PORTABLE}"]
    tree = city_tilesets({f"{FOLDER}/{i}/{PORTABLE}": data for i in range(9)}, about)
    text = tree[f"{FOLDER}/{PORTABLE}"].decode()
    assert all(f'"{i}/{PORTABLE}"' in text for i in range(9))

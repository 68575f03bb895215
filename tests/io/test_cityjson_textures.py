from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import jsonschema_rs
import numpy as np
import pytest
from PIL import Image

from cityflow.core.building import Building
from cityflow.core.reference import Reference
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.cityjson import Transform, feature_line, read_feature
from cityflow.io.city_models.cityjson_sequence import document, header_line, join, terrain_feature_line
from textured_houses import Painted, codes, paint, painted_drape, places, sample

SURVEY = Transform(84000, 447000, 0)
FOLDER = "products/cityjson"
Terrain = tuple[np.ndarray, np.ndarray]


@pytest.fixture
def painted(neighbours: list[Building], tmp_path: Path) -> Painted:
    painted = paint(neighbours, rectified=True)
    painted.write(tmp_path)
    return painted


@pytest.fixture
def lines(
    neighbours: list[Building], painted: Painted, terrain: Terrain, amersfoort: Reference, tmp_path: Path
) -> list[bytes]:
    look = Appearance(FOLDER, painted.textures, painted_drape(terrain[0], tmp_path))
    buildings = [feature_line(b, SURVEY, look) for b in neighbours]
    return [
        header_line(amersfoort, None, SURVEY), *buildings,
        terrain_feature_line("terrain", *terrain, SURVEY, appearance=look),
    ]  # fmt: skip


def test_textured_lines_follow_the_schema(lines: list[bytes], schema_of: dict[str, jsonschema_rs.Validator]) -> None:
    for line in lines:
        value = json.loads(line)
        schema_of[value["type"]].validate(value)
    schema_of["CityJSON"].validate(json.loads(document(lines)))


def test_the_schema_does_refuse_other_images(lines: list[bytes], schema_of: dict[str, jsonschema_rs.Validator]) -> None:
    feature = json.loads(lines[1])
    feature["appearance"]["textures"][0]["type"] = "WEBP"
    assert not schema_of["CityJSONFeature"].is_valid(feature)


def test_cjio_shows_every_face_of_the_sequence_its_own_pixels(
    lines: list[bytes], painted: Painted, terrain: Terrain, tmp_path: Path, cjio: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("sys.stdin", io.StringIO(b"".join(lines).decode()))
    city = cjio.read_stdin().j
    _shows_its_own_pixels(city, tmp_path / FOLDER, painted, terrain)


def test_cjio_finds_images_and_pixels_of_the_document(
    lines: list[bytes], painted: Painted, terrain: Terrain, tmp_path: Path, cjio: ModuleType
) -> None:
    file = tmp_path / FOLDER / "city.json"
    file.parent.mkdir(parents=True)
    file.write_bytes(document(lines))
    with open(file, encoding="utf-8") as opened:
        city = cjio.reader(opened, ignore_duplicate_keys=False)
    assert Path(city.get_textures_location()).resolve() == (tmp_path / "products/textures/rectified").resolve()
    city.remove_duplicate_vertices()
    _shows_its_own_pixels(city.j, tmp_path / FOLDER, painted, terrain)
    # each image once, although two buildings share one
    assert len(city.j["appearance"]["textures"]) == 3
    assert [m["name"] for m in city.j["appearance"]["materials"]] == ["plain 5a5a5a", "plain cc6633"]


def test_the_joined_file_finds_the_images_from_its_own_folder(
    lines: list[bytes], painted: Painted, terrain: Terrain, tmp_path: Path, local: Reference
) -> None:
    target = header_line(local, None, Transform(85000, 447000, 0))
    joined = list(join([lines], target, (FOLDER, "products")))
    images = {t["image"] for line in joined[1:] for t in json.loads(line)["appearance"]["textures"]}
    assert images == {"textures/rectified/0.png", "textures/rectified/1.png", "textures/ortho/tile.png"}
    _shows_its_own_pixels(json.loads(document(joined)), tmp_path / "products", painted, terrain)


def test_the_building_is_the_same_with_its_textures_on(
    lines: list[bytes], neighbours: list[Building], painted: Painted
) -> None:
    for line, building in zip(lines[1:], neighbours, strict=False):
        assert feature_line(read_feature(line, SURVEY), SURVEY) == feature_line(building, SURVEY)


def test_faces_say_how_they_are_founded_or_why_they_are_plain(lines: list[bytes], neighbours: list[Building]) -> None:
    geometry = json.loads(lines[1])["CityObjects"][neighbours[0].id]["geometry"]
    assert ["texture" in g or "material" in g for g in geometry] == [False, False, False, True, True]
    semantics = geometry[3]["semantics"]
    said = [semantics["surfaces"][value] for value in semantics["values"][0]]
    assert said[0] == {"type": "GroundSurface"}
    assert said[1] == {"type": "WallSurface", "texture_missing": "no image sees it"}
    assert said[2] == {"type": "WallSurface", "is_party_wall": True, "neighbour": neighbours[1].id}
    assert said[3] == {
        "type": "WallSurface", "texture_gsd_m": 0.05, "texture_incidence_deg": 10.0, "texture_candidates": 40,
        "texture_images": 3, "texture_occluded": 0.25, "texture_interpolated": 0.125,
    }  # fmt: skip
    assert said[5]["plane"] == 0
    assert (said[5]["slope_deg"], said[5]["texture_gsd_m"]) == (pytest.approx(41.104, abs=1e-3), 0.052)
    assert len({id(s) for s in said[3:]}) == 4


def test_plain_faces_have_materials_and_no_face_has_both(lines: list[bytes], neighbours: list[Building]) -> None:
    feature = json.loads(lines[1])
    solid = feature["CityObjects"][neighbours[0].id]["geometry"][3]
    materials = [feature["appearance"]["materials"][m]["diffuseColor"] if m is not None else None
                 for m in solid["material"]["photographs"]["values"][0]]  # fmt: skip
    assert materials == [[0.3529] * 3, [0.8, 0.4, 0.2], [0.3529] * 3, None, None, None, None]
    textured = [rings[0][0] is not None for rings in solid["texture"]["photographs"]["values"][0]]
    assert textured == [m is None for m in materials]


def test_raw_textures_are_refused(neighbours: list[Building]) -> None:
    raw = Appearance(FOLDER, paint(neighbours, rectified=False).textures)
    with pytest.raises(ValueError, match="rectified"):
        feature_line(neighbours[0], SURVEY, raw)


def _shows_its_own_pixels(city: Any, folder: Path, painted: Painted, terrain: Terrain) -> None:
    """Every textured ring of a parsed CityJSON file has the pixels of its face, the terrain those of the ortho."""
    folder.mkdir(parents=True, exist_ok=True)
    seen: dict[int, int] = {}
    on_terrain = 0
    x_0, y_0 = terrain[0][:, :2].min(axis=0) - 1
    size = np.ptp(terrain[0][:, :2], axis=0) + 2
    images = {t["image"]: np.asarray(Image.open(folder / t["image"])) for t in city["appearance"]["textures"]}
    for ring, uv, image in _textured_rings(city):
        colours = sample(images[image], uv)
        if "ortho" in image:
            on_terrain += 1
            truth = (ring[:, :2] - (x_0, y_0)) / size
        else:
            (code,) = set(codes(colours))
            truth = painted.faces[code].shares(ring)
            seen[code] = seen.get(code, 0) + 1
        assert places(colours) == pytest.approx(truth, abs=0.01)
    assert set(seen) == set(painted.faces)
    assert sorted(seen.values()) == [1] * 13 + [2]
    assert on_terrain == len(terrain[1])


def _textured_rings(city: Any) -> Iterator[tuple[np.ndarray, np.ndarray, str]]:
    """World corners, texture coordinates and image of each ring that has one; every ring must say whether it has."""
    scale, shift = (np.array(city["transform"][k]) for k in ("scale", "translate"))
    vertices = np.array(city["vertices"]) * scale + shift
    appearance = city["appearance"]
    uv = np.array(appearance["vertices-texture"])
    for city_object in city["CityObjects"].values():
        for geometry in city_object["geometry"]:
            if "texture" not in geometry:
                continue
            said = geometry["texture"]["photographs"]["values"]
            solid = geometry["type"] == "Solid"
            faces, values = (g[0] if solid else g for g in (geometry["boundaries"], said))
            for rings, indices in zip(faces, values, strict=True):
                for ring, (texture, *corners) in zip(rings, indices, strict=True):
                    if texture is not None:
                        assert len(corners) == len(ring)
                        yield vertices[ring], uv[corners], appearance["textures"][texture]["image"]

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import jsonschema_rs
import numpy as np
import pytest

from cityflow.core.building import Building
from cityflow.core.reference import Reference
from cityflow.io.city_models.cityjson import Transform, feature_line, read_feature
from cityflow.io.city_models.cityjson_sequence import (
    document,
    extent_of,
    extent_of_headers,
    header_line,
    join,
    terrain_feature_line,
)
from cityflow.io.crs import resolve

SURVEY = Transform(84000, 447000, 0)
Terrain = tuple[np.ndarray, np.ndarray]


@pytest.fixture
def lines(buildings: list[Building], terrain: Terrain, amersfoort: Reference) -> list[bytes]:
    header = header_line(amersfoort, extent_of(buildings), SURVEY, title="Delft <é>", reference_date="2014-01-20")
    relief = terrain_feature_line("terrain 340_1790", *terrain, SURVEY, {"source": "AHN3"})
    return [header, *(feature_line(b, SURVEY) for b in buildings), relief]


def test_every_line_follows_the_schema(lines: list[bytes], schema_of: dict[str, jsonschema_rs.Validator]) -> None:
    for line in lines:
        value = json.loads(line)
        schema_of[value["type"]].validate(value)


def test_the_schema_does_refuse(lines: list[bytes], schema_of: dict[str, jsonschema_rs.Validator]) -> None:
    feature = json.loads(lines[1])
    feature["CityObjects"]["0503100000018603"]["geometry"][1]["lod"] = "2.25"
    assert not schema_of["CityJSONFeature"].is_valid(feature)


def test_a_compound_without_a_code_of_its_own_names_its_heights(schema_of: dict[str, jsonschema_rs.Validator]) -> None:
    header = json.loads(header_line(resolve("EPSG:25833+7837")))
    schema_of["CityJSON"].validate(header)
    assert header["metadata"] == {
        "referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/25833",
        "verticalDatum": "DHHN2016 height",
    }


def test_cjio_reads_the_sequence(
    lines: list[bytes], monkeypatch: pytest.MonkeyPatch, buildings: list[Building], cjio: ModuleType
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(b"".join(lines).decode()))
    city = cjio.read_stdin()
    assert city.get_epsg() == 7415
    assert len(city.j["CityObjects"]) == len(buildings) + 1
    assert city.get_bbox() == pytest.approx(_bounds_of_vertices(lines), abs=1e-4)


def test_cjio_reads_and_cleans_the_document(
    lines: list[bytes], schema_of: dict[str, jsonschema_rs.Validator], cjio: ModuleType, tmp_path: Path
) -> None:
    whole = document(lines)
    schema_of["CityJSON"].validate(json.loads(whole))
    (tmp_path / "city.json").write_bytes(whole)
    with open(tmp_path / "city.json", encoding="utf-8") as file:
        city = cjio.reader(file, ignore_duplicate_keys=False)
    city.check_version()
    assert city.remove_orphan_vertices() == 0
    extent = city.get_bbox()
    assert extent == pytest.approx(_bounds_of_vertices(lines[:-1]), abs=1e-4)


def test_the_extent_of_the_whole_is_that_of_its_headers(
    buildings: list[Building], terrain: Terrain, local: Reference
) -> None:
    headers = [header_line(local, extent_of([b])) for b in buildings]
    headers.append(header_line(local, extent_of([], [terrain[0]])))
    assert extent_of_headers(headers) == extent_of(buildings, [terrain[0]])
    assert extent_of_headers(headers[3:4]) is None


def test_joining_moves_features_to_the_common_transform(buildings: list[Building], local: Reference) -> None:
    here, there = Transform(84000, 447000, 0), Transform(85000, 447000, -100)
    tiles = [
        [header_line(local, None, t), feature_line(b, t)] for t, b in zip((here, there), buildings[:2], strict=True)
    ]
    header, *features = join(iter(tiles), header_line(local, None, SURVEY))
    assert "referenceSystem" not in json.loads(header)["metadata"]
    for line, building in zip(features, buildings, strict=False):
        assert line == feature_line(building, SURVEY)
        assert feature_line(read_feature(line, SURVEY)) == feature_line(building)


def test_joining_streams(buildings: list[Building], local: Reference) -> None:
    """The second file is not touched before the first is through."""
    header = header_line(local, None, SURVEY)

    def never() -> Iterator[bytes]:
        raise AssertionError("read too early")
        yield b""

    joined = join(iter([iter([header, feature_line(buildings[0], SURVEY)]), never()]), header)
    assert len([next(joined), next(joined)]) == 2
    with pytest.raises(AssertionError, match="too early"):
        next(joined)


def test_the_terrain_is_exact(terrain: Terrain) -> None:
    vertices, triangles = terrain
    feature = json.loads(terrain_feature_line("t", vertices, triangles, SURVEY))
    assert SURVEY.decode(feature["vertices"]).tobytes() == vertices.tobytes()
    boundaries = feature["CityObjects"]["t"]["geometry"][0]["boundaries"]
    assert np.array_equal(np.array(boundaries)[:, 0, :], triangles)


def test_extent_of_nothing_is_unknown(buildings: list[Building]) -> None:
    assert extent_of([]) is None
    assert extent_of(buildings[3:]) is None
    assert extent_of(buildings)[:3] == (84967.5731, 447497.4452, -1.2345)  # type: ignore[index]


def _bounds_of_vertices(lines: list[bytes]) -> list[float]:
    points = np.concatenate([SURVEY.decode(json.loads(line)["vertices"]) for line in lines[1:]])
    return [*points.min(axis=0), *points.max(axis=0)]

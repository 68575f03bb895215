from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import jsonschema_rs
import pyproj
import pystac
import pytest
from pystac.validation.local_validator import get_local_schema_cache

from cityflow.core.reference import Reference
from cityflow.io.catalog.products_catalog import (
    ProductFile,
    ProductItem,
    Source,
    city_files,
    district_file,
    district_path,
    item_file,
)
from cityflow.io.crs import resolve

SOURCE = Source("Delft", "LoD2.2 of two blocks", "CC0-1.0", "AHN3; BGT: Kadaster", "2014-01-20")


@pytest.fixture
def items() -> list[ProductItem]:
    tile = {
        "dsm": ProductFile("dsm/340_1790.tif", "Surface", sha256="ab" * 32, size=1234),
        "cityjson": ProductFile("cityjson/340_1790.city.jsonl", "CityJSONSeq 2.0"),
    }
    city = {
        "outlines": ProductFile("outlines.gpkg", "Outlines"),
        "report": ProductFile("../report.html", "Report", "overview"),
    }
    return [
        ProductItem("340_1790", (85000.0, 447500.0, 85250.0, 447750.0), tile, {"cityflow:units": 63}),
        ProductItem("city", (85000.0, 447500.0, 85500.0, 447750.0), city),
    ]


def products_catalog(items: list[ProductItem], source: Source, reference: Reference) -> dict[str, bytes]:
    """A catalog of a small city: items on its collection."""
    made = [item_file(item, source, reference) for item in items]
    boxes = [item.box for item in made if item.box is not None]
    return {i.path: i.data for i in made} | city_files([i.path for i in made], [], boxes, source)


def _stored(folder: Path, files: Mapping[str, bytes]) -> pystac.Catalog:
    for name, data in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(data)
    return pystac.Catalog.from_file(str(folder / "catalog.json"))


def test_pystac_reads_it(items: list[ProductItem], amersfoort: Reference, tmp_path: Path) -> None:
    catalog = _stored(tmp_path, products_catalog(items, SOURCE, amersfoort))
    (collection,) = catalog.get_collections()
    assert (collection.license, collection.title) == ("CC0-1.0", "Delft")
    assert collection.extent.spatial.bboxes[0] == pytest.approx([4.3676, 52.0114, 4.3748, 52.0137], abs=2e-4)
    assert collection.extent.temporal.intervals[0][0] == collection.extent.temporal.intervals[0][1]
    assert [p.name for p in collection.providers or []] == ["AHN3; BGT: Kadaster"]
    found = list(collection.get_items())
    assert found[0].get_collection() is collection
    assert [item.properties["title"] for item in found] == ["340_1790", "city"]
    tile = found[0]
    assert tile.properties["proj:code"] == "EPSG:7415"
    assert tile.properties["vertical_datum"] == "NAP height"
    assert tile.properties["license"] == "CC0-1.0"
    assert tile.properties["attribution"] == "AHN3; BGT: Kadaster"
    assert tile.datetime is not None
    assert tile.datetime.isoformat() == "2014-01-20T00:00:00+00:00"
    # by the Dutch approximation polynomials: 4.3676° E, 52.0114° N; 250 m are 0.0036° and 0.0022°
    assert tile.bbox == pytest.approx([4.3676, 52.0114, 4.3712, 52.0137], abs=2e-4)


@pytest.mark.parametrize("code", ["EPSG:7415", "local"])
def test_it_follows_the_core_schemas(items: list[ProductItem], code: str) -> None:
    schemas = get_local_schema_cache()
    registry = jsonschema_rs.Registry(list(schemas.items()))
    for path, data in products_catalog(items, SOURCE, resolve(code)).items():
        # the extensions' own schemas are not at hand offline
        stac = {**json.loads(data), "stac_extensions": []}
        kind = path.removesuffix(".json") if "/" not in path else "item"
        schema = next(s for uri, s in schemas.items() if uri.endswith(f"/{kind}-spec/json-schema/{kind}.json"))
        jsonschema_rs.validator_for(schema, registry=registry).validate(stac)


def test_assets_point_at_the_files(items: list[ProductItem], amersfoort: Reference, tmp_path: Path) -> None:
    catalog = _stored(tmp_path, products_catalog(items, SOURCE, amersfoort))
    tile, city = catalog.get_items(recursive=True)
    assert Path(str(tile.assets["dsm"].get_absolute_href())).resolve() == (tmp_path / "dsm/340_1790.tif").resolve()
    assert Path(str(city.assets["report"].get_absolute_href())).resolve() == (tmp_path.parent / "report.html").resolve()
    assert tile.assets["dsm"].media_type == "image/tiff; application=geotiff; profile=cloud-optimized"
    assert tile.assets["cityjson"].media_type == "application/city+json-seq"
    assert tile.assets["dsm"].extra_fields == {"file:checksum": "1220" + "ab" * 32, "file:size": 1234}


def test_a_local_frame_has_no_place_on_the_globe(items: list[ProductItem], local: Reference, tmp_path: Path) -> None:
    tile = next(iter(_stored(tmp_path, products_catalog(items, SOURCE, local)).get_items(recursive=True)))
    assert tile.geometry is None
    assert tile.properties["proj:code"] is None
    assert tile.properties["proj:bbox"] == [85000.0, 447500.0, 85250.0, 447750.0]
    assert "proj:wkt2" not in tile.properties


def test_a_compound_without_a_code_of_its_own_is_told_in_full(items: list[ProductItem]) -> None:
    said = json.loads(products_catalog(items, SOURCE, resolve("EPSG:25833+7837"))["items/p-city.json"])["properties"]
    assert said["proj:code"] is None
    parts = pyproj.CRS.from_wkt(said["proj:wkt2"]).sub_crs_list
    assert [part.to_epsg() for part in parts] == [25833, 7837]


@pytest.mark.parametrize(
    ("date", "moment", "start"),
    [
        ("2014-01-20/2015-03-01", None, "2014-01-20T00:00:00Z"),
        ("", None, "1900-01-01T00:00:00Z"),
        ("2014-01-20T11:00:00Z", "2014-01-20T11:00:00Z", None),
    ],
)
def test_dates(items: list[ProductItem], local: Reference, date: str, moment: str | None, start: str | None) -> None:
    files = products_catalog(items, Source("t", date=date), local)
    properties = json.loads(files["items/p-city.json"])["properties"]
    assert properties["datetime"] == moment
    assert properties.get("start_datetime") == start
    assert properties["license"] == "other"


def test_nothing_tells_when_or_where_it_was_made(items: list[ProductItem], amersfoort: Reference) -> None:
    files = products_catalog(items, SOURCE, amersfoort)
    assert files == products_catalog(items, SOURCE, amersfoort)
    for data in files.values():
        assert b"created" not in data
        assert b'"/' not in data
        assert b"file://" not in data


def test_districts_hang_between_collection_and_items(
    items: list[ProductItem], amersfoort: Reference, tmp_path: Path
) -> None:
    inner, outer = "8x8_42_223", "64x64_5_27"
    made = [item_file(items[0], SOURCE, amersfoort, district_path(inner)), item_file(items[1], SOURCE, amersfoort)]
    boxes = [item.box for item in made if item.box is not None]
    files = {item.path: item.data for item in made} | city_files([made[1].path], [district_path(outer)], boxes, SOURCE)
    files |= dict([district_file(outer, [], [district_path(inner)], SOURCE)])
    files |= dict([district_file(inner, [made[0].path], [], SOURCE, district_path(outer))])
    catalog = _stored(tmp_path, files)
    (collection,) = catalog.get_collections()
    assert {item.id: item.get_parent().id for item in catalog.get_items(recursive=True)} == {  # type: ignore[union-attr]
        made[0].path.removeprefix("items/").removesuffix(".json"): inner,
        made[1].path.removeprefix("items/").removesuffix(".json"): collection.id,
    }
    assert {item.get_collection() for item in catalog.get_items(recursive=True)} == {collection}
    found = pystac.Item.from_file(str(tmp_path / made[0].path))
    parent = found.get_parent()
    assert parent is not None
    assert [parent.id, parent.get_parent().id] == [inner, outer]  # type: ignore[union-attr]

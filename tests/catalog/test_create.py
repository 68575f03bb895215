from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import fsspec
import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import read_catalog
from survey_files import CORNER, DELFT, houses, points, write_las, write_outlines

LAZ = str(DELFT / "data" / "*.laz")
REGISTER = DELFT / "data" / "bgt_pand_28992.gpkg"
RD = "EPSG:7415"


def _files(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def _raster(path: Path, crs: str | None = "EPSG:28992", bands: int = 1) -> Path:
    transform = from_origin(CORNER[0], CORNER[1] + 60, 0.5, 0.5)
    profile = {"driver": "GTiff", "height": 120, "width": 120, "count": bands, "dtype": "float32", "nodata": -9999.0}
    with rasterio.open(path, "w", crs=crs, transform=transform, **profile) as raster:
        raster.write(np.zeros((bands, 120, 120), np.float32))
    return path


def test_what_is_written_is_what_is_read(tmp_path: Path) -> None:
    created = create_catalog(
        tmp_path / "c",
        SurveyFiles(lidar=[LAZ], outlines=REGISTER, id_column="identificatiebagpnd", id_format="{:016d}"),
        crs=RD,
        text=SurveyText(title="Delft", licence="CC0-1.0", attribution="somebody"),
    )
    assert created.notes == ()
    assert read_catalog(tmp_path / "c") == created.catalog
    assert _files(tmp_path / "c") == [
        "collection.json",
        *(f"items/{n}" for n in ("ahn3_cropped_1.json", "ahn3_cropped_2.json", "items.parquet", "outlines.json")),
    ]
    assert os.listdir(tmp_path) == ["c"]


def test_shipped_catalog_is_what_the_tool_makes(tmp_path: Path) -> None:
    shipped = read_catalog(DELFT)
    create_catalog(
        tmp_path / "c",
        SurveyFiles(lidar=[LAZ], outlines=REGISTER, id_column="identificatiebagpnd", id_format="{:016d}"),
        crs=RD,
        copy=True,
        text=SurveyText(title="Delft", licence="other", attribution=shipped.attribution),
    )
    made = read_catalog(tmp_path / "c")
    assert [replace(a, href="") for a in made.assets] == [replace(a, href="") for a in shipped.assets]
    assert [Path(a.href).name for a in made.assets] == [Path(a.href).name for a in shipped.assets]
    assert (made.title, made.reference, made.licence) == (shipped.title, shipped.reference, shipped.licence)


def test_hrefs_are_relative_unless_copied(tmp_path: Path) -> None:
    survey = tmp_path / "files"
    survey.mkdir()
    write_las(survey / "a.laz", points())
    create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(survey)]), crs=RD)
    item = json.loads((tmp_path / "c" / "items" / "a.json").read_text())
    assert item["assets"]["data"]["href"] == "../../files/a.laz"
    create_catalog(tmp_path / "d", SurveyFiles(lidar=[str(survey)]), crs=RD, copy=True)
    assert (tmp_path / "d" / "data" / "a.laz").read_bytes() == (survey / "a.laz").read_bytes()


def test_rasters_and_local_frame(tmp_path: Path) -> None:
    write_las(tmp_path / "a.laz", points())
    dtm, ortho = _raster(tmp_path / "t.tif", None), _raster(tmp_path / "o.tif", None, bands=3)
    other = _raster(tmp_path / "later.tif", None, bands=3)
    created = create_catalog(
        tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "a.laz")], dtm=dtm, orthos=[ortho, other]), crs="local"
    )
    catalog = read_catalog(tmp_path / "c")
    assert catalog == created.catalog
    assert catalog.reference.is_local
    assert (catalog.rasters["dtm"].cell, catalog.rasters["dtm"].shape) == (0.5, (120, 120))
    assert {k: Path(r.href).name for k, r in catalog.rasters.items()} == {
        "dtm": "t.tif", "ortho": "o.tif", "ortho-2": "later.tif",
    }  # fmt: skip
    assert catalog.rasters["ortho"].bounds == (*CORNER, CORNER[0] + 60, CORNER[1] + 60)
    item = json.loads((tmp_path / "c" / "items" / "a.json").read_text())
    assert item["geometry"] is None
    assert "bbox" not in item
    assert item["properties"]["proj:bbox"] == list(catalog.lidar[0].bounds)


def test_crs_of_the_files_is_taken_where_none_is_assigned(tmp_path: Path) -> None:
    write_las(tmp_path / "a.laz", points(), "EPSG:7415", "1.4")
    write_las(tmp_path / "b.laz", points(seed=2), "EPSG:7415", "1.4")
    catalog = create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "*.laz")])).catalog
    assert catalog.reference.code == "EPSG:7415"
    assert catalog.lidar[0].crs_in_file == "Amersfoort / RD New + NAP height"


@pytest.mark.parametrize(
    ("crs_in_file", "assigned", "message"),
    [
        (None, None, "no CRS and none is assigned"),
        ("EPSG:25831", RD, "UTM zone 31N"),
        ("EPSG:2263", None, "foot"),
        ("EPSG:4326", None, "not a projected CRS"),
        (None, "EPSG:4326", "not a projected CRS"),
    ],
)  # fmt: skip
def test_contradictory_crs_leaves_nothing_behind(
    tmp_path: Path, crs_in_file: str | None, assigned: str | None, message: str
) -> None:
    write_las(tmp_path / "a.laz", points(), crs_in_file)
    with pytest.raises(CatalogError, match=message) as caught:
        create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "a.laz")]), crs=assigned)
    assert caught.value.remedy
    assert assigned == "EPSG:4326" or "a.laz" in str(caught.value)
    assert os.listdir(tmp_path) == ["a.laz"]


def test_files_of_two_crs_are_told_apart(tmp_path: Path) -> None:
    write_las(tmp_path / "a.laz", points(), "EPSG:28992")
    write_las(tmp_path / "b.laz", points(), "EPSG:25831")
    with pytest.raises(CatalogError, match=r"b\.laz"):
        create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "*.laz")]))


def test_bad_files_are_named_and_nothing_is_written(tmp_path: Path) -> None:
    write_las(tmp_path / "good.laz", points())
    (tmp_path / "cut.laz").write_bytes((tmp_path / "good.laz").read_bytes()[:-50])
    (tmp_path / "text.laz").write_text("no points here\n" * 100)
    good = str(tmp_path / "good.laz")
    for lidar, message in (
        ([str(tmp_path / "nothing*.laz")], "no LAS or LAZ file matches"),
        ([good, str(tmp_path / "gone.laz")], r"gone\.laz: the file does not exist"),
        ([good, str(tmp_path / "cut.laz")], r"cut\.laz: the file is truncated"),
        ([str(tmp_path / "text.laz")], r"text\.laz"),
        ([], "no LiDAR file"),
    ):
        with pytest.raises(CatalogError, match=message):
            create_catalog(tmp_path / "c", SurveyFiles(lidar=lidar), crs=RD)
    for bad in ("gone.gpkg", "text.laz"):
        with pytest.raises(CatalogError, match=bad):
            create_catalog(tmp_path / "c", SurveyFiles(lidar=[good], outlines=tmp_path / bad), crs=RD)
    with pytest.raises(CatalogError, match=r"text\.laz"):
        create_catalog(tmp_path / "c", SurveyFiles(lidar=[good], dtm=tmp_path / "text.laz"), crs=RD)
    assert not (tmp_path / "c").exists()


def test_coordinates_in_degrees_are_refused(tmp_path: Path) -> None:
    xyz = points() * (1e-6, 1e-6, 1) + (4.36, 52.01, 0)
    write_las(tmp_path / "a.laz", xyz)
    with pytest.raises(CatalogError, match="degrees"):
        create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "a.laz")]), crs=RD)


def test_outlines_in_another_crs_are_reprojected_and_said_so(tmp_path: Path) -> None:
    write_las(tmp_path / "a.laz", points())
    degrees = list(gpd.GeoSeries(houses(), crs="EPSG:28992").to_crs("EPSG:4326"))
    outlines = write_outlines(tmp_path / "o.gpkg", degrees, "EPSG:4326")
    created = create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "a.laz")], outlines=outlines), crs=RD)
    assert any("reprojected from WGS 84" in note for note in created.notes)
    assert created.catalog.outlines is not None
    assert created.catalog.outlines.bounds == pytest.approx(shapely.total_bounds(houses()), abs=0.001)
    assert created.catalog.outlines.crs_in_file == "WGS 84"


def test_folder_that_is_no_catalog_is_left_alone(tmp_path: Path) -> None:
    write_las(tmp_path / "a.laz", points())
    with pytest.raises(CatalogError, match="not empty and holds no catalog"):
        create_catalog(tmp_path, SurveyFiles(lidar=[str(tmp_path / "a.laz")]), crs=RD)
    assert os.listdir(tmp_path) == ["a.laz"]


def test_places_that_cannot_hold_a_catalog(tmp_path: Path) -> None:
    lidar = [str(write_las(tmp_path / "a.laz", points()))]
    for out, message in (
        ("s3://bucket/c", "made in a local folder"),
        (tmp_path / "a.laz", "a file, not a folder"),
        (tmp_path / "a.laz" / "c", "cannot be written"),
    ):
        with pytest.raises(CatalogError, match=message):
            create_catalog(out, SurveyFiles(lidar=lidar), crs=RD)
    assert os.listdir(tmp_path) == ["a.laz"]


def test_older_catalog_is_replaced_and_other_files_stay(tmp_path: Path) -> None:
    write_las(tmp_path / "a.laz", points())
    write_las(tmp_path / "b.laz", points(seed=2))
    create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "*.laz")]), crs=RD, copy=True)
    (tmp_path / "c" / "README.md").write_text("about this survey")
    create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "c" / "data" / "b.laz")]), crs=RD, copy=True)
    assert [a.name for a in read_catalog(tmp_path / "c").lidar] == ["b"]
    assert (tmp_path / "c" / "README.md").read_text() == "about this survey"
    assert not (tmp_path / "c" / "items" / "a.json").exists()


def test_failed_replacement_keeps_the_older_catalog(tmp_path: Path) -> None:
    write_las(tmp_path / "a.laz", points())
    create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "a.laz")]), crs=RD)
    before = {name: (tmp_path / "c" / name).read_bytes() for name in _files(tmp_path / "c")}
    with pytest.raises(CatalogError):
        create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(tmp_path / "gone.laz")]), crs=RD)
    assert {name: (tmp_path / "c" / name).read_bytes() for name in _files(tmp_path / "c")} == before


def test_names_are_unique_and_never_those_of_other_items(tmp_path: Path) -> None:
    for folder in ("x", "y"):
        (tmp_path / folder).mkdir()
        write_las(tmp_path / folder / "strip 1.laz", points(seed=len(folder)))
    write_las(tmp_path / "outlines.laz", points())
    catalog = create_catalog(
        tmp_path / "c",
        SurveyFiles(lidar=[str(tmp_path / "*/strip 1.laz"), str(tmp_path / "outlines.laz")]),
        crs=RD,
        copy=True,
    ).catalog
    assert sorted(a.name for a in catalog.lidar) == ["outlines-2", "strip-1", "strip-1-2"]
    assert len({a.href for a in catalog.lidar}) == 3
    assert all(Path(a.href).is_file() for a in catalog.lidar)


@pytest.mark.parametrize("copy", [False, True])
def test_odd_names_of_files_and_folders(tmp_path: Path, copy: bool) -> None:
    names = ["a b.laz", "a#1.laz", "a?2.laz", "50%.laz", "a[1].laz", "a%20c.laz", "ö.laz"]
    (tmp_path / "mäßig dir").mkdir()
    for seed, name in enumerate(names):
        write_las(tmp_path / "mäßig dir" / name, points(100, seed))
    created = create_catalog(
        tmp_path / "c d", SurveyFiles(lidar=[str(tmp_path / "mäßig dir")]), crs=RD, copy=copy
    ).catalog
    found = read_catalog(tmp_path / "c d").lidar
    assert {a.name: a for a in found} == {a.name: a for a in created.lidar}
    assert all(Path(a.href).is_file() for a in found)


def test_shapefile_is_copied_with_its_companions(tmp_path: Path) -> None:
    write_las(tmp_path / "a.laz", points())
    outlines = write_outlines(tmp_path / "o.shp", houses(), name=["a", "b", "c", "d"])
    catalog = create_catalog(
        tmp_path / "c",
        SurveyFiles(lidar=[str(tmp_path / "a.laz")], outlines=outlines, id_column="name"),
        crs=RD,
        copy=True,
    ).catalog
    assert catalog.outlines is not None
    assert list(gpd.read_file(catalog.outlines.href)["name"]) == ["a", "b", "c", "d"]


def test_files_behind_a_url(tmp_path: Path) -> None:
    remote = fsspec.filesystem("memory")
    for n in (1, 2):
        path = write_las(tmp_path / f"{n}.laz", points(seed=n))
        remote.put(str(path), f"/remote-survey/{n}.laz")
    catalog = create_catalog(tmp_path / "c", SurveyFiles(lidar=["memory://remote-survey/*.laz"]), crs=RD).catalog
    assert [a.href for a in catalog.lidar] == [f"memory:///remote-survey/{n}.laz" for n in (1, 2)]
    assert read_catalog(tmp_path / "c") == catalog


def test_without_any_date_none_is_invented(tmp_path: Path) -> None:
    path = write_las(tmp_path / "a.las", points())
    data = bytearray(path.read_bytes())
    data[90:94] = bytes(4)  # LAS header: day and year of creation
    path.write_bytes(data)
    create_catalog(tmp_path / "c", SurveyFiles(lidar=[str(path)]), crs=RD)
    assert read_catalog(tmp_path / "c").date == ""
    create_catalog(tmp_path / "d", SurveyFiles(lidar=[str(path)]), crs=RD, text=SurveyText(date="2021-06-01"))
    assert read_catalog(tmp_path / "d").date == "2021-06-01"

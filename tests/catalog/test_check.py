from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from cityflow.catalog.check import check_catalog
from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.findings import CheckReport, Level
from cityflow.errors import CatalogError
from survey_files import CORNER, DELFT, houses, points, write_las, write_outlines

RD = "EPSG:7415"


@pytest.fixture
def delft(tmp_path: Path) -> Path:
    shutil.copytree(DELFT, tmp_path / "delft")
    return tmp_path / "delft"


def _said(report: CheckReport, level: Level) -> str:
    return "\n".join(str(f) for f in report.of(level))


def _survey(folder: Path, **las: Any) -> str:
    ground = np.where(np.arange(20_000) % 2, 2, 6).astype(np.uint8)
    two = np.full(20_000, 2, np.uint8)
    defaults = {"xyz": points(20_000), "classification": ground, "number_of_returns": two, "crs": "EPSG:28992"}
    write_las(folder / "a.laz", **{**defaults, **las})
    return str(folder / "a.laz")


def _checked(folder: Path, **options: Any) -> CheckReport:
    crs, text = options.pop("crs", RD), SurveyText(attribution=options.pop("attribution", "x"))
    create_catalog(folder / "c", SurveyFiles(**options), crs=crs, text=text)
    return check_catalog(folder / "c")


def test_delft_is_without_fault() -> None:
    report = check_catalog(DELFT)
    assert report.findings == ()
    assert not report.has_errors
    text = report.text()
    for said in (
        "848,942 points",
        "NAP height",
        "160, 160 in the survey, 0 outside",
        "6 building 33.0%",
        "No problems found",
    ):
        assert said in text


def test_good_synthetic_survey_is_without_fault(tmp_path: Path) -> None:
    outlines = write_outlines(tmp_path / "o.gpkg", houses(), name=["a", "b", "c", "d"])
    report = _checked(tmp_path, lidar=[_survey(tmp_path)], outlines=outlines, id_column="name")
    assert report.findings == ()


def test_missing_cut_and_changed_files_are_three_things(delft: Path) -> None:
    first, second = sorted((delft / "data").glob("*.laz"))
    first.unlink()
    second.write_bytes(second.read_bytes()[:-1000])
    outlines = delft / "data" / "bgt_pand_28992.gpkg"
    data = bytearray(outlines.read_bytes())
    data[-1] ^= 1
    outlines.write_bytes(data)
    report = check_catalog(delft)
    assert report.has_errors
    errors = {Path(f.where).name: f for f in report.of(Level.ERROR)}
    assert "missing" in errors[first.name].problem
    assert "truncated" in errors[second.name].problem
    assert "checksum" in errors[outlines.name].problem
    assert len(report.of(Level.ERROR)) == 3
    assert all(f.remedy for f in report.of(Level.ERROR))
    assert "0 of 2 files readable" in report.text()


def test_another_file_under_the_same_name(tmp_path: Path) -> None:
    path = _survey(tmp_path)
    create_catalog(tmp_path / "c", SurveyFiles(lidar=[path]), crs=RD)
    write_las(Path(path), points(30_000, size=90.0), "EPSG:25831")
    said = _said(check_catalog(tmp_path / "c"), Level.ERROR)
    for word in ("checksum differs", "30,000 points", "extent is not", "UTM zone 31N"):
        assert word in said


def test_outlines_outside_and_over_the_edge(tmp_path: Path) -> None:
    inside, there = houses(1)[0], shapely.box(CORNER[0] + 500, CORNER[1], CORNER[0] + 510, CORNER[1] + 10)
    edge = shapely.box(CORNER[0] - 5, CORNER[1] + 5, CORNER[0] + 5, CORNER[1] + 15)
    path = write_outlines(tmp_path / "o.gpkg", [inside, there, edge], name=["in", "far", "edge"])
    report = _checked(tmp_path, lidar=[_survey(tmp_path)], outlines=path, id_column="name")
    said = _said(report, Level.WARNING)
    assert "outside the survey: 1 (far)" in said
    assert "over the edge of the survey: 1 (edge)" in said
    assert not report.has_errors
    assert report.summary["outlines"] == "3, 2 in the survey, 1 outside"


def test_all_outlines_outside_is_an_error(tmp_path: Path) -> None:
    path = write_outlines(tmp_path / "o.gpkg", [shapely.box(0, 300_000, 10, 300_010)])
    assert "all outlines stand outside" in _said(
        _checked(tmp_path, lidar=[_survey(tmp_path)], outlines=path), Level.ERROR
    )


def test_outlines_that_cannot_be_buildings_are_counted(tmp_path: Path) -> None:
    a, b, _, _ = houses()
    x, y = CORNER[0] + 5, CORNER[1] + 5
    bow = shapely.Polygon([(x, y), (x + 5, y + 5), (x + 5, y), (x, y + 5)])
    flat = shapely.Polygon([(x, y), (x + 5, y), (x + 2, y)])
    path = write_outlines(
        tmp_path / "o.gpkg", [a, b, bow, flat, a, None], name=["a", "b", "bow", "flat", "again", "none"]
    )
    report = _checked(tmp_path, lidar=[_survey(tmp_path)], outlines=path, id_column="name")
    said = _said(report, Level.WARNING)
    assert "cross themselves or are invalid otherwise: 1 (bow)" in said
    assert "without area: 1 (flat)" in said
    assert "repeat another: 1 (again)" in said
    assert "without geometry: 1 (none)" in _said(report, Level.NOTE)


def test_reprojected_outlines_are_noted(tmp_path: Path) -> None:
    degrees = list(gpd.GeoSeries(houses(), crs="EPSG:28992").to_crs("EPSG:4326"))
    path = write_outlines(tmp_path / "o.gpkg", degrees, "EPSG:4326")
    report = _checked(tmp_path, lidar=[_survey(tmp_path)], outlines=path)
    assert "reprojected from WGS 84" in _said(report, Level.NOTE)
    assert "4 in the survey" in report.text()


def test_feet_and_wrong_country_are_suspected(tmp_path: Path) -> None:
    feet = points(20_000) / (0.3048, 0.3048, 1)
    assert "if they were feet" in _said(_checked(tmp_path, lidar=[_survey(tmp_path, xyz=feet, crs=None)]), Level.ERROR)
    far = points(20_000) + np.array([1.5e6, 1.2e6, 0])
    path = write_las(tmp_path / "far.laz", far)
    assert "outside the area of use" in _said(_checked(tmp_path, lidar=[str(path)]), Level.ERROR)


def test_what_a_survey_lacks_is_said(tmp_path: Path) -> None:
    path = write_las(tmp_path / "a.laz", points(4000))
    report = _checked(tmp_path, lidar=[str(path)], crs="EPSG:28992", attribution="")
    notes, warnings = _said(report, Level.NOTE), _said(report, Level.WARNING)
    assert "no point is classified as ground" in notes
    assert "more than one return" in notes
    assert "licence nor attribution" in notes
    assert "points per m²" in warnings
    assert "does not state the datum of heights" in warnings
    assert not report.has_errors


def test_absurd_heights_and_withheld_points_are_counted(tmp_path: Path) -> None:
    xyz = points(20_000)
    xyz[:3, 2] = 20_000.0
    withheld = np.zeros(20_000, np.uint8)
    withheld[10:15] = 1
    report = _checked(tmp_path, lidar=[_survey(tmp_path, xyz=xyz, withheld=withheld)])
    assert "5 are withheld and 3 impossibly high or low" in _said(report, Level.NOTE)
    assert "blunders" in _said(report, Level.WARNING)


def test_doubles_and_overlaps(tmp_path: Path) -> None:
    first = _survey(tmp_path)
    shutil.copy(first, tmp_path / "b.laz")
    moved = points(20_000, seed=5) + np.array([30.0, 0, 0])
    write_las(tmp_path / "d.laz", moved, "EPSG:28992", classification=np.full(20_000, 2, np.uint8))
    report = _checked(tmp_path, lidar=[str(tmp_path / "*.laz")])
    assert "a = b: the same file is there more than once" in _said(report, Level.ERROR)
    assert "a, d: their extents overlap by 50%" in _said(report, Level.NOTE)


def test_one_file_without_classes_among_others(tmp_path: Path) -> None:
    _survey(tmp_path)
    write_las(tmp_path / "b.laz", points(20_000, seed=4) + np.array([60.0, 0, 0]), "EPSG:28992")
    assert "b: no ground points" in _said(_checked(tmp_path, lidar=[str(tmp_path / "*.laz")]), Level.WARNING)


@pytest.mark.parametrize(
    ("east", "level", "message"),
    [(0, None, ""), (20, Level.WARNING, "in part only"), (900, Level.ERROR, "does not meet")],
)
def test_extent_of_an_external_dtm(tmp_path: Path, east: float, level: Level | None, message: str) -> None:
    transform = from_origin(CORNER[0] + east - 5, CORNER[1] + 65, 1.0, 1.0)
    profile = {"driver": "GTiff", "height": 70, "width": 70, "count": 1, "dtype": "float32", "crs": "EPSG:28992"}
    with rasterio.open(tmp_path / "dtm.tif", "w", transform=transform, **profile) as raster:
        raster.write(np.zeros((1, 70, 70), np.float32))
    report = _checked(tmp_path, lidar=[_survey(tmp_path)], dtm=tmp_path / "dtm.tif")
    if level is None:
        assert report.findings == ()
    else:
        assert message in _said(report, level)


def test_local_frame_is_noted(tmp_path: Path) -> None:
    report = _checked(tmp_path, lidar=[_survey(tmp_path)], crs="local")
    assert "products carry no CRS" in _said(report, Level.NOTE)
    assert "the file says Amersfoort" in _said(report, Level.WARNING)
    assert not report.has_errors


def test_no_catalog_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="no catalog here"):
        check_catalog(tmp_path)

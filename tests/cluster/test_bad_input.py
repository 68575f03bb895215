"""What bad input gets, from the catalog to the report: a message with file and remedy, a record for every unit, and healing."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import geopandas
import laspy
import numpy as np
import pytest
import rasterio
import shapely
from rasterio.transform import from_origin

from cluster.small_city import (
    BORDER_X,
    EAST,
    WEST,
    Commands,
    Done,
    SmallCity,
    attempts,
    contents,
    laz,
    make_city,
    newest,
    records,
    redone,
    report,
    scene,
    split,
    square,
    status_layer,
    with_absurd_heights,
)

pytestmark = pytest.mark.cluster

EMPTY = "u00001"
"""Loses all its points."""
CREATE = ("--crs", "EPSG:7415")


@pytest.fixture
def files(tmp_path: Path, small_city: SmallCity) -> Path:
    """The survey's files without a catalog."""
    folder = tmp_path / "files"
    folder.mkdir()
    for name in (WEST, EAST):
        (folder / name).write_bytes(small_city.lidar(name).read_bytes())
    return folder


def refused(cityflow: Commands, *arguments: str | Path) -> str:
    done = cityflow(*arguments)
    assert done.code == 1, done.text
    assert done.err.startswith("cityflow: ")
    assert "→" in done.err
    return done.err


def test_a_missing_lidar_file_makes_no_catalog(cityflow: Commands, files: Path, tmp_path: Path) -> None:
    (files / EAST).unlink()
    out = tmp_path / "catalog"
    text = refused(cityflow, "catalog", "create", out, "--lidar", files / WEST, "--lidar", files / EAST, *CREATE)
    assert EAST in text
    assert not out.exists()


@pytest.mark.parametrize("keep", [0.0, 0.001, 0.3, 0.9])
def test_a_truncated_lidar_file_makes_no_catalog_or_fails_its_check(
    cityflow: Commands, files: Path, tmp_path: Path, keep: float
) -> None:
    whole = (files / EAST).read_bytes()
    (files / EAST).write_bytes(whole[: int(keep * len(whole))])
    out = tmp_path / "catalog"
    text = refused(cityflow, "catalog", "create", out, "--lidar", files, *CREATE)
    assert EAST in text
    assert not out.exists()


def test_a_lidar_file_without_crs_needs_one_assigned(cityflow: Commands, files: Path, tmp_path: Path) -> None:
    (files / EAST).write_bytes(laz(scene().points, crs=None))
    out = tmp_path / "catalog"
    done = cityflow("catalog", "create", out, "--lidar", files / EAST)
    assert done.code != 0
    assert "--crs" in done.err
    assert not out.exists()
    assert cityflow("catalog", "create", out, "--lidar", files / EAST, *CREATE).code == 0


def test_a_header_whose_numbers_are_none_is_refused(cityflow: Commands, files: Path, tmp_path: Path) -> None:
    """The scale of the heights in a LAS header is a float: with NaN there, every height is NaN."""
    with laspy.open(files / EAST) as reader:
        record = reader.header.offsets
        assert np.isfinite(record).all()
    data = bytearray((files / EAST).read_bytes())
    data[147:155] = np.float64("nan").tobytes()  # z scale
    (files / EAST).write_bytes(data)
    text = refused(cityflow, "catalog", "create", tmp_path / "catalog", "--lidar", files, *CREATE)
    assert EAST in text


def test_a_picture_that_would_fill_the_memory_makes_no_catalog(cityflow: Commands, tmp_path: Path) -> None:
    """65,535 pixels square in 300 bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 65535, 65535, 8, 2, 0, 0, 0))
    body = chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + header + body)
    (tmp_path / "cameras.csv").write_text("id,width,height,focal_px\nc,65535,65535,50000\n")
    (tmp_path / "poses.csv").write_text("name,x,y,z,omega,phi,kappa\na.png,85000,447000,500,0,0,0\n")
    tables = ("--opk", tmp_path / "poses.csv", "--cameras", tmp_path / "cameras.csv", "--heights", "0,100")
    text = refused(cityflow, "catalog", "create", tmp_path / "catalog", "--images", tmp_path, *tables, *CREATE)
    assert "a.png: 65,535 × 65,535 pixels in 0.0 MB is no photograph" in text
    assert not (tmp_path / "catalog").exists()


@pytest.fixture(scope="module")
def odd_run(tmp_path_factory: pytest.TempPathFactory, cityflow: Commands) -> Path:
    """Of outlines in another CRS, points of which some are absurd, and a terrain raster that is NaN around a building."""
    folder = tmp_path_factory.mktemp("odd")
    city = make_city(folder / "town", crs="EPSG:32631", described=False)
    east = with_absurd_heights(split(scene().points)[EAST], np.random.default_rng(3), 0.05)
    city.lidar(EAST).write_bytes(laz(east))
    dtm = folder / "dtm.tif"
    write_dtm(dtm, scene().outlines["u00001"].buffer(4.0).bounds)
    told = cityflow("catalog", "create", city.catalog, "--lidar", city.lidar(""), "--outlines", city.outlines,
                    "--dtm", dtm, *CREATE, "--id-column", "name")  # fmt: skip
    assert "reprojected" in told.text
    assert "reprojected" in cityflow("catalog", "check", city.catalog).text
    cityflow.run(city, folder / "run")
    return folder / "run"


def write_dtm(path: Path, nan_bounds: tuple[float, float, float, float]) -> None:
    x, y = np.meshgrid(np.arange(84900.5, 85300), np.arange(447299.5, 446900, -1.0))
    z = scene().dtm(x.ravel(), y.ravel()).reshape(x.shape).astype(np.float32)
    z[shapely.contains_xy(shapely.box(*nan_bounds), x, y)] = np.nan
    with rasterio.open(
        path, "w", driver="GTiff", height=z.shape[0], width=z.shape[1], count=1, dtype="float32", crs="EPSG:28992",
        transform=from_origin(84900, 447300, 1, 1),
    ) as file:  # fmt: skip
        file.write(z, 1)


def test_outlines_of_another_crs_give_the_same_units_and_are_named(odd_run: Path, small_run: Path) -> None:
    assert "reprojected" in newest(odd_run, "ingest")["outlines"]["reason"]
    mine, theirs = newest(odd_run, "reconstruct"), newest(small_run, "reconstruct")
    assert mine.keys() == theirs.keys()
    assert {u: r["status"] for u, r in mine.items()} == {u: r["status"] for u, r in theirs.items()}
    for unit, record in mine.items():
        assert record["result"]["footprint_area_m2"] == pytest.approx(
            theirs[unit]["result"]["footprint_area_m2"], abs=0.05
        )


def test_absurd_heights_are_dropped_and_counted(odd_run: Path) -> None:
    assert newest(odd_run, "ingest")["east"]["result"]["dropped"]["absurd"] > 100
    assert {r["status"] for r in newest(odd_run, "reconstruct").values()} == {"done"}


def test_where_a_terrain_raster_is_nan_the_points_tell(odd_run: Path) -> None:
    units = newest(odd_run, "reconstruct")
    assert units.keys() == scene().outlines.keys()
    assert {r["status"] for r in units.values()} == {"done"}
    assert {r["result"]["dtm_method"] for r in newest(odd_run, "surface").values()} == {"external"}


BAD_OUTLINES: dict[str, tuple[shapely.Geometry | None, str, str]] = {
    "outside": (square(85500, 447050, 10), "refused", "outside the survey"),
    "far away": (square(185500, 447050, 10), "refused", "outside the survey"),
    "line": (shapely.Polygon([(85010, 447110), (85020, 447110), (85015, 447110)]), "refused", "area"),
    "point": (shapely.Polygon([(85010, 447110)] * 4), "refused", "area"),
    "empty": (shapely.Polygon(), "refused", "empty"),
    "none": (None, "refused", "empty"),
    "tiny": (square(85020, 447020, 0.2), "refused", "area"),
    "twin": (None, "refused", "same polygon"),
    "b/ö ?*'": (square(85030, 447110, 5), "failed", "point"),
}
"""Geometry, status, what the reason speaks of; the twin has that of u00003."""

BOWTIE = shapely.Polygon([(85120, 447100), (85130, 447110), (85130, 447100), (85120, 447110)])


@pytest.fixture(scope="module")
def bad_city(tmp_path_factory: pytest.TempPathFactory) -> SmallCity:
    """Every outline that is wrong, among those that are right; one of these stands where there is no point."""
    outlines: list[tuple[str, shapely.Geometry | None]] = list(scene().outlines.items())
    twin = scene().outlines["u00003"]
    outlines += [(name, twin if name == "twin" else geometry) for name, (geometry, _, _) in BAD_OUTLINES.items()]
    outlines += [("bowtie", BOWTIE), ("u00003", square(85002, 447002, 6))]
    city = make_city(tmp_path_factory.mktemp("bad"), outlines, described=False)
    points = scene().points
    hole = scene().outlines[EMPTY].buffer(0.5)
    left = points.take(~shapely.contains_xy(hole, points.xyz[:, 0], points.xyz[:, 1]))
    for name, part in split(left).items():
        city.lidar(name).write_bytes(laz(part))
    city.describe()
    return city


@pytest.fixture(scope="module")
def bad_run(bad_city: SmallCity, tmp_path_factory: pytest.TempPathFactory, cityflow: Commands) -> Path:
    run = tmp_path_factory.mktemp("bad run") / "run"
    cityflow.run(bad_city, run)
    return run


def test_bad_outlines_are_refused_or_repaired_one_by_one(bad_run: Path) -> None:
    units = newest(bad_run, "reconstruct")
    for name, (_, status, word) in BAD_OUTLINES.items():
        assert (name, units[name]["status"]) == (name, status)
        assert word in units[name]["reason"]
    assert {"bowtie-1", "bowtie-2", "u00003", "u00003-2"} <= units.keys()
    assert units["u00003"]["status"] == "done"


def test_repairs_of_outlines_are_recorded(bad_run: Path) -> None:
    outlines = geopandas.read_file(bad_run / "products" / "outlines.gpkg", layer="outlines").set_index("id")
    assert "self-" in outlines.loc["bowtie-1", "remark"]
    assert "part of 2" in outlines.loc["bowtie-1", "remark"]
    assert "given twice" in outlines.loc["u00003-2", "remark"]


def test_a_unit_without_a_single_point_fails_with_its_reason(bad_run: Path, small_run: Path) -> None:
    units, whole = newest(bad_run, "reconstruct"), newest(small_run, "reconstruct")
    assert units[EMPTY]["status"] in ("failed", "refused")
    assert "point" in units[EMPTY]["reason"]
    assert whole[EMPTY]["status"] == "done"
    others = whole.keys() - {EMPTY}
    assert {units[u]["status"] for u in others} == {"done"}


def test_every_outline_is_on_the_map_and_in_the_report(bad_run: Path, tmp_path: Path) -> None:
    units = {unit: str(record["status"]) for unit, record in newest(bad_run, "reconstruct").items()}
    expected = {*scene().outlines, *BAD_OUTLINES, "bowtie-1", "bowtie-2", "u00003-2"}
    assert units.keys() == expected
    assert status_layer(bad_run, tmp_path) == units
    assert {u["id"]: u["status"] for u in report(bad_run)["units"]} == units


def test_a_run_with_bad_units_is_not_done_again(cityflow: Commands, bad_city: SmallCity, bad_run: Path) -> None:
    assert redone(bad_run, lambda: cityflow.run(bad_city, bad_run)) == set()


def test_a_file_that_breaks_after_the_catalog_was_made_is_named_and_healed(
    cityflow: Commands, fifty_run: Path, tmp_path: Path
) -> None:
    """The western file is replaced by another, then cut off, then deleted. Tiles of 50 m: some need the eastern file only."""
    city, run = make_city(tmp_path / "town"), tmp_path / "run"
    city.change_workflow(tiles={"tile_m": 50, "index_cell_m": 25})
    file = city.lidar(WEST)
    whole = file.read_bytes()
    file.write_bytes(city.lidar(EAST).read_bytes())
    assert_only_the_west_fails(cityflow.run(city, run, ok=False), run, tmp_path, attempt=1)
    file.write_bytes(whole[: len(whole) // 2])
    assert_only_the_west_fails(cityflow("rerun", run, "--failed"), run, tmp_path, attempt=2)
    file.unlink()
    assert_only_the_west_fails(cityflow("rerun", run, "--failed"), run, tmp_path, attempt=3)
    file.write_bytes(whole)
    healed = cityflow("rerun", run, "--failed")
    assert healed.code == 0, healed.text
    assert contents(run) == contents(fifty_run)


def assert_only_the_west_fails(done: Done, run: Path, tmp_path: Path, attempt: int) -> None:
    assert done.code == 1
    assert WEST in done.err
    assert "→" in done.err
    tried = records(run, "ingest")["ingest", "west"]
    assert [r["status"] for r in tried] == ["failed"] * attempt
    assert {r["status"] for unit, r in newest(run, "surface").items() if unit.startswith("1702_")} == {"done"}
    units = newest(run, "reconstruct")
    assert units.keys() == scene().outlines.keys()
    unhurt = {u for u, o in scene().outlines.items() if o.bounds[0] > BORDER_X + 2}
    assert {u for u, r in units.items() if r["status"] == "done"} >= unhurt
    others = [r for u, r in units.items() if u not in unhurt]
    assert len(others) >= 3
    assert all("west" in r["reason"] and r["status"] != "done" for r in others)
    assert status_layer(run, tmp_path) == {u: r["status"] for u, r in units.items()}
    assert WEST in str(report(run)["problems"])


def test_ground_that_nobody_flew_over_stops_nothing(cityflow: Commands, small_run: Path, tmp_path: Path) -> None:
    """Sheets are rectangular, surveys are not: whole tiles may be without a point."""
    city = make_city(tmp_path / "town", described=False)
    points = scene().points
    x, y = points.xyz[:, 0], points.xyz[:, 1]
    corner = (x > 85139.9) & (y > 447119.9)
    for name, part in split(points.take((x < 85060) | (y < 447010) | corner)).items():
        city.lidar(name).write_bytes(laz(part))
    city.describe()
    city.change_workflow(tiles={"tile_m": 50, "index_cell_m": 25})
    run = tmp_path / "run"
    cityflow.run(city, run)
    assert 0 in {r["result"]["points"] for r in newest(run, "surface").values()}
    assert {r["status"] for r in newest(run, "export").values()} == {"done"}
    units, whole = newest(run, "reconstruct"), newest(small_run, "reconstruct")
    assert units.keys() == whole.keys()
    bare = {u for u, o in scene().outlines.items() if o.bounds[0] > 85061 and o.bounds[1] > 447011}
    assert bare
    assert all(units[u]["status"] in ("failed", "refused") and units[u]["reason"] for u in bare)
    assert {units[u]["status"] for u, o in scene().outlines.items() if o.bounds[2] < 85055} == {"done"}
    assert status_layer(run, tmp_path) == {u: r["status"] for u, r in units.items()}


def test_an_area_outside_the_survey_leaves_nothing(cityflow: Commands, small_city: SmallCity, tmp_path: Path) -> None:
    run = tmp_path / "run"
    text = cityflow.run(small_city, run, "--aoi", "0,0,10,10", ok=False).err
    assert "--aoi" in text
    assert not run.exists()


def test_tiles_that_are_no_multiple_of_the_cell_are_refused(
    cityflow: Commands, small_city: SmallCity, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    text = cityflow.run(small_city, run, "--set", "surface.cell_m=0.3", ok=False).err
    assert "cell_m" in text
    assert "tile_m" in text
    assert not run.exists()


def test_a_scheduler_that_does_not_answer_spoils_no_earlier_run(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    before, done = contents(copied_run), attempts(copied_run)
    cityflow.run(small_city, copied_run, "--set", "surface.cell_m=1", "--scheduler", "tcp://127.0.0.1:9", ok=False)
    assert contents(copied_run) == before
    assert redone(copied_run, lambda: cityflow.run(small_city, copied_run)) == set()
    assert attempts(copied_run) == done

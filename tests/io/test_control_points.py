from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS, Transformer

from cityflow.core.control_points import ControlPoint, ControlPoints, Mark, Role
from cityflow.errors import CatalogError
from cityflow.io.control_points.marked_images import with_catalog_names
from cityflow.io.control_points.pix4d_points import read_pix4d_points
from cityflow.io.control_points.read_points import read_control_points
from cityflow.io.control_points.references import in_crs
from cityflow.io.geoid import shipped_geoid

TABLE = """# crs: EPSG:25832+7837
point,x,y,z,sigma_xy,sigma_z,role,image,col,row,sigma_px
a,458010.5,5428020.25,112.125,0.01,0.02,control,s1.jpg,100.5,200.25,0.3
a,,,,,,,s2.jpg,300,40,
b,458110.5,5428120.25,113.5,,,check,s1.jpg,7,8,
c,458000,5428000,110,0.01,0.02,,,,,
"""
LIST = """EPSG:25832
458010.5 5428020.25 112.125 100 199.75 s1.jpg
458010.5 5428020.25 112.125 299.5 39.5 my%20s2.jpg
458110.5 5428120.25 113.5 6.5 7.5 s1.jpg CHK-b
"""
MARKERS = """<?xml version="1.0" encoding="UTF-8"?>
<document version="1.2.0"><chunk>
  <cameras><group id="0"><camera id="0" label="s1.jpg"/></group><camera id="1" label="s2.jpg"/></cameras>
  <markers next_id="4">
    <marker id="0" label="a"><reference x="458010.5" y="5428020.25" z="112.125" sx="0.01" sy="0.012" sz="0.02" enabled="1"/></marker>
    <marker id="2" label="b"><reference x="458110.5" y="5428120.25" z="113.5" enabled="0"/></marker>
    <marker id="3" label="free"/>
  </markers>
  <frames><frame id="0"><markers>
    <marker marker_id="0"><location camera_id="0" pinned="1" x="100.5" y="200.25"/><location camera_id="1" pinned="true" x="300" y="40"/></marker>
    <marker marker_id="2"><location camera_id="0" pinned="1" x="7" y="8"/><location camera_id="1" pinned="0" x="1" y="2"/></marker>
    <marker marker_id="3"><location camera_id="0" pinned="1" x="70" y="80"/></marker>
  </markers></frame></frames>
  <reference>EPSG:25832</reference>
  <settings><property name="accuracy_markers" value="0.005"/></settings>
</chunk></document>
"""
POINTS = "label,x,y,z,h,v\na,458010.5,5428020.25,112.125,0.01,0.02\nb,458110.5,5428120.25,113.5\n"
MARKS = "s1.jpg,a,100.5,200.25,0.5\nD:\\flight\\s2.jpg,a,300,40,1.0\ns1.jpg, b, 7, 8\n"


def _written(folder: Path, text: str, name: str = "gcp.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def _check(points: ControlPoints, names: tuple[str, ...], second: str = "s2.jpg") -> None:
    """The same two points in all formats, to the last bit."""
    assert tuple(p.name for p in points.points) == names
    found = {tuple(p.xyz): p for p in points.points}
    a, b = found[458010.5, 5428020.25, 112.125], found[458110.5, 5428120.25, 113.5]
    assert sorted((m.image, m.col, m.row) for m in a.marks) == sorted(
        [("s1.jpg", 100.5, 200.25), (second, 300.0, 40.0)]
    )
    assert [(m.image, m.col, m.row) for m in b.marks] == [("s1.jpg", 7.0, 8.0)]


def test_our_table(tmp_path: Path) -> None:
    points = read_control_points(_written(tmp_path, TABLE))
    _check(points, ("a", "b", "c"))
    a, b, c = points.points
    assert (a.sigmas_m, a.role, b.sigmas_m, b.role) == ((0.01, 0.01, 0.02), Role.CONTROL, None, Role.CHECK)
    assert a.marks == (Mark("s1.jpg", 100.5, 200.25, 0.3), Mark("s2.jpg", 300.0, 40.0))
    assert (c.marks, points.of_role(Role.CHECK)) == ((), (b,))
    assert CRS.from_wkt(points.crs_wkt or "").is_compound
    assert not points.notes


@pytest.mark.parametrize("sign", [";", "\t"])
def test_our_table_with_other_signs(tmp_path: Path, sign: str) -> None:
    _check(read_control_points(_written(tmp_path, TABLE.replace(",", sign))), ("a", "b", "c"))


def test_opendronemap(tmp_path: Path) -> None:
    points = read_control_points(_written(tmp_path, LIST, "gcp_list.txt"))
    _check(points, ("CHK-b", "point 1"), "my s2.jpg")
    assert [p.role for p in points.points] == [Role.CHECK, Role.CONTROL]
    other = read_control_points(_written(tmp_path, LIST.replace("EPSG:25832", "WGS84 UTM 32N")))
    assert CRS.from_wkt(other.crs_wkt or "").to_epsg() == 32632


def test_metashape(tmp_path: Path) -> None:
    points = read_control_points(_written(tmp_path, MARKERS, "markers.xml"))
    _check(points, ("a", "b"))
    a, b = points.points
    assert (a.sigmas_m, b.sigmas_m, b.role) == ((0.01, 0.012, 0.02), (0.005, 0.005, 0.005), Role.CHECK)
    assert "marks of free have no coordinates" in points.notes[0]


def test_pix4d(tmp_path: Path) -> None:
    path = _written(tmp_path, POINTS, "points.csv")
    _written(tmp_path, MARKS, "points_marks.csv")
    points = read_control_points(path)
    _check(points, ("a", "b"))
    assert [p.sigmas_m for p in points.points] == [(0.01, 0.01, 0.02), None]
    assert read_pix4d_points(path, tmp_path / "points_marks.csv").points[0].marks == points.points[0].marks


@pytest.mark.parametrize(("text", "match"), [
    (TABLE.replace("row,sigma_px", "line,sigma_px"), r"gcp\.csv:2: column 'line' is not known"),
    (TABLE.replace("point,x,y,z", "point,x,y"), r"gcp\.csv:2: column 'z' is missing → columns: point"),
    (TABLE.replace("112.125", "1l2"), r"gcp\.csv:3: '1l2' in point a is no number"),
    (TABLE.replace("a,,,,", "a,1,2,3,"), r"gcp\.csv:4: point a has other coordinates than before \(458010\.5, 5428020\.25, 112\.125\)"),
    (TABLE.replace("s2.jpg", "s1.jpg"), r"gcp\.csv:4: point a is marked twice in s1\.jpg"),
    (TABLE.replace("check", "chek"), r"gcp\.csv:5: role 'chek' of point b is neither control nor check"),
    (TABLE.replace("0.01,0.02,control", "0,0.02,control"), r"gcp\.csv:3: point a: standard deviations 0, 0, 0\.02 are not positive"),
    (TABLE.replace("300,40,", "300,,"), r"gcp\.csv:4: '' in the mark of point a is no number"),
    (TABLE.replace("EPSG:25832+7837", "EPSG:0"), r"gcp\.csv: the CRS 'EPSG:0' is not known"),
    (LIST.replace("200 199", "x").replace("100 199.75", "x 199.75"), r"gcp\.csv:2: 'x' in the line is no number"),
    (LIST.replace("EPSG:25832", "somewhere"), r"gcp\.csv:1: the CRS 'somewhere' is not known"),
    (POINTS.replace("113.5", "high"), r"gcp\.csv:3: 'high' in point b is no number"),
    (MARKERS.replace('z="113.5"', ""), r"gcp\.csv: '' in marker b is no number"),
    (MARKERS.replace('marker_id="2"', 'marker_id="9"'), r"a projection names marker 9 and camera 0"),
    ("<a/>", "no chunk with markers"), ("<a", "cannot be read"), ("point,x,y,z\n", "no point with coordinates"),
])  # fmt: skip
def test_what_is_wrong_is_named(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(CatalogError, match=match):
        read_control_points(_written(tmp_path, text))


def test_marks_of_pix4d_that_are_wrong(tmp_path: Path) -> None:
    path = _written(tmp_path, POINTS, "points.csv")
    _written(tmp_path, MARKS.replace("300", "3oo"), "points_marks.csv")
    with pytest.raises(CatalogError, match=r"points_marks\.csv:2: '3oo' in the mark of a is no number"):
        read_control_points(path)


def test_coordinates_are_led_to_the_catalog(tmp_path: Path) -> None:
    points = read_control_points(_written(tmp_path, LIST))
    same = in_crs(points, CRS.from_epsg(25832))
    assert same is points
    other = in_crs(points, CRS.from_user_input("EPSG:25833+7837"))
    truth = Transformer.from_crs(25832, 25833, always_xy=True).transform(*points.coordinates[:, :2].T)
    assert other.coordinates[:, :2] == pytest.approx(np.column_stack(truth), abs=1e-6)
    assert (other.coordinates[:, 2] == points.coordinates[:, 2]).all()
    assert other.points[0].marks == points.points[0].marks
    assert (
        "heights of control points are kept as they are (not stated); the catalog's are DHHN2016 height"
        in other.notes[1]
    )
    assert in_crs(points, None) is points


def test_points_without_a_crs_or_outside(tmp_path: Path) -> None:
    points = read_control_points(_written(tmp_path, POINTS))
    assert "state no CRS: taken as ETRS89 / UTM zone 32N" in in_crs(points, CRS.from_epsg(25832)).notes[0]
    with pytest.raises(CatalogError, match="control points a, b lie outside of"):
        in_crs(points, CRS.from_epsg(25832), given=CRS.from_epsg(4326))


def test_latitude_before_longitude_is_found(tmp_path: Path) -> None:
    """Pix4D writes latitude first in geographic coordinates; PROJ makes a place of it that is 6,000 km away."""
    right, exchanged = "a,4.36,52.01,45\nb,4.361,52.011,46\n", "a,52.01,4.36,45\nb,52.011,4.361,46\n"
    target, given = CRS.from_user_input("EPSG:28992+5709"), CRS.from_epsg(4979)
    found = in_crs(read_control_points(_written(tmp_path, right)), target, given)
    assert found.coordinates[0, :2] == pytest.approx([84_400, 447_300], abs=300)
    with pytest.raises(CatalogError, match="control points a, b lie outside of Amersfoort"):
        in_crs(read_control_points(_written(tmp_path, exchanged)), target, given)


def test_coordinates_of_another_crs_than_the_catalog_are_found(tmp_path: Path) -> None:
    points = read_control_points(_written(tmp_path, POINTS))
    with pytest.raises(CatalogError, match="control points a, b lie outside of Amersfoort / RD New"):
        in_crs(points, CRS.from_epsg(28992))


def test_heights_change_with_their_datum(tmp_path: Path) -> None:
    """Heights above the ellipsoid become those above the geoid where its grid is installed; else that is said."""
    points = read_control_points(_written(tmp_path, LIST.replace("EPSG:25832", "EPSG:4937").replace("458010.5 5428020.25", "8.42 49.0").replace(
        "458110.5 5428120.25", "8.43 49.01")))  # fmt: skip
    flat = in_crs(points, CRS.from_epsg(25832))
    assert "(ellipsoidal); the catalog's are not stated" in flat.notes[1]
    led = in_crs(points, CRS.from_user_input("EPSG:25832+7837"))
    geoid = points.coordinates[:, 2] - led.coordinates[:, 2]
    assert "grid that is not installed" in str(led.notes) or (np.abs(geoid - 48) < 2).all()


def test_heights_that_are_unknown_leave_points_in_plan(tmp_path: Path) -> None:
    """OpenDroneMap allows NaN; so do we, in the list and in our table, and through a transformation."""
    listed = read_control_points(_written(tmp_path, LIST.replace("112.125", "NaN"), "gcp_list.txt"))
    table = read_control_points(_written(tmp_path, TABLE.replace("112.125", "nan"), "points.csv"))
    for found, name in ((listed, "point 1"), (table, "a")):
        assert {p.name for p in found.points if np.isnan(p.xyz[2])} == {name}
        assert "no height and are used in plan alone" in found.notes[-1]
    moved = in_crs(table, CRS.from_user_input("EPSG:25833+7837"))
    assert np.isnan(moved.points[0].xyz[2])
    assert np.isfinite(moved.points[0].xyz[:2]).all()
    with pytest.raises(CatalogError, match="no number"):
        read_control_points(
            _written(tmp_path, TABLE.replace("112.125", "nan").replace("458010.5", "nan"), "points.csv")
        )


def test_marks_are_led_to_the_names_of_a_catalog(tmp_path: Path) -> None:
    """By the end of a path, by the file's name with and without its ending; two files of one name need their folder."""
    table = "point,x,y,z,image,col,row\n" + "".join(
        f"a,1,2,3,{name},{k},5\n"
        for k, name in enumerate(("S1", "D:\\flight\\s2.JPG", "left/s3.jpg", "s3.jpg", "none.jpg"))
    )
    points = read_control_points(_written(tmp_path, table, "points.csv"))
    files = {
        "s1": "/data/s1.tif",
        "s2": "/data/s2.jpg",
        "left_s3": "/data/left/s3.jpg",
        "right_s3": "/data/right/s3.jpg",
    }
    found = with_catalog_names(points, files)
    assert [(m.image, m.col) for m in found.points[0].marks] == [("left_s3", 2.0), ("s1", 0.0), ("s2", 1.0)]
    assert [note.split(": ")[-1] for note in found.notes] == ["none.jpg", "s3.jpg"]


@pytest.mark.parametrize("source", ["EPSG:4979", "EPSG:4326+5773"])
@pytest.mark.parametrize(
    ("xyz", "degrees"),
    [
        # RDNAPTRANS2018 (variant 1): x, y, NAP height; longitude, latitude (ETRS89), height above the ellipsoid
        ((85000.0, 447500.0, 0.0), (4.36758120, 52.01144271, 43.5040)),
        ((155000.0, 463000.0, 0.0), (5.387203657, 52.155172897, 43.2551)),
        ((64640.89, 440700.0101, 4.0), (4.072887101, 51.947393898, 47.5968)),
    ],
)
def test_places_with_heights_are_led_to_a_crs_with_heights(
    source: str, xyz: tuple[float, float, float], degrees: tuple[float, float, float]
) -> None:
    """Without any grid of PROJ's, whose ways in three dimensions are off by a hundred metres in plan or do not exist: decimetres, and back."""
    longitude, latitude, height = degrees
    if source != "EPSG:4979":
        height -= float(shipped_geoid().undulation(np.array([longitude]), np.array([latitude]))[0])
    wkt = CRS.from_user_input(source).to_wkt()
    given = ControlPoints((ControlPoint("a", np.array([longitude, latitude, height])),), wkt)
    target = CRS.from_user_input("EPSG:7415")
    found = in_crs(given, target)
    off = found.coordinates[0] - xyz
    assert np.hypot(off[0], off[1]) < 0.25
    assert abs(off[2]) < 0.5
    assert "EGM96" in found.notes[1]
    back = in_crs(found, CRS.from_user_input(source)).coordinates[0] - given.coordinates[0]
    assert np.abs(back[:2]).max() < 1e-7
    assert abs(back[2]) < 1e-6


def test_heights_stay_where_only_the_plan_changes() -> None:
    point = ControlPoint("a", np.array([3500000.0, 5400000.0, 412.25]))
    given = ControlPoints((point,), CRS.from_user_input("EPSG:31467+7837").to_wkt())
    found = in_crs(given, CRS.from_user_input("EPSG:25832+7837"))
    assert found.coordinates[0, 2] == pytest.approx(412.25, abs=1e-9)
    plan = in_crs(given, CRS.from_epsg(25832))
    assert found.coordinates[0, :2] == pytest.approx(plan.coordinates[0, :2], abs=0.05)

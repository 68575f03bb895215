"""Edits that the desk writes stand in the file as QGIS's do, one by one, whoever else writes it."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

import geopandas
import pytest
import shapely

from cityflow.errors import CatalogError
from cityflow.io.crs import resolve
from cityflow.io.tables.edits_gpkg import CUT_LINES, LOCKED, REJECTED, ROOF_TYPES, read_edits
from cityflow.io.tables.edits_written import ConflictError, Edit, EditsFile

RD = resolve("EPSG:7415")
X, Y = 90000.0, 460000.0
HOUSE = shapely.box(X, Y, X + 10, Y + 8)


def file_in(folder: Path) -> EditsFile:
    return EditsFile(folder / "edits.gpkg", RD)


def test_every_kind_is_read_back_by_a_run(tmp_path: Path) -> None:
    file = file_in(tmp_path)
    file.add(Edit("a", REJECTED, HOUSE, who="ann", when=5.0))
    file.add(Edit("b", CUT_LINES, shapely.LineString([(X + 5, Y), (X + 5, Y + 8)])))
    file.add(Edit("c", LOCKED, HOUSE, "house 1"))
    file.add(Edit("d", ROOF_TYPES, HOUSE.centroid, "hip"))
    found = read_edits(str(file.path), RD)
    assert found.rejected[0].equals(HOUSE)
    assert found.cut_lines[0].length == 8
    assert (found.outlines[0].id, found.outlines[0].locked) == ("house 1", True)
    assert found.roof_type_of(HOUSE) == "hip"
    first = next(e for e in file.edits() if e.name == "a")
    assert (first.who, first.when, first.layer) == ("ann", 5.0, REJECTED)
    table = geopandas.read_file(file.path, layer=REJECTED)
    assert table.crs.to_epsg() == 28992
    assert list(table.sindex.query(HOUSE)) == [0]


def test_an_edit_is_undone_and_what_it_replaced_stands_again(tmp_path: Path) -> None:
    file = file_in(tmp_path)
    file.add(Edit("a", LOCKED, HOUSE, "house 1"))
    with pytest.raises(ConflictError, match="drawn already"):
        file.add(Edit("b", LOCKED, HOUSE.buffer(1, join_style=2), "house 1"))
    file.add(Edit("b", LOCKED, HOUSE.buffer(1, join_style=2), "house 1"), replaces="a")
    assert [e.name for e in file.edits()] == ["b"]
    with pytest.raises(ConflictError, match="gone"):
        file.add(Edit("c", LOCKED, HOUSE, "house 1"), replaces="a")
    assert [e.name for e in file.edits()] == ["b"]
    file.remove("b")
    assert [(e.name, e.shape.equals(HOUSE)) for e in file.edits()] == [("a", True)]
    file.remove("a")
    assert file.edits() == []
    assert len(read_edits(str(file.path), RD)) == 0
    with pytest.raises(ConflictError, match="gone"):
        file.remove("a")


def test_a_file_of_qgis_keeps_its_features_reference_and_kinds(tmp_path: Path) -> None:
    file = file_in(tmp_path)
    shed = geopandas.GeoDataFrame({"remark": ["a shed"]}, geometry=[shapely.Point(4.37, 52.01)], crs=4326)
    shed.to_file(file.path, layer=REJECTED)
    file.add(Edit("a", REJECTED, HOUSE))
    table = geopandas.read_file(file.path, layer=REJECTED)
    assert set(table.geom_type) == {"Point"}, "the layer takes points"
    assert table.remark[0] == "a shed"
    inside = read_edits(str(file.path), RD).rejected[1]
    assert HOUSE.contains(inside)
    assert [e.name for e in file.edits()] == ["", "a"]
    with pytest.raises(CatalogError, match="no layer cut_lines"):
        file.add(Edit("b", CUT_LINES, shapely.LineString([(X, Y), (X, Y + 8)])))


@pytest.mark.parametrize(
    ("edit", "problem"),
    [
        (Edit("a", CUT_LINES, shapely.LineString([(X, Y), (X + 5, Y + 4), (X, Y + 8)])), "not straight"),
        (Edit("a", LOCKED, shapely.Polygon([(X, Y), (X + 5, Y + 5), (X + 5, Y), (X, Y + 5)])), "no valid polygon"),
        (Edit("a", LOCKED, HOUSE.centroid), "is a Point"),
        (Edit("a", ROOF_TYPES, HOUSE.centroid, "hipp"), "did you mean 'hip'"),
    ],
)
def test_what_a_run_would_refuse_is_not_written(tmp_path: Path, edit: Edit, problem: str) -> None:
    with pytest.raises(CatalogError, match=problem):
        file_in(tmp_path).add(edit)
    assert file_in(tmp_path).edits() == []


WRITER = """
import sys, shapely
from pathlib import Path
from cityflow.io.crs import resolve
from cityflow.io.tables.edits_written import Edit, EditsFile
file = EditsFile(Path(sys.argv[1]), resolve("EPSG:7415"))
for k in range(20):
    file.add(Edit(f"{sys.argv[2]}{k}", "rejected", shapely.Point(90000 + k, 460000)))
"""


def test_nothing_is_lost_where_two_processes_and_two_threads_write(tmp_path: Path) -> None:
    file = file_in(tmp_path)
    others = [subprocess.Popen([sys.executable, "-c", WRITER, str(file.path), name]) for name in "pq"]
    threads = [
        threading.Thread(target=lambda n=name: [file.add(Edit(f"{n}{k}", REJECTED, HOUSE)) for k in range(20)]) for name in "rs"
    ]  # fmt: skip
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [p.wait(120) for p in others] == [0, 0]
    assert sorted(e.name for e in file.edits()) == sorted(f"{n}{k}" for n in "pqrs" for k in range(20))
    assert len(read_edits(str(file.path), RD).rejected) == 80

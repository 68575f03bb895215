"""Points of known position from tables and vector files."""

from __future__ import annotations

from pathlib import Path

import geopandas
import numpy as np
import pytest
import shapely

from cityflow.errors import CatalogError
from cityflow.io.crs import resolve
from cityflow.io.tables.checkpoints import read_checkpoints

RD = resolve("EPSG:7415")


def written(path: Path, text: str) -> str:
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    "text", ["id,X,Y,Z,kind\na,1,2,3,roof\nb,4,5,6,\n", "kind;north;east;height;name\nroof;2;1;3;a\n;5;4;6;b\n"]
)
def test_columns_are_found_by_name(tmp_path: Path, text: str) -> None:
    points = read_checkpoints(written(tmp_path / "p.csv", text), RD)
    assert points.names == ("a", "b")
    assert points.kinds == ("roof", "")
    assert points.xyz.tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("id,X,Y\na,1,2\n", "no column Z"),
        ("X,Y,Z\n1,2,here\n", "line 2: 'here'"),
        ("X,Y,Z\n", "no points"),
        ("", "no column X"),
    ],
)
def test_bad_tables_are_explained(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(CatalogError, match=said):
        read_checkpoints(written(tmp_path / "p.csv", text), RD)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="gone"):
        read_checkpoints(str(tmp_path / "gone.csv"), RD)


def test_vector_points_are_brought_into_the_world_frame(tmp_path: Path) -> None:
    xyz = np.array([[85010.0, 447020.0, 3.5], [85500.0, 447900.0, 7.25]])
    frame = geopandas.GeoDataFrame({"kind": ["road", "roof"]}, geometry=list(shapely.points(xyz)), crs="EPSG:28992")
    frame.to_crs("EPSG:4258").to_file(tmp_path / "p.gpkg")
    points = read_checkpoints(str(tmp_path / "p.gpkg"), RD)
    assert np.allclose(points.xyz, xyz, atol=0.01)
    assert points.kinds == ("road", "roof")


def test_lines_are_no_points(tmp_path: Path) -> None:
    line = shapely.LineString([(0, 0, 0), (1, 1, 1)])
    geopandas.GeoDataFrame(geometry=[line], crs="EPSG:28992").to_file(tmp_path / "p.gpkg")
    with pytest.raises(CatalogError, match="not every feature is a point"):
        read_checkpoints(str(tmp_path / "p.gpkg"), RD)

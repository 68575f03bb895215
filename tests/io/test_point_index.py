from __future__ import annotations

import io
import math
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import laspy
import numpy as np
import pytest

from cityflow.core.grid import tile_at, tiles_over
from cityflow.core.points import PointCloud
from cityflow.errors import CatalogError
from cityflow.io.points.las import read_points
from cityflow.io.points.point_index import FileIndex, split_file
from survey_files import DELFT, points, write_las

LAZ = DELFT / "data" / "ahn3_cropped_2.laz"


def read_piece(data: bytes) -> PointCloud:
    with NamedTemporaryFile(suffix=".laz") as file:
        file.write(data)
        file.flush()
        return read_points(file.name)


def _pieces(path: Path, cell_m: float = 50.0, **options: Any) -> tuple[FileIndex, dict[str, bytes]]:
    pieces: dict[str, bytes] = {}
    return split_file(path, cell_m, pieces.__setitem__, **options), pieces


def test_no_point_is_lost_doubled_or_moved() -> None:
    index, pieces = _pieces(LAZ)
    whole = read_points(LAZ)
    clouds = {name: read_piece(data) for name, data in pieces.items()}
    joined = np.concatenate([c.xyz for c in clouds.values()])
    assert np.array_equal(joined[np.lexsort(joined.T)], whole.xyz[np.lexsort(whole.xyz.T)])
    assert index.points == len(whole) == sum(index.cells.values())
    assert index.cells == {name: len(c) for name, c in clouds.items()}
    assert index.classes == {1: 86308, 2: 87130, 6: 33312, 9: 568, 26: 1114}
    assert index.bounds == pytest.approx((*whole.xyz[:, :2].min(axis=0), *whole.xyz[:, :2].max(axis=0)))
    assert index.has_returns


def test_each_point_lies_in_its_cell_and_keeps_the_order_of_the_file() -> None:
    _, pieces = _pieces(LAZ)
    whole = read_points(LAZ)
    owner = np.floor(whole.xyz[:, :2] / 50.0).astype(int)
    for name, data in pieces.items():
        cell = read_piece(data)
        mine = (owner == [int(v) for v in name.split("_")]).all(axis=1)
        assert np.array_equal(cell.xyz, whole.xyz[mine])
        assert np.array_equal(cell.return_number, whole.return_number[mine])
        assert np.array_equal(cell.classification, whole.classification[mine])


def test_pieces_do_not_depend_on_chunks() -> None:
    index, pieces = _pieces(LAZ)
    for chunk in (10_007, 50_000, 208_432):
        other, same = _pieces(LAZ, chunk=chunk)
        assert same == pieces
        assert list(same) == list(pieces)
        assert other == index


def test_pieces_carry_the_date_of_the_source_and_nothing_of_today() -> None:
    _, pieces = _pieces(LAZ)
    with laspy.open(io.BytesIO(next(iter(pieces.values())))) as reader:
        assert reader.header.creation_date.isoformat() == "2014-03-04"
        assert reader.header.generating_software == "cityflow"


def test_negative_cells_and_points_on_an_edge(tmp_path: Path) -> None:
    xyz = np.array([[-0.001, -50.0, 1], [0, 0, 1], [50, 49.999, 1], [-50.001, 0, 1]])
    index, _ = _pieces(write_las(tmp_path / "a.laz", xyz))
    assert index.cells == {"-1_-1": 1, "-2_0": 1, "0_0": 1, "1_0": 1}
    assert all(tile_at(x, y, 50.0).name in index.cells for x, y, _ in xyz)


def test_reader_of_a_box_finds_all_its_points_in_the_cells_over_it() -> None:
    _, pieces = _pieces(LAZ)
    box = (85010.0, 447470.0, 85060.0, 447550.0)
    near = [pieces[c.name] for c in tiles_over(box, 50.0) if c.name in pieces]
    assert len(near) < len(pieces)
    assert sum(len(read_piece(data).within(box)) for data in near) == len(read_points(LAZ).within(box))


def test_unusable_points_stay_out(tmp_path: Path) -> None:
    xyz = points(1000)
    xyz[:10, 2] = 99_999.0
    index, pieces = _pieces(write_las(tmp_path / "a.laz", xyz))
    assert index.dropped == {"withheld": 0, "absurd": 10}
    assert sum(len(read_piece(d)) for d in pieces.values()) == 990
    with pytest.raises(CatalogError, match="no point is usable"):
        _pieces(write_las(tmp_path / "b.laz", xyz[:10]))


def test_absurdly_many_cells_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cityflow.io.points.point_index.MAX_CELLS", 100)
    with pytest.raises(CatalogError, match="units and extent"):
        _pieces(write_las(tmp_path / "a.laz", points(5000, size=5000.0)))


def test_cut_file_gives_an_error_that_names_it(tmp_path: Path) -> None:
    path = tmp_path / "cut.laz"
    path.write_bytes(LAZ.read_bytes()[:-1000])
    with pytest.raises(CatalogError, match=r"cut\.laz"):
        _pieces(path)


def test_spilling_to_disk_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    _, pieces = _pieces(LAZ)
    monkeypatch.setattr("cityflow.io.points.point_index.SPILL_BYTES", 1000)
    assert _pieces(LAZ, chunk=20_000)[1] == pieces
    assert math.isclose(len(pieces), 12, abs_tol=6)

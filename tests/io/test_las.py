from __future__ import annotations

import io
from datetime import date
from pathlib import Path

import laspy
import numpy as np
import pytest
from pyproj import CRS

from cityflow.core.points import PointCloud
from cityflow.errors import CatalogError
from cityflow.io.points.las import Dropped, read_counted, read_points, sample, stream
from cityflow.io.points.las_header import read_header
from cityflow.io.points.las_write import write_points
from survey_files import DELFT, points, write_las, write_one_stream

LAZ = DELFT / "data" / "ahn3_cropped_2.laz"


def test_header_of_the_real_file() -> None:
    header = read_header(LAZ)
    assert (header.points, header.version, header.point_format, header.returns) == (208_432, "1.2", 1, 5)
    assert header.created == date(2014, 3, 4)
    assert header.crs is None
    assert header.bounds == pytest.approx((85000.001, 447412.8, 85072.299, 447641.299))
    assert header.density == pytest.approx(12.6, abs=0.1)


@pytest.mark.parametrize(("version", "crs"), [("1.2", "EPSG:28992"), ("1.4", "EPSG:28992"), ("1.4", "EPSG:7415")])
def test_crs_of_geotiff_keys_and_wkt(tmp_path: Path, version: str, crs: str) -> None:
    header = read_header(write_las(tmp_path / "a.laz", points(), crs, version))
    assert header.crs is not None
    assert header.crs.to_epsg() == int(crs.removeprefix("EPSG:"))


def test_every_cut_of_a_laz_file_is_noticed_before_a_point_is_read(tmp_path: Path) -> None:
    whole = LAZ.read_bytes()
    for length in (1, 100, 300, 340, len(whole) // 2, len(whole) - 100, len(whole) - 1):
        cut = tmp_path / "cut.laz"
        cut.write_bytes(whole[:length])
        with pytest.raises(CatalogError) as caught:
            read_header(cut)
        assert "cut.laz" in str(caught.value)
        assert caught.value.remedy


@pytest.mark.parametrize(("items_version", "chunk_size"), [(1, 0), (2, 50_000), (2, 2**32 - 1)])
def test_laz_without_chunks_is_read_and_its_cuts_are_noticed(
    tmp_path: Path, items_version: int, chunk_size: int
) -> None:
    xyz = points(60_000)
    classes = np.r_[np.full(59_999, 6, np.uint8), np.uint8(9)]
    plain = write_las(tmp_path / "a.las", xyz, classification=classes)
    path = write_one_stream(tmp_path / "stream.laz", plain, items_version, chunk_size)
    assert read_header(path).points == 60_000
    assert np.array_equal(read_points(path).xyz, read_points(plain).xyz)
    assert sample(path).classes == {6: 59_999, 9: 1}
    whole = path.read_bytes()
    for cut in (1, len(whole) // 2):
        path.write_bytes(whole[:-cut])
        for read in (sample, read_points):
            with pytest.raises(CatalogError, match=r"stream\.laz"):
                read(path)


def test_cut_las_is_noticed(tmp_path: Path) -> None:
    path = write_las(tmp_path / "a.las", points())
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(CatalogError, match="truncated"):
        read_header(path)


def test_bytes_damaged_in_the_middle_never_pass_in_silence(tmp_path: Path) -> None:
    # LAZ has no check sums: what decompresses may be wrong, but as many points as promised or an error must come.
    broken = bytearray(LAZ.read_bytes())
    broken[400:200_000] = bytes(199_600)
    path = tmp_path / "broken.laz"
    path.write_bytes(broken)
    with pytest.raises(CatalogError, match=r"broken\.laz"):
        read_points(path)


def test_missing_empty_foreign_and_pointless_files(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="does not exist"):
        read_header(tmp_path / "none.laz")
    (tmp_path / "empty.laz").touch()
    with pytest.raises(CatalogError, match="no readable LAS"):
        read_header(tmp_path / "empty.laz")
    (tmp_path / "text.laz").write_text("x y z\n" * 1000)
    with pytest.raises(CatalogError, match="no readable LAS"):
        read_header(tmp_path / "text.laz")
    with pytest.raises(CatalogError, match="no points"):
        read_header(write_las(tmp_path / "nothing.laz", np.empty((0, 3))))


def test_header_with_nan_extent_is_refused(tmp_path: Path) -> None:
    path = write_las(tmp_path / "nan.las", points())
    data = bytearray(path.read_bytes())
    data[179:187] = np.float64("nan").tobytes()  # LAS 1.x: max x
    path.write_bytes(data)
    with pytest.raises(CatalogError, match="not a number"):
        read_header(path)


def test_withheld_and_absurd_points_are_dropped_and_counted(tmp_path: Path) -> None:
    xyz = points(1000)
    xyz[:7, 2] = 50_000.0
    xyz[7:10, 2] = -20_000.0
    withheld = np.zeros(1000, np.uint8)
    withheld[[5, 20, 30]] = 1
    cloud, dropped = read_counted(write_las(tmp_path / "a.laz", xyz, withheld=withheld))
    assert dropped == Dropped(withheld=3, absurd=9)
    assert len(cloud) == 988
    assert np.abs(cloud.xyz[:, 2]).max() <= 10


def test_returns_of_zero_count_as_single(tmp_path: Path) -> None:
    zeros = np.zeros(100, np.uint8)
    cloud = read_points(write_las(tmp_path / "a.laz", points(100), return_number=zeros, number_of_returns=zeros))
    assert (cloud.number_of_returns == 1).all()
    assert (cloud.return_number == 1).all()


def test_stream_is_the_file_in_parts() -> None:
    whole = read_points(LAZ)
    parts = [cloud for cloud, _ in stream(LAZ, chunk=60_001)]
    assert [len(p) for p in parts] == [60_001, 60_001, 60_001, 28_429]
    assert np.array_equal(np.concatenate([p.xyz for p in parts]), whole.xyz)
    reference = laspy.read(LAZ)
    assert np.array_equal(whole.xyz, reference.xyz)
    assert np.array_equal(whole.classification, reference.classification)


def test_written_points_come_back_by_laspy_to_half_a_millimetre(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    xyz, n = points(2000, seed=3), 2000
    count = rng.integers(1, 6, n).astype(np.uint8)
    cloud = PointCloud(
        xyz, rng.integers(0, 255, n).astype(np.uint8), rng.integers(1, count + 1).astype(np.uint8), count
    )
    data = write_points(cloud, crs=CRS.from_epsg(7415))
    las = laspy.read(io.BytesIO(data))
    assert np.abs(las.xyz - xyz).max() <= 0.0005 + 1e-9
    assert np.array_equal(las.classification, cloud.classification)
    assert np.array_equal(las.return_number, cloud.return_number)
    assert np.array_equal(las.number_of_returns, cloud.number_of_returns)
    assert las.header.parse_crs().to_epsg() == 7415
    assert las.header.creation_date == date(2000, 1, 1)
    assert write_points(cloud, crs=CRS.from_epsg(7415)) == data
    (tmp_path / "again.laz").write_bytes(data)
    stored = read_points(tmp_path / "again.laz")
    assert np.array_equal(stored.xyz, las.xyz)


def test_points_too_far_apart_for_the_scale_are_refused() -> None:
    with pytest.raises(ValueError, match="32 bits"):
        write_points(PointCloud.of(np.array([[0.0, 0, 0], [3e6, 0, 0]])), scale=0.001)


def test_sample_of_a_large_file_sees_its_end(tmp_path: Path) -> None:
    n = 1_300_000
    xyz = np.zeros((n, 3))
    classes = np.full(n, 2, np.uint8)
    classes[-120_000:] = 6
    seen = sample(write_las(tmp_path / "large.laz", xyz, classification=classes))
    assert seen.points == 1_200_000
    assert set(seen.classes) == {2, 6}
    assert sample(LAZ).classes == {1: 86308, 2: 87130, 6: 33312, 9: 568, 26: 1114}

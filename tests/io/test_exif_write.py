"""EXIF written and read back; the pixels stay."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cityflow.core.control_points import ControlPoint, ControlPoints, Mark, Role
from cityflow.core.photo_metadata import GnssPosition, HeightKind, PhotoMetadata
from cityflow.io.control_points.point_table import read_point_table
from cityflow.io.control_points.point_table_write import point_table_text
from cityflow.io.images.exif_and_xmp import photo_metadata
from cityflow.io.images.exif_write import with_exif
from cityflow.io.images.image_write import jpeg_bytes

PLAIN = jpeg_bytes(np.random.default_rng(1).integers(0, 255, (48, 64, 3), np.uint8), 90)
PHOTO = PhotoMetadata(
    "a.jpg", 64, 48, "cityflow", "synthetic nadir", taken="2026:06:21 10:00:04", focal_mm=35.1234, sensor_width_mm=35.9,
    position=GnssPosition(-52.0116071, 4.3571234, 812.345, HeightKind.ELLIPSOID, (0.1, 0.1, 0.1)),
)  # fmt: skip


def test_tags_come_back_and_pixels_are_the_same(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(with_exif(PLAIN, PHOTO))
    found = photo_metadata(path)
    assert found.position is not None
    assert (found.make, found.model, found.taken, found.width) == ("cityflow", "synthetic nadir", PHOTO.taken, 64)
    assert found.position.latitude == pytest.approx(-52.0116071, abs=3e-10)
    assert found.position.longitude == pytest.approx(4.3571234, abs=3e-10)
    assert found.position.height_m == pytest.approx(812.345)
    assert (found.position.height_kind, found.position.sigmas_m) == (HeightKind.ELLIPSOID, (0.1, 0.1, 0.1))
    assert found.focal_px == pytest.approx(35.1234 / 35.9 * 64, rel=1e-5)
    assert (np.asarray(Image.open(path)) == np.asarray(Image.open(io.BytesIO(PLAIN)))).all()


def test_heights_below_the_sea_and_what_is_no_jpeg(tmp_path: Path) -> None:
    path = tmp_path / "a.jpg"
    path.write_bytes(with_exif(PLAIN, replace(PHOTO, position=GnssPosition(52.0, 4.0, -3.5))))
    found = photo_metadata(path).position
    assert found is not None
    assert found.height_m == -3.5
    with pytest.raises(ValueError, match=r"a\.jpg is no JPEG"):
        with_exif(b"II*\x00", PHOTO)


def test_a_table_of_control_points_comes_back(tmp_path: Path) -> None:
    points = ControlPoints(
        (
            ControlPoint("C01", np.array([85010.1234, 447020.5, -3.25]), (0.02, 0.02, 0.04), Role.CONTROL,
                         (Mark("a.jpg", 10.125, 20.5, 0.3), Mark("b.jpg", 0.25, 47.0))),
            ControlPoint("K01", np.array([85040.0, 447001.5, 12.0]), None, Role.CHECK),
        )
    )  # fmt: skip
    path = tmp_path / "control.csv"
    path.write_text(point_table_text(points, "EPSG:7415"))
    found = read_point_table(path)
    assert found.crs_wkt is not None
    for a, b in zip(found.points, points.points, strict=True):
        assert (a.name, a.role, a.sigmas_m) == (b.name, b.role, b.sigmas_m)
        assert a.xyz == pytest.approx(b.xyz, abs=1e-4)
        assert [m.image for m in a.marks] == [m.image for m in b.marks]
        assert [m.col for m in a.marks] == pytest.approx([m.col for m in b.marks], abs=1e-3)

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from cityflow.core.camera import Camera
from cityflow.errors import CatalogError
from cityflow.io.orientation.camera_calibration import australis_camera, metashape_camera
from cityflow.io.orientation.camera_table import read_camera_table

BASE = {"id": "c", "width": 6000, "height": 4000}


def _read(path: Path, *entries: dict[str, object]) -> dict[str, Camera]:
    path.write_text(yaml.safe_dump({"cameras": list(entries)}))
    return dict(read_camera_table(path).cameras)


def test_millimetres_become_pixels(tmp_path: Path) -> None:
    """x0 to the right, y0 upwards, as calibration reports have them."""
    entry = BASE | {"focal_mm": 35.0, "pixel_mm": 0.005, "offset_x_mm": 0.1, "offset_y_mm": 0.05}
    camera = _read(tmp_path / "c.yaml", entry)["c"]
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == pytest.approx((7000, 7000, 3020, 1990))
    assert camera.distortion == ()


def test_csv(tmp_path: Path) -> None:
    path = tmp_path / "c.csv"
    path.write_text(
        "# cameras\nid;width;height;focal_px;cx;cy;k1;p1\n1;600;400;500;301;199;-0.1;0.001\n2;600;400;510;;;;\n"
    )
    table = read_camera_table(path)
    assert table.cameras["1"] == Camera(600, 400, 500, 500, 301, 199, (-0.1, 0, 0.001, 0))
    assert table.cameras["2"] == Camera(600, 400, 510, 510, 300, 200)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"focal_px": 5, "focal_mm": 5}, "either focal_px"),
        ({}, "either focal_px"),
        ({"focal_mm": 5}, "pixel_mm"),
        ({"focal_px": 5, "cx": 3}, "two coordinates"),
        ({"focal_px": 5, "focus": 3}, "focus"),
        ({"focal_px": -5}, "focal_px"),
    ],
)
def test_contradictions_are_named(tmp_path: Path, entry: dict[str, object], words: str) -> None:
    with pytest.raises(CatalogError, match=words):
        _read(tmp_path / "c.yaml", BASE | entry)


PLAIN = Camera(6000, 4000, 7000.0, 7000.0, 3010.0, 1985.0)


def _metashape_pixel(x: float, y: float, t: dict[str, float]) -> tuple[float, float]:
    """The formulas of its manual, term by term."""
    r2 = x * x + y * y
    radial = 1 + t["k1"] * r2 + t["k2"] * r2**2 + t["k3"] * r2**3 + t["k4"] * r2**4
    xd = x * radial + t["p1"] * (r2 + 2 * x * x) + 2 * t["p2"] * x * y
    yd = y * radial + t["p2"] * (r2 + 2 * y * y) + 2 * t["p1"] * x * y
    return PLAIN.cx + xd * PLAIN.fx + xd * t["b1"] + yd * t["b2"], PLAIN.cy + yd * PLAIN.fy


@pytest.mark.parametrize(
    ("extra", "tolerance_px"),
    [({"k4": 0.0, "b2": 0.0}, 1e-6), ({"k4": 0.01, "b2": 0.0}, 0.05), ({"k4": 0.0, "b2": 0.05}, 0.1)],
    ids=["exact", "fourth radial term", "skew"],
)
def test_metashape_terms(extra: dict[str, float], tolerance_px: float) -> None:
    terms = {"k1": -0.08, "k2": 0.05, "k3": -0.01, "p1": 3e-4, "p2": -2e-4, "b1": 1.5} | extra
    camera = metashape_camera(PLAIN, terms)
    rng = np.random.default_rng(1)
    xy = rng.uniform((-0.42, -0.28), (0.42, 0.28), (200, 2))
    expected = np.array([_metashape_pixel(float(x), float(y), terms) for x, y in xy])
    assert np.abs(camera.distort(xy) - expected).max() < tolerance_px


def test_skew_that_cannot_be_followed_is_refused() -> None:
    with pytest.raises(ValueError, match="pixels are left"):
        metashape_camera(PLAIN, {"b2": 40.0})


def test_australis_corrects_what_is_measured() -> None:
    """A measured point, corrected by hand, is where the fitted camera sees the ray of the corrected one."""
    pixel, terms = 0.005, {"k1": 8e-5, "k2": -6e-8, "k3": 1e-11, "p1": 4e-6, "p2": -3e-6, "b1": 1e-4, "b2": 0.0}
    camera = australis_camera(PLAIN, pixel, terms)
    c = PLAIN.fx * pixel
    for x, y in np.random.default_rng(2).uniform((-14, -9), (14, 9), (100, 2)).tolist():
        r2 = x * x + y * y
        dr = terms["k1"] * r2 + terms["k2"] * r2**2 + terms["k3"] * r2**3
        xc = x + x * dr + terms["p1"] * (r2 + 2 * x * x) + 2 * terms["p2"] * x * y + terms["b1"] * x
        yc = y + y * dr + terms["p2"] * (r2 + 2 * y * y) + 2 * terms["p1"] * x * y
        expected = PLAIN.cx + x / pixel, PLAIN.cy - y / pixel
        assert camera.distort(np.array([[xc / c, -yc / c]]))[0] == pytest.approx(expected, abs=0.1)

"""The shipped geoid against PROJ's interpolation of the same grid and against heights that national surveys publish."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer

from cityflow.io.geoid import shipped_geoid


def test_interpolates_as_proj_does(tmp_path: Path) -> None:
    """Over the poles and the date line, too."""
    geoid = shipped_geoid()
    rows, cols = geoid.centimetres.shape
    head = struct.pack(">4d2i", -90.0, -180.0, geoid.step_deg, geoid.step_deg, rows, cols)
    grid = tmp_path / "undulation.gtx"
    grid.write_bytes(head + (geoid.centimetres[::-1] / 100).astype(">f4").tobytes())
    shift = Transformer.from_pipeline(
        f"+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=vgridshift +grids={grid} +multiplier=1"
        " +step +proj=unitconvert +xy_in=rad +xy_out=deg"
    )
    rng = np.random.default_rng(3)
    lon, lat = rng.uniform(-180, 180, 500), rng.uniform(-90, 90, 500)
    lon[:6], lat[:6] = [179.99, -179.99, 0.0, -180.0, 12.25, 179.9], [10.1, -10.1, 89.99, 0.0, -89.99, 60.0]
    expected = shift.transform(lon, lat, np.zeros(500))[2]
    assert np.isfinite(expected).all()
    assert geoid.undulation(lon, lat) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("lon", "lat", "height"),
    [
        (5.387203657, 52.155172897, 43.2551),
        (4.824761912, 53.160753042, 41.8614),
        (6.776726674, 53.419482050, 40.3586),
        (4.072887101, 51.947393898, 43.5968),
        (3.397588595, 51.368607152, 44.4024),
        (5.773795548, 50.792584916, 45.9478),
    ],
)
def test_within_four_decimetres_of_the_dutch_quasi_geoid(lon: float, lat: float, height: float) -> None:
    """Heights of NAP above the ellipsoid at the points by which RDNAPTRANS2018 is checked."""
    assert abs(shipped_geoid().undulation(np.array([lon]), np.array([lat]))[0] - height) < 0.4


def test_extremes_are_where_the_model_has_them() -> None:
    """Deepest south of India, highest at New Guinea, within the range that EGM96 states."""
    geoid = shipped_geoid()
    row, col = np.unravel_index(np.argmin(geoid.centimetres), geoid.centimetres.shape)
    assert (90 - row * geoid.step_deg, col * geoid.step_deg - 180) == pytest.approx((4.75, 78.75), abs=1.0)
    assert geoid.centimetres.min() == pytest.approx(-10699, abs=1)
    assert geoid.centimetres.max() == pytest.approx(8539, abs=1)

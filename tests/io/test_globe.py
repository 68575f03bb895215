"""From a city's CRS to the globe, against published coordinates and PROJ's own way to the earth's centre."""

from __future__ import annotations

import math
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer

from cityflow.errors import CatalogError
from cityflow.io.crs import resolve
from cityflow.io.geoid import shipped_geoid
from cityflow.io.globe import Globe, globe_of
from cityflow.io.globe_frame import frame_at

DELFT = (84500.0, 446900.0, 85500.0, 447900.0)


def _globe(code: str, bounds: tuple[float, float, float, float] = DELFT) -> Globe:
    globe = globe_of(resolve(code), bounds)
    assert globe is not None
    return globe


@pytest.mark.parametrize(
    ("xyz", "lon", "lat", "height"),
    [
        # RDNAPTRANS2018 (variant 1) at x, y, NAP height: longitude, latitude (ETRS89), height above the ellipsoid
        ((85000.0, 447500.0, 0.0), 4.36758120, 52.01144271, 43.5040),
        ((84500.0, 446900.0, 0.0), 4.36042285, 52.00598720, 43.5096),
        ((155000.0, 463000.0, 0.0), 5.387203657, 52.155172897, 43.2551),
        ((64640.89, 440700.0101, 4.0), 4.072887101, 51.947393898, 47.5968),
    ],
)
def test_delft_stands_where_it_stands(xyz: tuple[float, float, float], lon: float, lat: float, height: float) -> None:
    """Without any grid of PROJ's: within a quarter of a metre in plan, half a metre in height."""
    found = _globe("EPSG:7415").geodetic(np.array([xyz]))[0]
    metres = np.array([(found[0] - lon) * math.cos(math.radians(lat)), found[1] - lat]) * 111_320
    assert np.hypot(*metres) < 0.25
    assert abs(found[2] - height) < 0.5


def test_geocentric_positions_are_projs_own() -> None:
    globe = _globe("EPSG:7415")
    rng = np.random.default_rng(1)
    xyz = np.column_stack([rng.uniform(84500, 85500, 200), rng.uniform(446900, 447900, 200), rng.uniform(-5, 90, 200)])
    flat = Transformer.from_crs(28992, 4326, always_xy=True)
    lon, lat = flat.transform(xyz[:, 0], xyz[:, 1])
    assert abs(globe.step_m + 0.005) <= 0.005, "whole centimetres"
    height = xyz[:, 2] + globe.step_m + shipped_geoid().undulation(lon, lat)
    expected = np.column_stack(Transformer.from_crs(4979, 4978, always_xy=True).transform(lon, lat, height))
    assert np.abs(globe.geocentric(xyz) - expected).max() < 1e-3


def test_tile_frame_looks_east_north_and_up() -> None:
    """The tile's own axes against small steps along the meridian, the parallel and the plumb line; and back by its matrix."""
    globe = _globe("EPSG:25832+7837", (360000.0, 5_500_000.0, 361000.0, 5_501_000.0))
    frame = frame_at(globe, (360500.0, 5_500_500.0, 0.0))
    lon, lat, height = globe.geodetic(np.array([[360500.0, 5_500_500.0, 0.0]]))[0]
    ecef = Transformer.from_crs(4979, 4978, always_xy=True)
    here = np.array(ecef.transform(lon, lat, height))
    for axis, there in enumerate([(lon + 1e-5, lat, height), (lon, lat + 1e-5, height), (lon, lat, height + 1)]):
        step = (np.array(ecef.transform(*there)) - here) @ frame.axes.T
        assert step / np.linalg.norm(step) == pytest.approx(np.eye(3)[axis], abs=1e-5)
    rng = np.random.default_rng(2)
    xyz = np.array([360500.0, 5_500_500.0, 100.0]) + rng.uniform(-500, 500, (50, 3))
    local = frame.local(xyz)
    back = np.column_stack([local, np.ones(50)]) @ np.array(frame.matrix).reshape(4, 4)
    assert np.abs(back[:, :3] - globe.geocentric(xyz)).max() < 1e-6
    # Grid north is not north: the meridian's convergence turns the tile, and UTM shrinks it by up to 0.04 %.
    turned = np.degrees(np.arctan2(local[:, 0], local[:, 1]) - np.arctan2(*(xyz[:, :2] - (360500, 5_500_500)).T))
    assert np.abs(np.median((turned + 180) % 360 - 180)) > 1


def test_a_step_between_datums_is_taken_from_the_register() -> None:
    """Ostend's zero is 2.3 m below Amsterdam's: the same ground at the border has the same height above the ellipsoid."""
    x, y = 233000.0, 211000.0
    belgian = _globe("EPSG:31370+5710", (x - 500, y - 500, x + 500, y + 500))
    lon, lat, height = belgian.geodetic(np.array([[x, y, 22.31]]))[0]
    rd = Transformer.from_crs(4326, 28992, always_xy=True).transform(lon, lat)
    dutch = _globe("EPSG:7415", (rd[0] - 500, rd[1] - 500, rd[0] + 500, rd[1] + 500))
    assert dutch.geodetic(np.array([[*rd, 20.0]]))[0, 2] == pytest.approx(height, abs=0.05)
    assert "Ostend" in belgian.placing.geoid


def test_heights_of_unknown_datum_are_left_and_said_to_be() -> None:
    globe = _globe("EPSG:28992")
    assert globe.geodetic(np.array([[85000.0, 447500.0, 12.5]]))[0, 2] == 12.5
    assert not globe.placing.is_shifted
    said = globe.placing.as_metadata()
    assert "no geoid shift" in str(said["geoid"])
    assert "height_accuracy_m" not in said
    assert said["vertical_datum"] == "not stated"


def test_a_datum_without_a_known_step_is_taken_for_the_geoid_with_less_trust() -> None:
    globe = _globe("EPSG:32618+5703", (580000.0, 4500000.0, 581000.0, 4501000.0))
    lon, lat, height = globe.geodetic(np.array([[580500.0, 4500500.0, 10.0]]))[0]
    assert height - 10 == pytest.approx(shipped_geoid().undulation(np.array([lon]), np.array([lat]))[0])
    assert globe.placing.height_accuracy_m == 2.0


def test_a_local_frame_is_nowhere() -> None:
    assert globe_of(resolve("local"), (0.0, 0.0, 10.0, 10.0)) is None
    frame = frame_at(None, (5.0, 6.0, 0.0))
    assert frame.local(np.array([[6.0, 8.0, 3.0]])).tolist() == [[1.0, 2.0, 3.0]]
    assert frame.matrix == [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 0, 1]


def test_no_ballpark_transformation_is_ever_taken() -> None:
    """PROJ lists ones first that shift nothing; they are off by a hundred metres in plan, and by the geoid in height."""
    for code in ("EPSG:7415", "EPSG:28992", "EPSG:27700+5701", "EPSG:2056+5728"):
        bounds = (530000.0, 180000.0, 531000.0, 181000.0) if "27700" in code else DELFT
        if "2056" in code:
            bounds = (2600000.0, 1200000.0, 2601000.0, 1201000.0)
        placing = _globe(code, bounds).placing
        assert "ballpark" not in placing.horizontal.lower()
        assert placing.horizontal_accuracy_m <= 2.0


def test_a_position_off_the_globe_is_named() -> None:
    with pytest.raises(CatalogError, match="no position on the globe"):
        _globe("EPSG:7415").geocentric(np.array([[85000.0, 447500.0, 0.0], [np.nan, 447500.0, 0.0]]))


_WITH_GRID = """
import struct, sys
import numpy as np, pyproj
pyproj.datadir.append_data_dir(sys.argv[1])
from cityflow.io.globe import globe_of
from cityflow.io.crs import resolve
globe = globe_of(resolve("EPSG:25832+5773"), (360000.0, 5500000.0, 361000.0, 5501000.0))
lon, lat, height = globe.geodetic(np.array([[360500.0, 5500500.0, 100.0]]))[0]
print(repr(float(height)), globe.placing.geoid)
"""


def test_a_grid_of_proj_goes_first_where_it_is_installed(tmp_path: Path) -> None:
    """A made grid of 12.34 m under the name that PROJ asks for: a process of its own, since PROJ looks once."""
    cells = np.full((721, 1440), 12.34, ">f4")
    head = struct.pack(">4d2i", -90.0, -180.0, 0.25, 0.25, *cells.shape)
    (tmp_path / "egm96_15.gtx").write_bytes(head + cells.tobytes())
    done = subprocess.run(
        [sys.executable, "-c", _WITH_GRID, str(tmp_path)], capture_output=True, text=True, check=True, timeout=60
    )
    height, said = done.stdout.strip().split(" ", 1)
    assert float(height) == pytest.approx(112.34, abs=1e-3)
    assert said.startswith("PROJ:")

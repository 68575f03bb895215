from __future__ import annotations

import numpy as np
import pytest
from pyproj import CRS

from cityflow.errors import CatalogError
from cityflow.io.crs import (
    contradiction,
    crs_of,
    fits,
    geographic_bounds,
    horizontal_transform,
    reference_of,
    resolve,
    suspicion,
    transformed,
    vertical_datum,
)

DELFT_BOUNDS = (84808.3, 447412.8, 85072.3, 447641.3)


def test_compound_code_names_both_parts() -> None:
    reference = resolve("EPSG:7415")
    assert (reference.horizontal_epsg, reference.vertical_epsg) == (28992, 5709)
    assert vertical_datum(reference) == "NAP height"


@pytest.mark.parametrize(
    ("code", "normal"), [("epsg:28992", "EPSG:28992"), ("EPSG:28992+5709", "EPSG:7415"), (" Local ", "local")]
)
def test_codes_are_normalised(code: str, normal: str) -> None:
    assert resolve(code).code == normal


def test_compound_without_a_code_of_its_own_keeps_both() -> None:
    reference = resolve("EPSG:25833+5709")
    assert reference.code == "EPSG:25833+5709"
    assert resolve(reference.code) == reference


def test_without_heights_the_datum_is_not_stated() -> None:
    assert resolve("EPSG:28992").vertical_epsg is None
    assert vertical_datum(resolve("EPSG:28992")) == "not stated"


@pytest.mark.parametrize("code", ["EPSG:4326", "EPSG:4979", "EPSG:4978"])
def test_degrees_and_geocentric_are_refused(code: str) -> None:
    with pytest.raises(CatalogError, match="not a projected CRS") as caught:
        resolve(code)
    assert "EPSG:25833" in caught.value.remedy


@pytest.mark.parametrize("code", ["EPSG:2263", "EPSG:26910+6360"])
def test_feet_are_refused_in_the_plane_and_in_height(code: str) -> None:
    with pytest.raises(CatalogError, match="foot"):
        resolve(code)


def test_unknown_code_is_refused() -> None:
    with pytest.raises(CatalogError, match="EPSG:999999"):
        resolve("EPSG:999999")


def test_wkt_without_authority_is_recognised() -> None:
    wkt = CRS.from_epsg(28992).to_wkt().replace('ID["EPSG",28992]', "").replace(",\n    ]", "]")
    assert reference_of(CRS.from_wkt(CRS.from_epsg(7415).to_wkt())).code == "EPSG:7415"
    assert CRS.from_wkt(wkt).name


def test_contradiction_knows_what_says_less_from_what_says_otherwise() -> None:
    delft = resolve("EPSG:7415")
    assert contradiction(delft, CRS.from_epsg(28992)) == ""
    assert contradiction(delft, CRS.from_epsg(7415)) == ""
    assert "UTM" in contradiction(delft, CRS.from_epsg(25831))
    assert "DHHN" in contradiction(delft, CRS.from_user_input("EPSG:28992+7837"))
    assert "local" in contradiction(resolve("local"), CRS.from_epsg(28992))


def test_transform_is_east_before_north_even_where_the_crs_is_not() -> None:
    # EPSG:2180 has its north axis first.
    transformer = horizontal_transform(resolve("EPSG:2180"), CRS.from_epsg(4326))
    lon, lat = transformer.transform(637000.0, 486000.0)
    assert (lon, lat) == pytest.approx((21.0, 52.23), abs=0.1)


def test_known_point_of_the_dutch_grid() -> None:
    # The origin of RD New: the tower of Amersfoort, by definition at 155000, 463000.
    transformer = horizontal_transform(CRS.from_epsg(4326), resolve("EPSG:28992"))
    xy = transformed(transformer, np.array([[5.38763888, 52.15616055]]))
    assert xy[0] == pytest.approx((155000, 463000), abs=110)  # EPSG:4326's offset to Bessel is ~100 m at most


def test_local_frame_cannot_be_transformed() -> None:
    with pytest.raises(CatalogError, match="local"):
        horizontal_transform(resolve("local"), resolve("EPSG:28992"))
    assert crs_of(resolve("local")) is None
    assert geographic_bounds(resolve("local"), DELFT_BOUNDS) is None


def test_geographic_bounds_of_delft() -> None:
    degrees = geographic_bounds(resolve("EPSG:7415"), DELFT_BOUNDS)
    assert degrees is not None
    west, south, east, north = degrees
    assert 4.36 < west < east < 4.37
    assert 52.01 < south < north < 52.02


def test_suspicions() -> None:
    delft = resolve("EPSG:7415")
    assert suspicion(delft, DELFT_BOUNDS) == ""
    assert fits(delft, DELFT_BOUNDS)
    assert "degrees" in suspicion(delft, (4.36, 52.01, 4.37, 52.02))
    x_min, y_min, x_max, y_max = (v / 0.3048 for v in DELFT_BOUNDS)
    feet = (x_min, y_min, x_max, y_max)
    assert "feet" in suspicion(delft, feet)
    assert "outside" in suspicion(delft, (5e6, 5e6, 5.001e6, 5.001e6))
    assert suspicion(resolve("local"), (0.0, 0.0, 120.0, 80.0)) == ""
    assert "degrees" in suspicion(resolve("local"), (4.36, 52.01, 4.37, 52.02))

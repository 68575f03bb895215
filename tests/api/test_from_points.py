"""Algorithms on points, as in a notebook: a row of gabled houses scanned from above."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import shapely
import shapely.affinity

import cityflow as cf
from cityflow.core.building import Lod
from cityflow.errors import RefusedUnit
from cityflow.geometry.polyhedron import volume
from house_row import HouseRow, scanned

ROW = HouseRow(eaves=(6.0, 7.5, 6.2), facades=(100,) * 3, roofs=(100,) * 3)
HOUSE = HouseRow(eaves=(6.0,), facades=(100,), roofs=(100,), width=14.0)
POINTS = scanned(HOUSE, 12.0)


def test_the_surface_has_the_heights_of_ground_and_ridge() -> None:
    surface = cf.surface_from_points(POINTS)
    assert np.nanmax(surface.dsm) == pytest.approx(HOUSE.ridge(0), abs=0.2)
    assert np.nanmedian(surface.dtm) == pytest.approx(0.0, abs=0.1)
    layers = cf.surface_dataset(surface, "EPSG:7415")
    assert layers["ndsm"].dims == ("y", "x")
    assert layers.rio.crs.is_projected
    x, y = surface.grid.centres()
    np.testing.assert_array_equal(layers["x"], x[0])
    np.testing.assert_array_equal(layers["y"], y[:, 0])


def test_the_outline_of_a_house_is_found() -> None:
    (found,) = cf.outlines_from_points(POINTS)
    common = found.polygon.intersection(HOUSE.outline).area
    assert common / found.polygon.union(HOUSE.outline).area > 0.85


def test_a_house_gets_a_closed_model_with_two_roof_planes_and_a_verdict(tmp_path: Path) -> None:
    ring = shapely.get_coordinates(HOUSE.outline)
    made = cf.building_from_points(POINTS, cf.Outline("house", shapely.Polygon(ring[::-1])))
    assert made.status == "done"
    assert len(made.planes) == 2
    slopes = [plane.slope_deg for plane in made.planes]
    assert slopes == pytest.approx([np.degrees(np.arctan(HOUSE.rise))] * 2, abs=1.0)
    true = HOUSE.outline.area * (HOUSE.eaves[0] + HOUSE.rise * HOUSE.depth / 4)
    assert volume(made.solids[Lod.LOD22]) == pytest.approx(true, rel=0.02)
    assert made.attributes["verdict"] in ("good", "look", "poor")
    mesh = cf.triangles_of(made)
    assert mesh.vertices[:, 2].max() == pytest.approx(HOUSE.ridge(0), abs=0.1)
    picture = cf.draw_buildings([made], most_px=120)
    assert max(picture.shape[:2]) <= 120
    cf.write_cityjson(tmp_path / "house.city.jsonl", [made], "EPSG:7415")
    header, feature = (json.loads(line) for line in (tmp_path / "house.city.jsonl").read_text().splitlines())
    assert header["version"] == "2.0"
    assert feature["id"] == "house"


def test_without_ground_a_house_is_refused() -> None:
    far = cf.Outline("far", shapely.affinity.translate(HOUSE.outline, 500.0))
    with pytest.raises(RefusedUnit, match="no terrain height along the outline"):
        cf.building_from_points(POINTS, far)


def test_borders_of_a_row_stand_where_its_houses_meet() -> None:
    found = cf.split_outline(cf.Outline("row", ROW.outline), scanned(ROW, 12.0))
    assert len(found.units) == 3
    for k in (1, 2):
        middle = shapely.Point(ROW.world(6.0 * k, 0.0, 0.0)[:2])
        assert min(cut.line.distance(middle) for cut in found.cut_lines) < 0.5

"""Algorithms on images, as in a notebook: two straight looks at a level plain."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

import cityflow as cf
from cityflow.core.building import Lod
from cityflow.core.grid import Grid
from cityflow.errors import CatalogError, CityflowError
from cityflow.reconstruction.extruded import extrude
from cityflow.runs.project_files import project_file
from plain_scene import FLIGHT_M, PLAIN_M, photograph, views

BOUNDS = (-6.0, -6.0, 14.0, 6.0)


def pair() -> tuple[cf.ColourImage, cf.ColourImage]:
    base, partner = (cf.ColourImage(view, photograph(view)) for view in views())
    return base, partner


def test_depths_and_points_of_a_pair_are_those_of_the_plain() -> None:
    base, partner = pair()
    depths = cf.match_images(base, [partner], BOUNDS, (0.0, 5.0))
    known = np.isfinite(depths.depth)
    assert known.mean() > 0.5
    assert np.nanmedian(depths.depth) == pytest.approx(FLIGHT_M - PLAIN_M, abs=0.02)
    points = cf.points_of_depths(depths, base.image)
    assert len(points) == known.sum()
    assert np.median(np.abs(points.xyz[:, 2] - PLAIN_M)) < 0.05
    assert (points.xyz[:, 0] >= BOUNDS[0]).all()
    assert (points.xyz[:, 0] < BOUNDS[2]).all()


def test_what_no_image_shows_is_said() -> None:
    base, partner = pair()
    with pytest.raises(CityflowError, match=r"base: no pixel got a depth"):
        cf.match_images(base, [partner], (500.0, 500.0, 520.0, 520.0), (0.0, 5.0))


def test_a_box_on_the_plain_gets_the_pixels_of_its_images_and_windows_are_looked_for() -> None:
    images = [
        cf.ColourImage(i.image, cf.ArrayPixels(np.repeat(i.pixels.window((0, 240), (0, 320)), 3, axis=2)))
        for i in pair()
    ]
    box = shapely.box(-3.0, -3.0, 3.0, 3.0)
    house = cf.Building("box", box, PLAIN_M, {Lod.LOD22: extrude(box, PLAIN_M, 6.0)})
    grid = Grid(-10.0, 10.0, 0.25, 80, 80)
    made = cf.texture_building(house, images, np.full(grid.shape, PLAIN_M), grid)
    assert set(made.texture.images) <= {"base", "partner"}
    assert made.texture.raw
    cf.windows_of(house, made)


def test_images_of_a_catalog_come_with_their_poses() -> None:
    catalog = str(project_file("catalogs/boruszyn"))
    (found,) = cf.read_images(catalog, ["img_4854"], level=2)
    assert found.pixels.window((0, 300), (0, 400)).shape == (300, 400, 3)
    assert (found.image.camera.width, found.image.camera.height) == (400, 300)
    with pytest.raises(CatalogError, match="no image 'img_1'"):
        cf.read_images(catalog, ["img_1"])

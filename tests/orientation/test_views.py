from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from cityflow.core.camera import FISHEYE, Camera, OrientedImage
from cityflow.orientation.views import REACH, View, footprint, footprints, gsd, sees, sees_each
from orientation.regular_flight import CAMERA, looking

NADIR = looking((0, 0, -1), (0, 1, 0))


def view(rotation: np.ndarray, camera: Camera = CAMERA, height: float = 360.0) -> View:
    return View(OrientedImage("a", camera, rotation, np.array([1000.0, 2000.0, height])), (0.0, 20.0))


def tilted(degrees: float) -> np.ndarray:
    t = np.radians(degrees)
    return looking((np.sin(t), 0.0, -np.cos(t)), (0, 0, 1))


def test_a_vertical_view_covers_a_rectangle() -> None:
    ground = footprint(view(NADIR))
    assert ground.bounds == pytest.approx((850.0, 1900.0, 1150.0, 2100.0))
    assert footprint(view(NADIR), 180.0).area == pytest.approx(300 * 200 / 4)


def test_gsd_is_across_the_ray() -> None:
    assert gsd(view(NADIR)) == pytest.approx(0.2)
    assert gsd(view(tilted(60))) == pytest.approx(0.4)
    assert gsd(view(tilted(91))) == float("inf")


def test_an_oblique_footprint_reaches_where_its_border_rays_do() -> None:
    ground = footprint(view(tilted(45)))
    half = np.degrees(np.arctan(500 / 1800))
    near, far = (360 * np.tan(np.radians(45 + s * half)) for s in (-1, 1))
    assert (ground.bounds[0], ground.bounds[2]) == pytest.approx((1000 + near, 1000 + far))


def test_a_view_of_the_horizon_is_cut_at_a_bounded_distance() -> None:
    ground = footprint(view(tilted(85)))
    assert ground.is_valid
    assert 1000 + 0.99 * REACH * 360 < ground.bounds[2] <= 1000 + REACH * 360
    assert footprint(view(tilted(85)), reach=3).bounds[2] <= 1000 + 3 * 360
    assert footprint(view(tilted(140))).is_empty
    assert footprint(view(NADIR, height=-5.0)).is_empty


@pytest.mark.parametrize("distortion", [(-0.2, 0.05, 0.0, 0.0), (0.15, 0.0, 0.001, -0.002)])
def test_a_distorted_border_is_followed(distortion: tuple[float, ...]) -> None:
    bent = view(tilted(30), replace(CAMERA, distortion=distortion))
    ground = footprint(bent)
    rng = np.random.default_rng(1)
    x_min, y_min, x_max, y_max = ground.buffer(40).bounds
    xyz = np.column_stack([rng.uniform(x_min, x_max, 4000), rng.uniform(y_min, y_max, 4000), np.zeros(4000)])
    differ = sees(bent.image, xyz) != shapely.contains_xy(ground, xyz[:, 0], xyz[:, 1])
    off = shapely.distance(ground.exterior, shapely.points(xyz[:, :2]))[differ]
    assert off.max(initial=0.0) < 1.5


def test_points_far_outside_are_not_folded_into_a_distorted_image() -> None:
    bent = view(NADIR, replace(CAMERA, distortion=(-0.4, 0.0, 0.0, 0.0)))
    far = np.array([[1000.0 + 360 * 1.58, 2000.0, 0.0]])
    assert bent.image.holds(bent.image.project(far)[0]).all()
    assert not sees(bent.image, far).any()


def test_a_fisheye_has_a_wide_footprint() -> None:
    wide = Camera(1500, 1000, 600.0, 600.0, 750.0, 500.0, (0.0, 0.0, 0.0, 0.0), FISHEYE)
    middle_of_top = 2000 + 360 * np.tan(500 / 600)
    assert footprint(view(NADIR, wide)).covers(shapely.Point(1000.0, middle_of_top - 0.5))
    assert not footprint(view(NADIR, wide)).covers(shapely.Point(1000.0, middle_of_top + 0.5))


def test_many_footprints_are_those_of_each() -> None:
    other = replace(CAMERA, distortion=(-0.1, 0.0, 0.0, 0.0))
    views = [view(NADIR), view(tilted(45), other), view(tilted(88)), view(tilted(20))]
    together = footprints(views)
    assert all(a.equals(footprint(v)) for a, v in zip(together, views, strict=True))


def test_many_images_see_what_each_of_them_does() -> None:
    bent = replace(CAMERA, distortion=(-0.4, 0.1, 0.001, 0.0))
    wide = Camera(1500, 1000, 600.0, 600.0, 750.0, 500.0, (0.01, 0.0, 0.0, 0.0), FISHEYE)
    images = [view(tilted(t), camera).image for t in (5.0, 20.0, 45.0, 88.0) for camera in (CAMERA, bent, wide)]
    xyz = np.random.default_rng(3).uniform([0.0, 1000.0, -20.0], [2000.0, 3000.0, 500.0], (5000, 3))
    seen = sees_each(images, xyz)
    assert seen.any(axis=1).all()
    assert np.array_equal(seen, [sees(image, xyz) for image in images])
    assert sees_each([], xyz).shape == (0, 5000)

"""The renderer against geometry worked out by hand: where things appear, how far they are, where shadows fall."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.synthetic.ambient import AmbientParameters
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.flight import Head, head_rotation
from cityflow.synthetic.mesh import Material, Part
from cityflow.synthetic.render import RenderParameters, irradiance, render, truth_depth
from cityflow.synthetic.sensor import SensorParameters
from synthetic.small_mesh import Face, ground, mesh_of, village

FAR = (85000.0, 447000.0)
"""Coordinates as large as those of a national grid."""
BROWN = (-0.08, 0.03, 0.0005, -0.0008, 0.002)


def camera(distortion: tuple[float, ...] = (), width: int = 300, height: int = 200) -> Camera:
    return Camera(width, height, 1.4 * width, 1.4 * width, width / 2 + 1.3, height / 2 - 2.1, distortion)


def view(head: Head, at: tuple[float, float, float], lens: Camera | None = None) -> OrientedImage:
    return OrientedImage("s00_000_test", lens or camera(), head_rotation(head, 0.4), np.array(at, float))


NADIR, OBLIQUE = Head(), Head(name="ahead", direction="forward", tilt_deg=45)
PLAIN = RenderParameters(
    sun_strength=0.0, ambient=AmbientParameters(rays=0), sensor=SensorParameters(blur_px=0, noise=False)
)


def squares(places: FloatArray, half: float) -> list[Face]:
    """White squares that hover a centimetre above black ground."""
    faces = [ground((FAR[0] - 500, FAR[0] + 500), (FAR[1] - 500, FAR[1] + 500), 0, Material.PLASTER, (0, 0, 0))]
    for x, y in places:
        ring = [(x + a * half, y + b * half, 0.01) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        faces.append((ring, Part.STREET, Material.PLASTER, (255, 255, 255)))
    return faces


@pytest.mark.parametrize("lens", [(), BROWN])
@pytest.mark.parametrize("head", [NADIR, OBLIQUE])
@pytest.mark.parametrize("adaptive", [True, False])
def test_patches_appear_where_the_camera_says_to_a_tenth_of_a_pixel(
    lens: tuple[float, ...], head: Head, adaptive: bool
) -> None:
    offset = 100.0 * np.tan(np.radians(head.tilt_deg))
    image = view(head, (FAR[0] - offset * np.sin(0.4), FAR[1] - offset * np.cos(0.4), 100.0), camera(lens))
    places = np.array(FAR) + np.array([[-14.03, -8.11], [0.17, 0.29], [13.61, 7.77], [-9.3, 9.9], [9.2, -9.6]])
    parameters = PLAIN.model_copy(update={"supersampling": 4, "adaptive": adaptive})
    light = irradiance(mesh_of(squares(places, 1.0)), image, parameters)[..., 1]
    rows, cols = np.mgrid[: light.shape[0], : light.shape[1]] + 0.5
    for place in places:
        # the centroid of a patch's image is that of its area seen in perspective, so project many points of it
        grid = np.stack(np.meshgrid(*(np.linspace(p - 0.99, p + 0.99, 60) for p in place)), -1).reshape(-1, 2)
        uv, depth = image.project(np.column_stack([grid, np.full(len(grid), 0.01)]))
        # a square metre further away covers fewer pixels, by the cube of the distance
        expected = np.average(uv, axis=0, weights=depth**-3.0)
        near = np.hypot(cols - expected[0], rows - expected[1]) < 12
        weight = np.where(near, np.maximum(light - np.median(light[near]) - 0.002, 0), 0)
        found = np.array([(cols * weight).sum(), (rows * weight).sum()]) / weight.sum()
        assert found == pytest.approx(expected, abs=0.05)


@pytest.mark.parametrize("lens", [(), BROWN])
def test_depth_of_a_slope_is_exact(lens: tuple[float, ...]) -> None:
    slope, x0 = 0.1, FAR[0] - 500
    mesh = mesh_of([ground((x0, x0 + 1000), (FAR[1] - 500, FAR[1] + 500), slope)])
    image = view(OBLIQUE, (FAR[0], FAR[1], 300.0), camera(lens))
    depth, triangle = truth_depth(mesh, image)
    assert depth.shape == (200, 300)
    assert set(np.unique(triangle)) <= {0, 1}
    rows, cols = np.mgrid[0:200:20, 0:300:20]
    rays = image.rays(np.column_stack([cols.ravel(), rows.ravel()]) + 0.5)
    exact = (slope * (image.centre[0] - x0) - image.centre[2]) / (rays[:, 2] - slope * rays[:, 0])
    assert depth[rows.ravel(), cols.ravel()] == pytest.approx(exact, abs=1e-4)


def test_depth_is_nan_and_triangle_minus_one_where_there_is_nothing() -> None:
    mesh = mesh_of([ground((0, 10), (0, 10))])
    depth, triangle = truth_depth(mesh, view(NADIR, (0, 0, 100)))
    assert np.isnan(depth[triangle == -1]).all()
    assert np.isfinite(depth[triangle >= 0]).all()
    assert (triangle == -1).any()
    assert (triangle >= 0).any()


@pytest.mark.parametrize("azimuth", [30.0, 120.0, 215.0, 310.0])
def test_the_shadow_of_a_mast_falls_away_from_the_sun_as_long_as_it_must(azimuth: float) -> None:
    x, y = FAR
    top, half, elevation = 10.0, 0.4, 40.0
    plate: Face = (
        [(x + a * half, y + b * half, top) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))],
        Part.ROOF, Material.PAINT, (128, 128, 128),
    )  # fmt: skip
    mesh = mesh_of([ground((x - 300, x + 300), (y - 300, y + 300), 0, Material.PLASTER, (200, 200, 200)), plate])
    sunny = PLAIN.model_copy(update={"sun_strength": 1.0, "sun_azimuth_deg": azimuth, "sun_elevation_deg": elevation})
    image = view(NADIR, (x, y, 80.0), camera(width=600, height=600))
    dark = 1.0 - irradiance(mesh, image, sunny)[..., 1] / irradiance(mesh, image, sunny).max()
    reach = top / np.tan(np.radians(elevation))
    away = np.radians(azimuth + 180)
    expected = np.array([x + reach * np.sin(away), y + reach * np.cos(away), 0.0])
    uv, _ = image.project(expected[None])
    rows, cols = np.mgrid[:600, :600] + 0.5
    near = np.hypot(cols - uv[0, 0], rows - uv[0, 1]) < 15
    weight = np.where(near & (dark > 0.4), dark, 0)
    assert weight.sum() > 10
    found = np.array([(cols * weight).sum(), (rows * weight).sum()]) / weight.sum()
    assert found == pytest.approx(uv[0], abs=0.3)


def test_a_narrow_gap_sees_less_sky_than_open_ground() -> None:
    walls: list[Face] = [ground((-100, 100), (-100, 100), 0, Material.PLASTER, (180, 180, 180))]
    for x, reach in ((-0.75, 20.0), (0.75, -20.0)):
        ring = [(x, -reach, 0.0), (x, reach, 0.0), (x, reach, 8.0), (x, -reach, 8.0)]
        walls.append((ring, Part.WALL, Material.PLASTER, (180, 180, 180)))
    cloudy = PLAIN.model_copy(update={"ambient": AmbientParameters(rays=64)})
    light = irradiance(mesh_of(walls), view(NADIR, (0.0, 0.0, 60.0)), cloudy)[..., 1]
    depth, _ = truth_depth(mesh_of(walls), view(NADIR, (0.0, 0.0, 60.0)))
    image = view(NADIR, (0.0, 0.0, 60.0))
    (gap, open_ground), _ = image.project(np.array([[0.0, 0.0, 0.0], [12.0, 0.0, 0.0]]))
    at_gap, at_open = (light[int(p[1]), int(p[0])] for p in (gap, open_ground))
    assert depth[int(gap[1]), int(gap[0])] == pytest.approx(60.0, abs=0.01)
    # two long walls of height h at distance 0.75 m leave a share of about 0.75 / hypot(0.75, 8) of a cosine-weighted sky
    assert 0.02 < at_gap / at_open < 0.25


def test_the_same_place_has_the_same_colour_from_two_stations() -> None:
    scene = Scene(village(60.0, origin=FAR))
    parameters = RenderParameters(sensor=SensorParameters(blur_px=0, noise=False, vignetting=0, exposure_sigma=0))
    a = view(NADIR, (FAR[0] + 25, FAR[1] + 30, 60.0), camera(width=450, height=300))
    b = view(NADIR, (FAR[0] + 31, FAR[1] + 33, 60.0), camera(width=450, height=300))
    light_a, light_b = irradiance(scene, a, parameters), irradiance(scene, b, parameters)
    depth, _ = truth_depth(scene, a)
    depth_b, _ = truth_depth(scene, b)
    rows, cols = np.mgrid[5:295:3, 5:445:3]
    rows, cols = rows.ravel(), cols.ravel()
    points = a.centre + depth[rows, cols].astype(float)[:, None] * a.rays(np.column_stack([cols, rows]) + 0.5)
    uv, far = b.project(points)
    inside = b.holds(uv, 2)
    at = uv[inside].astype(int)
    seen = np.abs(depth_b[at[:, 1], at[:, 0]] - far[inside]) < 0.05
    first = light_a[rows[inside], cols[inside], 1][seen]
    second = light_b[at[seen, 1], at[seen, 0], 1]
    assert seen.sum() > 2000
    # texture is there, and it is the world's: what is left is that pixels do not lie on each other
    assert np.corrcoef(first, second)[0, 1] > 0.97
    grass = first < np.median(first)
    assert first[grass].std() > 0.01


def test_bytes_depend_neither_on_order_nor_on_what_else_was_rendered() -> None:
    mesh = village(48.0, origin=FAR)
    images = [
        OrientedImage(
            f"s0{k}_000_nadir",
            camera(BROWN, 150, 100),
            head_rotation(NADIR, 0.4 * k),
            np.array([FAR[0] + 20 + 4 * k, FAR[1] + 20, 50.0]),
        )
        for k in range(3)
    ]
    parameters = RenderParameters()
    scene = Scene(mesh)
    forth = [render(scene, i, parameters, 5) for i in images]
    back = [render(Scene(mesh), i, parameters, 5) for i in images[::-1]][::-1]
    assert all((a == b).all() for a, b in zip(forth, back, strict=True))
    assert (render(scene, images[0], parameters, 6) != forth[0]).mean() > 0.2


def test_rows_at_once_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = village(48.0, origin=FAR)
    image = view(OBLIQUE, (FAR[0] + 10, FAR[1] - 20, 60.0), camera(BROWN))
    whole = irradiance(mesh, image, RenderParameters())
    monkeypatch.setattr("cityflow.synthetic.render.SAMPLES_AT_ONCE", 3000)
    assert irradiance(mesh, image, RenderParameters()) == pytest.approx(whole, abs=1e-5)


def test_adaptive_sampling_is_close_to_full_sampling() -> None:
    scene = Scene(village(60.0, origin=FAR))
    image = view(OBLIQUE, (FAR[0] + 10, FAR[1] - 30, 70.0), camera(width=450, height=300))
    few = irradiance(scene, image, RenderParameters())
    full = irradiance(scene, image, RenderParameters(adaptive=False))
    difference = np.abs(few - full)
    assert difference.mean() < 0.004
    assert np.percentile(difference, 99) < 0.03


def test_near_infrared_is_bright_where_things_grow() -> None:
    mesh = mesh_of([
        ground((-50, 0), (-50, 50)), ground((0, 50), (-50, 50), 0, Material.ASPHALT, (110, 110, 110)),
    ])  # fmt: skip
    array = render(mesh, view(NADIR, (0, 0, 60.0)), RenderParameters(near_infrared=True), 1).astype(float)
    assert array.shape == (200, 300, 4)
    ndvi = (array[..., 3] - array[..., 0]) / (array[..., 3] + array[..., 0])
    uv, _ = view(NADIR, (0, 0, 60.0)).project(np.array([[-8.0, 0, 0], [8.0, 0, 0]]))
    grass, asphalt = (ndvi[int(p[1]) - 10 : int(p[1]) + 10, int(p[0]) - 10 : int(p[0]) + 10].mean() for p in uv)
    assert grass > 0.25
    assert asphalt < 0.1


def test_glass_mirrors_more_when_seen_aslant() -> None:
    mesh = mesh_of([ground((-400, 400), (-400, 400), 0, Material.GLASS, (60, 60, 60))])
    steep = irradiance(mesh, view(NADIR, (0, 0, 50.0)), PLAIN)[100, 150, 2]
    slant = irradiance(mesh, view(Head(direction="forward", tilt_deg=65), (0, 0, 50.0)), PLAIN)[100, 150, 2]
    assert slant > 1.3 * steep

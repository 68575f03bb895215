"""Flights: overlaps, GSD and coverage measured on the footprints of what was planned."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely

from cityflow.core.camera import OrientedImage
from cityflow.errors import CityflowError
from cityflow.evaluation.poses import angle_deg
from cityflow.evaluation.relative_accuracy import block_figures, whole_error
from cityflow.synthetic.flight import FlightParameters, Head, plan_flight
from cityflow.synthetic.flight_presets import PRESETS, preset
from cityflow.synthetic.footprints import ground_quad
from cityflow.synthetic.pose_noise import PoseErrors, station_of, whole_move, with_pose_noise

BOUNDS = (85000.0, 447000.0, 85300.0, 447200.0)
GROUND = 12.0
EXACT = {"attitude_sigma_deg": 0.0, "position_sigma": 0.0, "width_px": 1500, "height_px": 1000}


def footprint(image: OrientedImage) -> shapely.Polygon:
    return shapely.Polygon(ground_quad(image, GROUND))


def by_strip(images: tuple[OrientedImage, ...], head: str) -> dict[str, list[OrientedImage]]:
    strips: dict[str, list[OrientedImage]] = {}
    for image in images:
        if image.name.endswith(f"_{head}"):
            strips.setdefault(image.name.split("_")[0], []).append(image)
    return strips


@pytest.mark.parametrize("forward", [0.6, 0.7, 0.8])
@pytest.mark.parametrize("heading", [0.0, 37.0])
def test_overlaps_of_nadir_footprints_are_as_asked(forward: float, heading: float) -> None:
    parameters = preset("five_cameras", **EXACT, forward_overlap=forward, side_overlap=0.6, heading_deg=heading)
    strips = by_strip(plan_flight(BOUNDS, GROUND, parameters), "nadir")
    for images in strips.values():
        for a, b in pairwise(images):
            common = footprint(a).intersection(footprint(b)).area / footprint(a).area
            assert common == pytest.approx(forward, abs=0.005)
    names = sorted(strips)
    for first, second in pairwise(names):
        best = max(
            footprint(a).intersection(footprint(b)).area / footprint(a).area
            for a in strips[first] for b in strips[second]
        )  # fmt: skip
        assert best == pytest.approx(0.6, abs=0.005)


@pytest.mark.parametrize("name", list(PRESETS))
def test_every_head_has_an_image_centre_near_every_place(name: str) -> None:
    parameters = preset(name, width_px=1500, height_px=1000)
    images = plan_flight(BOUNDS, GROUND, parameters)
    places = np.array([[x, y] for x in (85000.0, 85150, 85300) for y in (447000.0, 447100, 447200)])
    for head in parameters.heads:
        covered = np.zeros(len(places), int)
        for image in images:
            if image.name.endswith(f"_{head.name}"):
                uv, depth = image.project(np.column_stack([places, np.full(len(places), GROUND)]))
                covered += image.holds(uv) & (depth > 0)
        expected = 1 / (1 - parameters.forward_overlap)
        assert covered.min() >= np.floor(expected) - (0 if name == "nadir" else 1), head.name


def test_gsd_of_all_heads_of_the_default_is_8_cm_in_the_image_centre() -> None:
    for image in plan_flight(BOUNDS, GROUND, preset("five_cameras", **EXACT))[:40]:
        camera = image.camera
        uv = np.array([[camera.cx, camera.cy], [camera.cx + 1, camera.cy]])
        rays = image.rays(uv)
        depth = (GROUND - image.centre[2]) / rays[:, 2]
        points = image.centre + depth[:, None] * rays
        assert np.linalg.norm(points[1] - points[0]) == pytest.approx(0.08, rel=1e-3)


def test_gsd_of_the_crossing_flight_is_5_and_15_cm() -> None:
    images = plan_flight(BOUNDS, GROUND, preset("crossing", attitude_sigma_deg=0, position_sigma=0))
    for head, gsd, tilt in (("nadir", 0.05, 0.0), ("left", 0.15, 36.0)):
        image = next(i for i in images if i.name.endswith(head))
        assert np.degrees(image.tilt) == pytest.approx(tilt, abs=1e-9)
        distance = (image.centre[2] - GROUND) / np.cos(image.tilt)
        assert distance / image.camera.fx == pytest.approx(gsd, rel=1e-6)
    azimuths = {
        round(float(np.degrees(np.arctan2(i.axis[0], i.axis[1])))) % 360 for i in images if "nadir" not in i.name
    }
    assert azimuths == {0, 90, 180, 270}


def test_heads_look_where_they_are_said_to_with_the_horizon_upwards() -> None:
    parameters = preset("five_cameras", **EXACT, heading_deg=90.0, serpentine=False)
    images = plan_flight(BOUNDS, GROUND, parameters)
    towards = {"forward": (1, 0), "back": (-1, 0), "left": (0, 1), "right": (0, -1)}
    for head, level in towards.items():
        image = next(i for i in images if i.name.endswith(head))
        assert image.axis[:2] == pytest.approx(np.array(level) / np.sqrt(2), abs=1e-9)
        above, _ = image.project(image.centre + 100 * image.axis + [[0, 0, 1.0]])
        assert above[0, 1] < image.camera.cy
        assert above[0, 0] == pytest.approx(image.camera.cx)
    assert np.linalg.det(images[0].rotation) == pytest.approx(1.0)
    nadir = next(i for i in images if i.name.endswith("nadir"))
    ahead, _ = nadir.project(nadir.centre + np.array([[5.0, 0, -100.0]]))
    assert ahead[0, 1] < nadir.camera.cy


def test_altitude_given_sets_the_focal_length() -> None:
    parameters = FlightParameters(altitude_m=700.0, gsd_m=0.1)
    assert parameters.focal_px == pytest.approx(7000.0)
    assert parameters.flying_height_m == pytest.approx(700.0)


def test_only_images_that_see_the_area_unless_all_are_asked_for() -> None:
    few = plan_flight(BOUNDS, GROUND, preset("five_cameras", **EXACT))
    every = plan_flight(BOUNDS, GROUND, preset("five_cameras", **EXACT, all_stations=True))
    assert all(footprint(i).intersection(shapely.box(*BOUNDS)).area > 0 for i in few)
    assert len(every) > len(few)
    assert {i.name for i in few} < {i.name for i in every}
    assert len({i.name for i in every}) == len(every)


def test_a_head_that_shows_the_horizon_is_refused() -> None:
    wild = FlightParameters(heads=(Head(), Head(name="far", direction="forward", tilt_deg=70)), focal_widths=0.7)
    with pytest.raises(CityflowError, match="horizon"):
        plan_flight(BOUNDS, GROUND, wild)


def test_unknown_preset_names_the_known() -> None:
    with pytest.raises(CityflowError, match="five_cameras"):
        preset("six_cameras")


def test_attitude_jitter_is_as_strong_as_asked_and_repeatable() -> None:
    parameters = preset("nadir", width_px=300, height_px=200, attitude_sigma_deg=1.0, all_stations=True)
    images = plan_flight((0, 0, 300, 300), 0.0, parameters)
    tilts = np.degrees([i.tilt for i in images])
    # roll and pitch of one degree each: the tilt is Rayleigh-distributed with mean √(π/2)
    assert tilts.mean() == pytest.approx(np.sqrt(np.pi / 2), rel=4 * 0.52 / np.sqrt(len(tilts)))
    again = plan_flight((0, 0, 300, 300), 0.0, parameters)
    assert all((a.rotation == b.rotation).all() for a, b in zip(images, again, strict=True))


def test_pose_noise_has_the_sigma_asked_for_and_knows_no_order() -> None:
    images = plan_flight((0, 0, 500, 500), 0.0, preset("five_cameras", **EXACT))
    errors = PoseErrors(position_m=0.05, angle_deg=float(np.degrees(1e-4)))
    noisy = with_pose_noise(images, errors, seed=3)
    shifts = np.array([b.centre - a.centre for a, b in zip(images, noisy, strict=True)])
    turns = [b.rotation @ a.rotation.T for a, b in zip(images, noisy, strict=True)]
    angles = np.array([[t[2, 1], t[0, 2], t[1, 0]] for t in turns])
    assert len(images) > 500
    assert shifts.std(axis=0) == pytest.approx(0.05, rel=0.12)
    assert angles.std(axis=0) == pytest.approx(1e-4, rel=0.12)
    backwards = with_pose_noise(images[::-1], errors, seed=3)[::-1]
    assert all((a.centre == b.centre).all() for a, b in zip(noisy, backwards, strict=True))


def test_an_angle_in_pixels_moves_the_image_centre_by_as_many() -> None:
    images = plan_flight((0, 0, 500, 500), 0.0, preset("five_cameras", **EXACT))
    noisy = with_pose_noise(images, PoseErrors(angle_px=0.4), seed=3)
    off = []
    for true, given in zip(images, noisy, strict=True):
        aim = true.centre + 100.0 * true.rotation[2]
        off.append(given.project(aim[None])[0][0] - (true.camera.cx, true.camera.cy))
    assert np.std(off, axis=0) == pytest.approx(0.4, rel=0.1)


def test_heads_that_are_off_together_keep_their_relative_poses() -> None:
    images = plan_flight((0, 0, 100, 100), 0.0, preset("five_cameras", **EXACT))
    noisy = with_pose_noise(images, PoseErrors(position_m=1.0, angle_deg=0.5, together=True), seed=3)
    by_station: dict[str, list[int]] = {}
    for k, image in enumerate(images):
        by_station.setdefault(station_of(image.name), []).append(k)
    moved = set()
    for heads in by_station.values():
        for k in heads[1:]:
            before, after = (i[k].rotation @ i[heads[0]].rotation.T for i in (images, noisy))
            assert after == pytest.approx(before, abs=1e-12)
            assert (noisy[k].centre == noisy[heads[0]].centre).all()
        moved.add(round(float(np.linalg.norm(noisy[heads[0]].centre - images[heads[0]].centre)), 6))
    assert len(moved) == len(by_station) > 3
    assert min(moved) > 0
    with pytest.raises(ValueError, match="their pixels differ"):
        PoseErrors(together=True, angle_px=0.4)


def test_a_nominal_camera_has_the_data_sheets_numbers() -> None:
    flight = preset("nadir", **EXACT, distortion=(-0.05, 0.02), principal_px=(7.0, -4.0))
    images = plan_flight((0, 0, 100, 100), 0.0, flight)
    given = with_pose_noise(images, PoseErrors(interior="nominal", focal_share=0.01), seed=3)[0]
    assert given.camera.is_pinhole
    assert (given.camera.cx, given.camera.cy) == (750.0, 500.0)
    assert given.camera.fx == pytest.approx(1.01 * images[0].camera.fx)
    assert (given.rotation == images[0].rotation).all()


def test_a_block_that_is_off_as_a_whole_is_off_by_that_and_nothing_else() -> None:
    images = plan_flight((0, 0, 100, 100), 0.0, preset("five_cameras", **EXACT))
    x, y = (v.ravel() for v in np.meshgrid(np.linspace(10, 90, 9), np.linspace(10, 90, 9)))
    xyz, middle = np.column_stack([x, y, 5.0 + 3.0 * np.sin(x / 7)]), np.array([50.0, 50.0, 5.0])
    move = whole_move(PoseErrors(shift_m=5.0, turn_deg=3.0, scale_share=0.01), middle, seed=3)
    moved = [move.moved_image(i) for i in images]
    for true, given in zip(images, moved, strict=True):
        assert given.project(move.moved(xyz))[0] == pytest.approx(true.project(xyz)[0], abs=1e-6)
    found = whole_error(moved, images, xyz)
    assert np.linalg.norm(found.of_middle(middle)) == pytest.approx(5.0, abs=1e-6)
    assert angle_deg(found.rotation, np.eye(3)) == pytest.approx(3.0, abs=1e-6)
    assert found.scale == pytest.approx(1.01, abs=1e-9)
    assert block_figures(moved, images, xyz).parallax_rms_px < 1e-6
    assert whole_move(PoseErrors(shift_m=5.0), middle, seed=4).of_middle(middle) != pytest.approx(
        move.of_middle(middle)
    )

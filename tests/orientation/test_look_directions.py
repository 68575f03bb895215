from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cityflow.core.camera import OrientedImage
from cityflow.orientation.look_directions import (
    LookParameters,
    direction_name,
    frame_rotation,
    look_directions,
    worth_a_frame,
)  # fmt: skip
from cityflow.orientation.look_directions import looking as looking_of
from orientation.regular_flight import CAMERA, flight, images_of, looking


def kite(seed: int, n: int = 60, most_deg: float = 55.0) -> list[OrientedImage]:
    rng = np.random.default_rng(seed)
    tilt, azimuth = np.radians(rng.uniform(0, most_deg, n)), rng.uniform(0, 2 * np.pi, n)
    axes = np.column_stack([np.sin(tilt) * np.sin(azimuth), np.sin(tilt) * np.cos(azimuth), -np.cos(tilt)])
    return [
        OrientedImage(f"{k:03d}", CAMERA, looking(a, (0, 1, 0.3)), rng.normal(0, 50, 3)) for k, a in enumerate(axes)
    ]


def test_five_heads_flown_to_and_fro_are_five_clusters() -> None:
    frames = look_directions(images_of(flight(heads="NFBLR", jitter_deg=2.0)))
    assert frames[0].name == "nadir"
    assert {f.name.split("_")[0] for f in frames} == {"nadir", "east", "west", "north", "south"}
    assert all(len(f.images) == 18 for f in frames)
    # a camera that looks forward on one strip looks the other way on the next
    east = next(f for f in frames if f.name.startswith("east"))
    assert {name[:4] for name in east.images} == {"F_00", "B_01", "F_02"}


@given(st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_each_image_is_in_one_cluster_and_no_two_of_a_cluster_differ_by_more(seed: int) -> None:
    images = kite(seed)
    frames = look_directions(images)
    assert sorted(n for f in frames for n in f.images) == [i.name for i in images]
    assert len({f.name for f in frames}) == len(frames)
    axis = {i.name: i.axis for i in images}
    for frame in frames:
        axes = np.array([axis[n] for n in frame.images])
        assert np.degrees(np.arccos(np.clip(axes @ axes.T, -1, 1))).max() <= 20 + 1e-6


def test_the_order_of_images_does_not_matter() -> None:
    images = kite(3)
    shuffled = [images[k] for k in np.random.default_rng(0).permutation(len(images))]
    one, two = look_directions(images), look_directions(shuffled)
    assert [(f.name, f.images) for f in one] == [(f.name, f.images) for f in two]
    assert all(np.array_equal(a.frame_from_world, b.frame_from_world) for a, b in zip(one, two, strict=True))


def test_a_bundle_of_views_is_not_torn_apart() -> None:
    axes = [(np.sin(t), 0.0, -np.cos(t)) for t in np.radians(np.linspace(36, 54, 19))]
    images = [OrientedImage(f"{k:02d}", CAMERA, looking(a, (0, 0, 1)), np.zeros(3)) for k, a in enumerate(axes)]
    (frame,) = look_directions(images)
    assert frame.name == "east_45"
    assert worth_a_frame(frame, LookParameters())
    assert not worth_a_frame(frame, LookParameters(least_images=20))


def test_a_frame_looks_along_the_mean_with_walls_upright() -> None:
    images = images_of(flight(heads="L", turn_deg=30.0, strips=1))
    (frame,) = look_directions(images)
    m = frame.frame_from_world
    assert m @ m.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(m) == pytest.approx(1)
    assert looking_of(frame) @ np.mean([i.axis for i in images], axis=0) > 0.999
    assert (m @ [0, 0, 1.0])[0] == pytest.approx(0, abs=1e-12)
    assert (m @ [0, 0, 1.0])[1] > 0
    point = np.array([[12.0, 500.0, 7.0]])
    assert frame.to_world(frame.from_world(point)) == pytest.approx(point)


def test_the_nadir_frame_is_upright() -> None:
    frame = look_directions(images_of(flight(jitter_deg=3.0)))[0]
    assert frame.name == "nadir"
    assert np.array_equal(frame.frame_from_world, np.eye(3))
    assert np.array_equal(frame_rotation(np.array([0.0, 0.0, -1.0])), np.eye(3))


@pytest.mark.parametrize(("x", "y", "name"), [(0, 1, "north_45"), (-1, 0, "west_45"), (-1, -1, "southwest_55")])
def test_names(x: float, y: float, name: str) -> None:
    assert direction_name(np.array([x, y, -1.0])) == name


def test_no_images_no_frames() -> None:
    assert look_directions([]) == ()

"""Points of compared depth maps: whoever takes the votes that another task has left reads the same points as whoever compares."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from box_scene import BoxScene, nadir_views, oblique_views
from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import DepthMap
from cityflow.core.grid import Bounds
from cityflow.core.local_frame import LocalFrame
from cityflow.flow.store import Store
from cityflow.handover.array_file import encode_arrays
from cityflow.handover.depth_map_files import encode_depth_map
from cityflow.handover.depth_reader import CheckedInputs, DepthInputs, PointReader, checked_points, compared, within
from cityflow.handover.vote_files import ANYWHERE, VOTES, decode_boxes, decode_votes, encode_votes
from cityflow.surface.witnesses import WitnessParameters
from image_point_scenes import points_of, rotated

TILES: dict[str, Bounds] = {"west": (-12.0, -10.0, 0.0, 10.0), "east": (0.0, -10.0, 12.0, 10.0)}


@pytest.fixture
def images() -> list[OrientedImage]:
    return [*nadir_views()[:3], *oblique_views("across")[:2]]


@pytest.fixture
def maps(images: list[OrientedImage], tmp_path: Path) -> tuple[Store, list[str]]:
    """Depth maps of two ground tiles, one of them with a false tower on the west side."""
    store, paths = Store.open(tmp_path), []
    for tile, bounds in TILES.items():
        for image in images:
            path = f"work/match/{image.name}/{tile}.cfd"
            store.write_bytes(path, encode_depth_map(over(depths_of(image), image, bounds)))
            paths.append(path)
    return store, paths


def depths_of(image: OrientedImage) -> DepthMap:
    depth = BoxScene().truth(image).astype(np.float32)
    if image.name == "nadir0":
        depth[130:150, 60:90] -= 12.0
    shape = depth.shape
    colour = np.random.default_rng(1).integers(0, 255, (*shape, 3)).astype(np.uint8)
    return DepthMap(image.name, 0, 0, depth, np.full(shape, 0.1, np.float32), np.ones(shape, np.uint8), colour)


def over(found: DepthMap, image: OrientedImage, bounds: Bounds) -> DepthMap:
    here = within(points_of(found, image).xyz, bounds).reshape(found.depth.shape)
    return replace(found, depth=np.where(here, found.depth, np.float32(np.nan)))


def same(one: PointReader, other: PointReader, bounds: Bounds) -> int:
    a, b = one(bounds), other(bounds)
    assert np.array_equal(a.xyz, b.xyz)
    assert np.array_equal(a.views, b.views)
    assert np.array_equal(a.colour, b.colour)
    assert [a.names[i] for i in a.image] == [b.names[i] for i in b.image]
    uncut = np.concatenate([part.xyz for part in one.parts(bounds)])
    assert np.array_equal(uncut[within(uncut, bounds)], b.xyz)
    return len(a)


def test_votes_of_each_tile_give_the_points_of_who_compares_all(
    maps: tuple[Store, list[str]], images: list[OrientedImage]
) -> None:
    store, paths = maps
    inputs = DepthInputs(tuple(paths), tuple(images), 3, WitnessParameters())
    everything = (-12.0, -10.0, 12.0, 10.0)
    whole = compared(store, inputs, everything)
    for tile, bounds in TILES.items():
        # each task asks about its own tile and a rim, as fuse does
        found = compared(store, inputs, (bounds[0] - 2.0, -10.0, bounds[2] + 2.0, 10.0))
        own = {path: v for path, v in found.votes.items() if path.endswith(f"/{tile}.cfd")}
        boxes = {name: found.points.box(path) for path, (name, _) in own.items()}
        store.write_bytes(f"work/fuse/{tile}/{VOTES}", encode_votes(dict(own.values()), boxes))
        assert same(found.points, whole.points, bounds) > 10_000
    votes = tuple(f"work/fuse/{path.rsplit('/', 1)[1].removesuffix('.cfd')}/{VOTES}" for path in paths)
    names = tuple(path.split("/")[2] for path in paths)
    given = CheckedInputs(tuple(paths), votes, names, (), tuple(images), 3)
    taken = checked_points(store, given, everything)
    for bounds in (everything, TILES["west"], (-3.0, -4.0, 5.0, 1.0)):
        assert same(taken, whole.points, bounds) > 1_000
    raw = sum(len(points_of(depths_of(i), i)) for i in images)
    assert 500 < raw - len(taken(everything)) - sum(outside(i) for i in images) < 700, "the tower of 600 pixels is gone"

    # points in a frame are the same, and maps that end before the bounds are not read
    frame = LocalFrame("across_45", images[3].rotation * np.array([[1.0], [-1.0], [-1.0]]), np.array([3.0, -2.0, 1.0]))
    bounds = frame.bounds_of((-8.0, -4.0, 0.0, -2.0, 4.0, 3.0))
    tilted = checked_points(store, given, bounds, frame, colour=False)(bounds)
    moved = rotated(whole.points(everything), frame.frame_from_world, frame.origin)
    assert np.allclose(tilted.xyz, moved.xyz[within(moved.xyz, bounds)], atol=1e-9)
    assert tilted.colour.shape == (len(tilted), 0)
    for path in paths[len(images) :]:
        store.write_bytes(path, b"no depth map")
    assert same(checked_points(store, given, TILES["west"]), whole.points, (-12.0, -10.0, -1.0, 10.0)) > 1_000


def outside(image: OrientedImage) -> int:
    """Pixels whose points stand beyond both tiles."""
    points = points_of(depths_of(image), image)
    return int((~within(points.xyz, (-12.0, -10.0, 12.0, 10.0))).sum())


def test_a_direction_takes_its_own_votes_from_those_of_all(
    maps: tuple[Store, list[str]], images: list[OrientedImage]
) -> None:
    store, paths = maps
    found = compared(store, DepthInputs(tuple(paths), tuple(images), 3, WitnessParameters()), TILES["east"])
    own = dict(v for path, v in found.votes.items() if path.endswith("/east.cfd"))
    boxes = {"across0": (-1.0, 0.5, 0.1, 2.0, 3.0, 4.0), "across1": (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)}
    data = encode_votes(own, boxes)
    assert data == encode_votes(dict(reversed(own.items())), dict(reversed(boxes.items()))), "the order does not matter"
    assert decode_boxes(data) == boxes
    before = encode_arrays(own, {})
    assert decode_boxes(before) == dict.fromkeys(own, ANYWHERE), "what a version before has left"
    some = decode_votes(data, {"across0", "nobody"})
    assert list(some) == ["across0"]
    assert np.array_equal(some["across0"], own["across0"])


def test_points_that_are_read_again_stand_in_memory_once(
    maps: tuple[Store, list[str]], images: list[OrientedImage]
) -> None:
    """Whoever reads all and then a part has all points once, and gets the same as whoever reads the part alone."""
    store, paths = maps
    everywhere, part = (-12.0, -10.0, 12.0, 10.0), (-3.0, -4.0, 5.0, 2.0)
    given = DepthInputs(tuple(paths), tuple(images), 3, WitnessParameters())
    reader, alone = compared(store, given, everywhere).points, compared(store, given, everywhere).points
    whole = reader(everywhere)
    assert all(np.shares_memory(whole.xyz, kept.xyz) for kept in reader._kept.values())
    assert same(reader, alone, part) > 1000
    assert same(reader, alone, everywhere) == len(whole)

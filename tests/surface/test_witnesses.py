"""Depth maps as each other's witnesses, over boxes of known depth: what is false goes, what is thin and true stays, tiles do not matter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import box_scene
from box_scene import BOXES, BoxScene, nadir_views, oblique_views
from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import DepthMap
from cityflow.surface import witnesses
from cityflow.surface.witness_views import RUN, in_view, may_see, run_boxes, view_of
from cityflow.surface.witnesses import Witness, WitnessParameters, words_for
from image_point_scenes import points_of

AROUND = (-12.0, -10.0, 12.0, 10.0)
SPIRE = np.array([10.4, -7.0, 10.7, -6.7, 9.0])
"""0.3 m across at 8 cm a pixel, 9 m high."""
TOWER_M = 12.0


@pytest.fixture(scope="module")
def images() -> list[OrientedImage]:
    return [*nadir_views()[:3], *oblique_views("across")[:2], oblique_views("along")[0]]


def depth_map(image: OrientedImage, views: int = 2) -> DepthMap:
    """True depths, as if `views` partners had agreed."""
    depth = BoxScene().truth(image).astype(np.float32)
    shape = depth.shape
    return DepthMap(
        image.name, 0, 0, depth, np.full(shape, 0.1, np.float32), np.full(shape, views, np.uint8), np.zeros((*shape, 3), np.uint8)
    )  # fmt: skip


def judged(images: list[OrientedImage], maps: dict[str, list[DepthMap]]) -> dict[str, np.ndarray]:
    """Words for every depth of every image."""
    witnesses = [Witness.of(i, maps[i.name]) for i in images]
    return {n: w.count for n, w in words_for(witnesses, AROUND, WitnessParameters()).items()}


def asked(image: OrientedImage, made: DepthMap) -> np.ndarray:
    """Which pixels stand in the area."""
    xyz = points_of(made, image).xyz.reshape(*made.depth.shape, 3)
    return (
        (xyz[..., 0] >= AROUND[0]) & (xyz[..., 0] < AROUND[2]) & (xyz[..., 1] >= AROUND[1]) & (xyz[..., 1] < AROUND[3])
    )


def with_tower(made: DepthMap, image: OrientedImage, views: int) -> tuple[DepthMap, np.ndarray]:
    """A patch of grass put into the air, as one reference image and its partner would have it, very exact in its own eyes."""
    h, w = made.depth.shape
    false = np.zeros((h, w), bool)
    false[h // 2 - 60 : h // 2 - 30, w // 2 + 8 : w // 2 + 28] = True
    depth, sigma, said = made.depth.copy(), made.sigma.copy(), made.views.copy()
    depth[false] -= TOWER_M
    sigma[false], said[false] = 0.05, views
    return replace(made, depth=depth, sigma=sigma, views=said), false


def test_true_depths_stay_and_are_confirmed(images: list[OrientedImage]) -> None:
    maps = {i.name: [depth_map(i)] for i in images}
    words = judged(images, maps)
    for image in images:
        here = asked(image, maps[image.name][0])
        assert (words[image.name][here] > 0).mean() > 0.9999
        assert (words[image.name][~here] == 0).all(), "nobody asked"
    assert np.median(words["nadir0"][asked(images[0], maps["nadir0"][0])]) >= 6, "others have seen the same"


@pytest.mark.parametrize("views", [1, 2])
def test_a_tower_that_others_look_through_goes(images: list[OrientedImage], views: int) -> None:
    maps = {i.name: [depth_map(i)] for i in images}
    spoilt, false = with_tower(maps["nadir0"][0], images[0], views)
    maps["nadir0"] = [spoilt]
    words = judged(images, maps)
    assert (words["nadir0"][false] == 0).all()
    for image in images:
        here = asked(image, depth_map(image)) & ~(false if image.name == "nadir0" else np.zeros_like(false))
        assert (words[image.name][here] > 0).mean() > 0.9999, "a tower refutes nothing behind it"


def test_of_two_lone_words_the_nearer_one_goes(images: list[OrientedImage]) -> None:
    """One partner alone says so, and one other image, no better backed, looks through: no surface is made of that."""
    two = [images[0], images[5]]
    maps = {i.name: [depth_map(i, 1)] for i in two}
    maps["nadir0"] = [with_tower(maps["nadir0"][0], two[0], 1)[0]]
    false = with_tower(depth_map(two[0], 1), two[0], 1)[1]
    assert (judged(two, maps)["nadir0"][false] == 0).mean() > 0.95, "but for what the other's picture does not show"


def test_the_wall_behind_does_not_confirm_a_roof_that_is_drawn_out_over_the_ground(images: list[OrientedImage]) -> None:
    """The view from above puts a strip of ground at the height of the roof beside it; a slanting view sees the wall there, half a metre behind."""
    two = [images[0], images[5]]
    maps = {i.name: depth_map(i) for i in two}
    west, south, _, north, top = BOXES[1]
    made = maps["nadir0"]
    xyz = points_of(made, two[0]).xyz.reshape(*made.depth.shape, 3)
    along = (xyz[..., 1] > south + 1) & (xyz[..., 1] < north - 1)
    roof = along & (xyz[..., 2] > top - 0.01) & (xyz[..., 0] > west) & (xyz[..., 0] < west + 0.5)
    drawn_out = along & (xyz[..., 2] < 0.01) & (xyz[..., 0] > west - 0.5) & (xyz[..., 0] < west - 0.4)
    depth = np.where(drawn_out, two[0].centre[2] - top, made.depth).astype(np.float32)
    maps["nadir0"] = replace(made, depth=depth, views=np.ones_like(made.views))
    words = judged(two, {name: [m] for name, m in maps.items()})["nadir0"]
    assert drawn_out.sum() > 60
    assert (words[drawn_out] == 0).mean() > 0.95
    assert (words[roof] > 1).mean() > 0.95, "the roof's own edge is confirmed"


def test_a_thin_spire_stays(images: list[OrientedImage], monkeypatch: pytest.MonkeyPatch) -> None:
    bare = depth_map(images[3])
    monkeypatch.setattr(box_scene, "BOXES", np.vstack([BOXES, SPIRE]))
    maps = {i.name: [depth_map(i)] for i in images}
    roof = {i.name: BoxScene().depths(i, box_scene._rays(i, 1))[1] == 1 + 5 * len(BOXES) for i in images}
    assert 9 <= roof["nadir0"].sum() <= 40, "a few pixels"
    words = judged(images, maps)
    assert all((words[n][roof[n]] > 0).all() for n in ("nadir0", "nadir1", "nadir2"))
    # semi-global matching may lose what is thin in some views: those then look through it
    maps[images[3].name] = [bare]
    words = judged(images, maps)
    assert all((words[n][roof[n]] > 0).all() for n in ("nadir0", "nadir1", "nadir2"))
    words = judged([images[0], images[3]], maps)
    assert (words["nadir0"][roof["nadir0"]] > 0).all(), "as many for as against, and two partners have agreed on it"


def test_neither_tiles_nor_order_matter(images: list[OrientedImage]) -> None:
    maps = {i.name: [depth_map(i)] for i in images}
    maps["nadir0"] = [with_tower(maps["nadir0"][0], images[0], 1)[0]]
    whole = judged(images, maps)
    cut = {}
    for image in images:
        made = maps[image.name][0]
        east = points_of(made, image).xyz[:, 0].reshape(made.depth.shape) >= 1.3
        parts = [
            replace(made, depth=np.where(p, made.depth, np.float32(np.nan)), views=np.where(p, made.views, np.uint8(0)))
            for p in (east, ~east)
        ]
        cut[image.name] = [parts[1], parts[0]]
    again = judged(images[::-1], cut)
    for name, words in whole.items():
        assert words.tobytes() == again[name].tobytes()


def test_what_lies_beyond_the_reach_is_as_if_unknown(images: list[OrientedImage]) -> None:
    """So it does not matter whether a tile further off is read."""
    maps = {i.name: depth_map(i) for i in images}
    maps["nadir0"], _ = with_tower(maps["nadir0"], images[0], 1)
    p, small = WitnessParameters(reach_m=6.0), (0.0, -4.0, 6.0, 0.0)
    near = {}
    for image in images:
        made = maps[image.name]
        xy = points_of(made, image).xyz[:, :2].reshape(*made.depth.shape, 2)
        close = (xy > np.array(small[:2]) - 6.1).all(axis=-1) & (xy < np.array(small[2:]) + 6.1).all(axis=-1)
        near[image.name] = replace(made, depth=np.where(close, made.depth, np.float32(np.nan)))
    one, other = (words_for([Witness.of(i, [m[i.name]]) for i in images], small, p) for m in (maps, near))
    assert all(one[n].count.tobytes() == other[n].count.tobytes() for n in one)
    assert max(int(w.count.max()) for w in one.values()) > 4


def test_the_part_of_a_tile_is_cut_out(images: list[OrientedImage]) -> None:
    made = depth_map(images[0])
    part = replace(
        made, row=40, col=50, depth=made.depth[40:90, 50:130], sigma=made.sigma[40:90, 50:130],
        views=made.views[40:90, 50:130], colour=made.colour[40:90, 50:130],
    )  # fmt: skip
    words = words_for([Witness.of(images[0], [part])], AROUND, WitnessParameters())
    assert words["nadir0"].count.shape == (50, 80)
    votes = words["nadir0"].over((part.row, part.col, *part.depth.shape))
    inside = asked(images[0], made)[40:90, 50:130]
    assert np.array_equal(np.isfinite(part.depth) & (votes > 0), inside)
    assert (votes[inside] == 2).all()


def test_runs_of_points_that_are_left_out_have_none_in_view(images: list[OrientedImage]) -> None:
    """Points in front of a camera, beside its view and behind it, in runs that lie close together."""
    rng = np.random.default_rng(5)
    around = rng.uniform((-400, -400, -60), (400, 400, 200), (40, 3))
    xyz = (around[:, None] + rng.normal(0.0, 8.0, (40, RUN, 3))).reshape(-1, 3)[: 39 * RUN + 17]
    boxes, kept = run_boxes(xyz), 0
    views = [view_of(image, (0, 0), (image.camera.height, image.camera.width)) for image in images]
    assert may_see(views, boxes).all()
    for image, view in zip(images, views, strict=True):
        local = image.in_camera(xyz)
        expected, limits = local[:, :2] / local[:, 2:], np.array(view.limits)
        inside = (local[:, 2] > 0) & (expected >= limits[:2]).all(axis=1) & (expected <= limits[2:]).all(axis=1)
        at, normal, depth, _ = in_view(xyz, boxes, view)
        assert at.tolist() == np.flatnonzero(inside).tolist()
        assert np.allclose(normal, expected[inside])
        assert np.allclose(depth, local[inside, 2])
        kept += len(at)
        for run in range(40):
            part = slice(run * RUN, (run + 1) * RUN)
            assert may_see([view], run_boxes(xyz[part])).all() or not inside[part].any()
    assert kept > 1000
    assert not may_see(views, run_boxes(xyz + np.array([0.0, 0.0, 2e4]))).any()


@pytest.mark.parametrize("noise_m", [0.05, 0.5])
def test_what_nine_pixels_say_at_once_is_what_they_say_one_by_one(noise_m: float) -> None:
    """Depths near to every limit: alike, behind, before, beyond the reach, unknown, without a standard deviation."""
    rng = np.random.default_rng(3)
    shape, n = (60, 80), 6000
    depth = (100.0 + np.where(np.arange(80) < 40, 0.0, 6.0) + rng.normal(0, noise_m, shape)).astype(np.float32)
    depth[rng.random(shape) < 0.05] = np.nan
    sigma = rng.uniform(0.0, 0.3, shape).astype(np.float32)
    views = np.where(np.isnan(depth), 0, rng.integers(1, 6, shape)).astype(np.uint8)
    at = np.arange(n)
    places, aside = rng.uniform(-1, (81, 61), (n, 2)), rng.uniform(0, 60, n)
    far, own = 100.0 + rng.choice([-6.0, 0.0, 0.3, 6.0, 12.0], n), rng.uniform(0, 0.3, n).astype(np.float32)
    limits, lens = (3.0, 0.003, 3.0), (1.0, 1.0, 0.0, 0.0, 0, 0)
    for exact in (True, False):
        found, rasters = np.zeros(n, np.int64), (depth, sigma, views, exact)
        witnesses._weigh((places, far, aside), lens, own, rasters, limits, at, found)
        row, col = np.floor(places[:, 1]).astype(int), np.floor(places[:, 0]).astype(int)
        seen = (row >= 0) & (col >= 0) & (row < 60) & (col < 80)
        seen[seen] = np.isfinite(depth[row[seen], col[seen]])
        expected = [
            witnesses._word(row[i], col[i], (far[i], aside[i], own[i]), rasters, limits) if seen[i] else 0 for i in at
        ]
        assert found.tolist() == expected
        assert len(set(expected)) > 8
        sigma[rng.random(shape) < 0.1] = np.nan

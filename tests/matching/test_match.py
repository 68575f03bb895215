"""Depth maps of a scene of boxes against exact depths, the same for any cut of the ground, and bad partners named."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

import box_scene
from cityflow.core.arrays import Float32Array
from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import points_of
from cityflow.core.ground_cells import GroundCells
from cityflow.core.parameters import merged
from cityflow.core.pixels import ArrayPixels
from cityflow.matching.match import Matched, MatchParameters, match

EVERYWHERE = GroundCells((-100.0, -100.0, 100.0, 100.0), 100.0, ((-1, -1), (-1, 0), (0, -1), (0, 0)))
HEIGHTS = (-1.0, 9.0)
GSD = 0.08
PARAMETERS = MatchParameters.model_validate(
    merged(MatchParameters().model_dump(), {"lattice": {"block_px": 128, "halo_px": 24, "coarsest_px": 96}})
)


@cache
def pictures(kind: str) -> tuple[tuple[OrientedImage, ...], tuple[ArrayPixels, ...]]:
    scene = box_scene.BoxScene()
    views = box_scene.nadir_views((-0.05, 0.01)) if kind == "nadir" else box_scene.oblique_views(kind)
    return tuple(views), tuple(scene.picture(v, gain) for v, gain in zip(views, (1.0, 0.8, 1.2, 0.9), strict=False))


@cache
def matched(kind: str, keep: GroundCells = EVERYWHERE) -> Matched:
    cv2.setNumThreads(1)
    views, pixels = pictures(kind)
    return match(views[0], pixels[0], list(zip(views[1:], pixels[1:], strict=True)), keep, HEIGHTS, PARAMETERS)


def on_image(result: Matched, image: OrientedImage) -> Float32Array:
    full = np.full((image.camera.height, image.camera.width), np.nan, np.float32)
    d = result.depth_map
    assert d is not None
    full[d.row : d.row + d.depth.shape[0], d.col : d.col + d.depth.shape[1]] = d.depth
    return full


@pytest.mark.parametrize(
    ("kind", "nmad_gsd", "within"), [("nadir", 0.5, 0.97), ("across", 0.8, 0.93), ("along", 1.0, 0.93)]
)
def test_depths_agree_with_the_truth(kind: str, nmad_gsd: float, within: float) -> None:
    views, _ = pictures(kind)
    truth = box_scene.BoxScene().truth(views[0])
    error = (on_image(matched(kind), views[0]) - truth)[30:-30, 30:-30] / GSD
    known = np.isfinite(error)
    assert known.mean() > 0.93
    found = error[known]
    assert 1.4826 * np.median(np.abs(found - np.median(found))) < nmad_gsd
    assert abs(np.median(found)) < 0.2
    assert np.mean(np.abs(found) < 3) > within


def test_sigmas_are_neither_too_small_nor_too_large() -> None:
    views, _ = pictures("nadir")
    result = matched("nadir").depth_map
    assert result is not None
    truth = box_scene.BoxScene().truth(views[0])
    window = truth[result.row : result.row + result.depth.shape[0], result.col : result.col + result.depth.shape[1]]
    known = result.views >= 2
    ratio = np.median(np.abs(result.depth - window)[known] / result.sigma[known]) / 0.6745
    assert 0.1 < ratio < 1.5


def test_another_cut_of_the_ground_gives_the_same_depths() -> None:
    views, _ = pictures("nadir")
    whole = on_image(matched("nadir"), views[0])
    both = np.full_like(whole, np.nan)
    for col in (-1, 0):
        keep = GroundCells((col * 12.0, -12.0, col * 12.0 + 12.0, 12.0), 12.0, ((col, -1), (col, 0)))
        part = matched("nadir", keep)
        depth = on_image(part, views[0])
        assert not np.any(np.isfinite(depth) & np.isfinite(both))
        both = np.where(np.isfinite(depth), depth, both)
        assert part.depth_map is not None
        xyz = points_of(part.depth_map, views[0]).xyz
        assert np.all(keep.holds(xyz[:, 0], xyz[:, 1]))
    inside = np.isfinite(both)
    assert inside.sum() > 0.6 * np.isfinite(whole).sum()
    np.testing.assert_array_equal(both[inside], whole[inside])


def test_vertical_parallax_is_measured_corrected_and_in_the_end_refused() -> None:
    views, pixels = pictures("nadir")
    reference, partner = views[:2]

    def turned(pixels_down: float) -> OrientedImage:
        angle = pixels_down / partner.camera.fx
        c, s = np.cos(angle), np.sin(angle)
        return replace(partner, rotation=np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ partner.rotation)

    reports = []
    for down in (0.0, 1.2, 9.0):
        result = match(reference, pixels[0], [(turned(down), pixels[1])], EVERYWHERE, HEIGHTS, PARAMETERS)
        reports.append(result.pairs[0])
    assert reports[0].parallax_px < 0.3
    assert reports[1].used
    assert reports[1].parallax_px == pytest.approx(1.2, abs=0.35)
    assert not reports[2].used
    assert reports[2].reason


def test_partners_that_see_something_else_are_refused_and_cells_out_of_sight_give_nothing() -> None:
    views, pixels = pictures("nadir")
    away = replace(views[1], centre=views[1].centre + np.array([500.0, 0, 0]), name="far away")
    blank = ArrayPixels(np.full_like(pixels[1].array, 90))
    result = match(views[0], pixels[0], [(away, pixels[1]), (views[2], blank)], EVERYWHERE, HEIGHTS, PARAMETERS)
    assert result.depth_map is None
    assert [p.used for p in result.pairs] == [False, False]
    assert all(p.reason for p in result.pairs)
    elsewhere = GroundCells((900.0, 900.0, 1000.0, 1000.0), 100.0, ((9, 9),))
    assert matched("nadir", elsewhere).depth_map is None


def test_sixteen_bit_images_are_matched_alike() -> None:
    views, pixels = pictures("nadir")
    deep = [ArrayPixels((p.array.astype(np.uint16) ** 2) // 4) for p in pixels]
    result = match(views[0], deep[0], list(zip(views[1:], deep[1:], strict=True)), EVERYWHERE, HEIGHTS, PARAMETERS)
    truth = box_scene.BoxScene().truth(views[0])
    error = np.abs(on_image(result, views[0]) - truth)[30:-30, 30:-30] / GSD
    assert np.mean(error[np.isfinite(error)] < 3) > 0.96
    assert result.depth_map is not None
    assert result.depth_map.colour.dtype == np.uint16

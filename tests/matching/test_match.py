"""Depth maps of a scene of boxes against exact depths, the same for any cut of the ground, and bad partners named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import cv2
import numpy as np
import pytest

import box_scene
from cityflow.core.arrays import Float32Array
from cityflow.core.camera import OrientedImage
from cityflow.core.depth_map import DepthMap
from cityflow.core.ground_cells import GroundCells
from cityflow.core.parameters import merged
from cityflow.core.pixels import ArrayPixels
from cityflow.handover.depth_map_files import encode_depth_map
from cityflow.matching import block_use
from cityflow.matching.block_use import BlockUse
from cityflow.matching.lattice import PairLattice
from cityflow.matching.match import Matched, MatchParameters, match
from image_point_scenes import points_of

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


class Found(NamedTuple):
    """Depth maps by ground tile, and the result."""

    maps: dict[str, DepthMap]
    result: Matched

    @property
    def map(self) -> DepthMap:
        """Of the only tile."""
        (found,) = self.maps.values()
        return found


Pair = tuple[OrientedImage, ArrayPixels]


def match_over(
    reference: Pair, partners: Sequence[Pair], grounds: Mapping[str, GroundCells], parameters: MatchParameters = PARAMETERS
) -> Found:  # fmt: skip
    cv2.setNumThreads(1)
    maps: dict[str, DepthMap] = {}
    return Found(maps, match(*reference, partners, grounds, HEIGHTS, parameters, maps.__setitem__))


@cache
def matched(kind: str, *tiles: GroundCells) -> Found:
    """One tile for each; without, one over everything."""
    reference, *partners = zip(*pictures(kind), strict=True)
    return match_over(reference, partners, {f"{k}": keep for k, keep in enumerate(tiles or (EVERYWHERE,))})


def on_image(d: DepthMap, image: OrientedImage) -> Float32Array:
    full = np.full((image.camera.height, image.camera.width), np.nan, np.float32)
    full[d.row : d.row + d.depth.shape[0], d.col : d.col + d.depth.shape[1]] = d.depth
    return full


@pytest.mark.parametrize(
    ("kind", "nmad_gsd", "within"), [("nadir", 0.5, 0.97), ("across", 0.8, 0.93), ("along", 1.0, 0.93)]
)
def test_depths_agree_with_the_truth(kind: str, nmad_gsd: float, within: float) -> None:
    views, _ = pictures(kind)
    truth = box_scene.BoxScene().truth(views[0])
    error = (on_image(matched(kind).map, views[0]) - truth)[30:-30, 30:-30] / GSD
    known = np.isfinite(error)
    assert known.mean() > 0.93
    found = error[known]
    assert 1.4826 * np.median(np.abs(found - np.median(found))) < nmad_gsd
    assert abs(np.median(found)) < 0.2
    assert np.mean(np.abs(found) < 3) > within


def test_sigmas_are_neither_too_small_nor_too_large() -> None:
    views, _ = pictures("nadir")
    result = matched("nadir").map
    truth = box_scene.BoxScene().truth(views[0])
    window = truth[result.row : result.row + result.depth.shape[0], result.col : result.col + result.depth.shape[1]]
    known = result.views >= 2
    ratio = np.median(np.abs(result.depth - window)[known] / result.sigma[known]) / 0.6745
    assert 0.1 < ratio < 1.5


def strip(col: int) -> GroundCells:
    """12 m by 24 m on either side of x = 0."""
    return GroundCells((col * 12.0, -12.0, col * 12.0 + 12.0, 12.0), 12.0, ((col, -1), (col, 0)))


def test_another_cut_of_the_ground_gives_the_same_depths() -> None:
    views, _ = pictures("nadir")
    whole = on_image(matched("nadir").map, views[0])
    both = np.full_like(whole, np.nan)
    for name, found in matched("nadir", strip(-1), strip(0)).maps.items():
        depth = on_image(found, views[0])
        assert not np.any(np.isfinite(depth) & np.isfinite(both))
        both = np.where(np.isfinite(depth), depth, both)
        xyz = points_of(found, views[0]).xyz
        assert np.all(strip(int(name) - 1).holds(xyz[:, 0], xyz[:, 1]))
    inside = np.isfinite(both)
    assert inside.sum() > 0.6 * np.isfinite(whole).sum()
    np.testing.assert_array_equal(both[inside], whole[inside])


@pytest.mark.parametrize("kind", ["nadir", "across"])
def test_a_tile_has_the_same_bytes_whatever_other_tiles_are_asked_for(kind: str) -> None:
    far = GroundCells((0.0, 0.0, 3.0, 3.0), 3.0, ((0, 0),))
    both, alone, small = matched(kind, strip(-1), strip(0)), matched(kind, strip(-1)), matched(kind, far, strip(-1))
    assert len(encode_depth_map(alone.map)) > 10_000
    assert encode_depth_map(both.maps["0"]) == encode_depth_map(alone.map) == encode_depth_map(small.maps["1"])
    assert alone.result.points == {"0": int(np.isfinite(alone.map.depth).sum())}
    blocks = [found.result.blocks[0].matched for found in (both, matched(kind, far))]
    assert blocks[1] < blocks[0], "what only another tile needs is not matched"


@pytest.mark.parametrize("kind", ["nadir", "across"])
def test_no_block_of_a_pair_is_matched_twice_and_few_are_held(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once as one square, once as squares of two parts with three levels of small blocks; the depth maps are the same."""
    small = MatchParameters.model_validate(
        merged(PARAMETERS.model_dump(), {"lattice": {"block_px": 64, "coarsest_px": 48}})
    )
    reference, *partners = zip(*pictures(kind), strict=True)
    grounds = {f"{k}": strip(k - 1) for k in (0, 1)}
    whole = match_over(reference, partners[:2], grounds, small)
    monkeypatch.setattr(block_use, "SQUARE_PARTS", 2)
    held: list[int] = []
    lattices: dict[str, PairLattice] = {}

    def drop(self: BlockUse, number: int) -> None:
        held.append(sum(level == 0 for level, _ in self._lattice.blocks))
        before(self, number)
        lattices[self._lattice.pair.partner.name] = self._lattice

    before = BlockUse.drop
    monkeypatch.setattr(BlockUse, "drop", drop)
    found = match_over(reference, partners[:2], grounds, small)
    assert len(found.maps) == 2
    for tile, depth_map in found.maps.items():
        assert encode_depth_map(depth_map) == encode_depth_map(whole.maps[tile])
    for result in (found.result, whole.result):
        assert set(result.blocks) == {0, 1, 2}
        assert all(count.matched == count.different > 0 for count in result.blocks.values())
    assert max(held) * len(lattices) < found.result.blocks[0].different
    assert [{level for level, _ in lattice.blocks} for lattice in lattices.values()] == [{2}, {2}]


def test_vertical_parallax_is_measured_corrected_and_in_the_end_refused() -> None:
    views, pixels = pictures("nadir")
    reference, partner = views[:2]

    def turned(pixels_down: float) -> OrientedImage:
        angle = pixels_down / partner.camera.fx
        c, s = np.cos(angle), np.sin(angle)
        return replace(partner, rotation=np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ partner.rotation)

    reports = []
    for down in (0.0, 1.2, 9.0):
        found = match_over((reference, pixels[0]), [(turned(down), pixels[1])], {"0": EVERYWHERE})
        reports.append(found.result.pairs[0])
    assert reports[0].parallax_px < 0.3
    assert reports[1].used
    assert reports[1].parallax_px == pytest.approx(1.2, abs=0.35)
    assert not reports[2].used
    assert reports[2].reason


def test_partners_that_see_something_else_are_refused_and_cells_out_of_sight_give_nothing() -> None:
    views, pixels = pictures("nadir")
    away = replace(views[1], centre=views[1].centre + np.array([500.0, 0, 0]), name="far away")
    blank = ArrayPixels(np.full_like(pixels[1].array, 90))
    found = match_over((views[0], pixels[0]), [(away, pixels[1]), (views[2], blank)], {"0": EVERYWHERE})
    assert not found.maps
    assert [p.used for p in found.result.pairs] == [False, False]
    assert all(p.reason for p in found.result.pairs)
    elsewhere = GroundCells((900.0, 900.0, 1000.0, 1000.0), 100.0, ((9, 9),))
    nothing = matched("nadir", elsewhere)
    assert not nothing.maps
    assert not nothing.result.pairs


def test_sixteen_bit_images_are_matched_alike() -> None:
    views, pixels = pictures("nadir")
    deep = [ArrayPixels((p.array.astype(np.uint16) ** 2) // 4) for p in pixels]
    result = match_over((views[0], deep[0]), list(zip(views[1:], deep[1:], strict=True)), {"0": EVERYWHERE}).map
    truth = box_scene.BoxScene().truth(views[0])
    error = np.abs(on_image(result, views[0]) - truth)[30:-30, 30:-30] / GSD
    assert np.mean(error[np.isfinite(error)] < 3) > 0.96
    assert result.colour.dtype == np.uint16

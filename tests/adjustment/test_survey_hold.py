"""Planes of a scan in the adjustment of a block: patches of the scan, where pictures show them, and the block that they hold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pytest

from adjustment.survey_scenes import PLACE, houses, measured, surface
from cityflow.adjustment.block import Block, residuals, rotation_of
from cityflow.adjustment.patch_matching import crops_of, patch_ties, sides_of
from cityflow.adjustment.survey_hold import Planes, Sigmas, SurveyHeld, contradicts, held_by_survey
from cityflow.adjustment.survey_patches import Heights, Kind, Patches, patches_of
from cityflow.adjustment.tracks import Ties
from cityflow.adjustment.triangulation import triangulated
from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.geometry.similarity import Similarity
from cityflow.handover.patch_files import decode_crops, decode_sides, encode_crops, encode_sides

CAMERA = Camera(900, 600, 1200.0, 1200.0, 450.0, 300.0)
POSITION_M, ANGLE, IMAGE_PX = 0.02, 3e-4, 0.15


def _cameras(apart: float = 25.0) -> tuple[OrientedImage, ...]:
    """Level and tilted images, 120 m over 140 × 110 m."""
    images = []
    for k in range(60):
        x, y, side = apart * (k // 15), apart * ((k // 3) % 5), k % 3
        rotation = from_omega_phi_kappa(np.radians((0.0, 35.0, -35.0)[side]), 0.0, 0.0)
        images.append(
            OrientedImage(f"i{k:02d}", CAMERA, rotation, np.array([x + 20.0, y + (0.0, -70.0, 70.0)[side], 120.0]))
        )
    return tuple(images)


def _off(images: tuple[OrientedImage, ...], by: Similarity, seed: int) -> Block:
    """Each image off by itself, and all as a whole."""
    rng = np.random.default_rng(seed)
    turned = []
    for image in map(by.moved_image, images):
        own = rotation_of(rng.normal(0, ANGLE, (1, 3)))[0]
        turned.append(replace(image, rotation=own @ image.rotation, centre=image.centre + rng.normal(0, POSITION_M, 3)))
    return Block.of(turned, np.zeros(3))


def _seen(images: tuple[OrientedImage, ...], xyz: np.ndarray, seed: int) -> Ties:
    rng = np.random.default_rng(seed)
    rows = []
    for k, image in enumerate(images):
        uv = image.project(xyz)[0]
        for p in np.flatnonzero(image.holds(uv)):
            rows.append((p, k, *(uv[p] + rng.normal(0, IMAGE_PX, 2))))
    table = np.array(sorted(rows))
    ties = Ties(
        table[:, 0].astype(int), table[:, 1].astype(int), np.full(len(table), -1), table[:, 2:], np.ones(len(table))
    )
    assert ties.points == len(xyz)
    return ties


@dataclass(frozen=True)
class _Case:
    true: tuple[OrientedImage, ...]
    given: Block
    found: SurveyHeld

    def off(self, block: Block) -> tuple[float, float]:
        """Centres, metres, and rotations, degrees: RMSE."""
        there = Block.of(self.true, np.zeros(3))
        turn = block.rotations @ np.swapaxes(there.rotations, 1, 2)
        angle = np.linalg.norm(turn - np.eye(3), axis=(1, 2)) / np.sqrt(2.0)
        away = np.linalg.norm(block.centres - there.centres, axis=1)
        return float(np.sqrt(np.mean(away**2))), float(np.degrees(np.sqrt(np.mean(angle**2))))


@lru_cache(maxsize=3)
def _case(scale: float) -> _Case:
    """Tie points everywhere; patches on ground and roofs of houses in the middle alone, their planes off by 1 cm."""
    true, rng = _cameras(), np.random.default_rng(5)
    xy = rng.uniform((0, -20), (110, 130), (300, 2))
    xyz = np.column_stack([xy, rng.uniform(0, 8, len(xy))])
    ties = _seen(true, xyz, 1)
    place = np.column_stack([rng.uniform(35, 75, 160), rng.uniform(30, 75, 160), rng.uniform(0, 8, 160)])
    turn = rng.integers(4, size=160) * np.pi / 2
    normals = np.column_stack([0.6 * np.cos(turn), 0.6 * np.sin(turn), np.full(160, 0.8)])
    normals[:80] = (0.0, 0.0, 1.0)
    own = _seen(true, place, 2)
    kind = np.where(np.arange(160) < 80, Kind.LEVEL, Kind.SLOPING).astype(np.int64)
    planes = Planes(own, place + rng.normal(0, 0.01, (160, 1)) * normals, normals, kind)
    by = Similarity.about(
        np.array([55.0, 55.0, 4.0]),
        scale,
        rotation_of(np.radians([[0.03, -0.02, 0.06]]))[0],
        np.array([0.05, -0.04, 0.06]),
    )
    given = _off(true, by, 3)
    start = triangulated(given, ties)
    found = held_by_survey(given, start, ties, planes, Sigmas(IMAGE_PX, POSITION_M, ANGLE))
    assert found is not None
    return _Case(true, given, found)


def test_a_block_that_is_off_as_a_whole_follows_the_planes() -> None:
    case = _case(1.0)
    before, after = case.off(case.given), case.off(case.found.block)
    assert before[0] > 0.1
    assert before[1] > 0.05
    assert after[0] < 0.04
    assert after[1] < 0.015
    assert not case.found.scale_free


def test_what_is_stated_fits_the_errors() -> None:
    case = _case(1.0)
    stated = np.sqrt(np.einsum("nii->ni", case.found.covariances))
    centre, angle = case.off(case.found.block)
    # a draw of six numbers that the whole block shares
    assert 0.3 < centre / np.sqrt(np.mean(np.sum(stated[:, 3:] ** 2, axis=1))) < 2.0
    assert 0.3 < angle / np.degrees(np.sqrt(np.mean(np.sum(stated[:, :3] ** 2, axis=1)))) < 2.0


def test_where_a_block_was_given_is_contradicted_or_not() -> None:
    found = _case(1.0).found
    assert contradicts(found, found.move)
    assert not contradicts(found, Similarity(1.0, np.eye(3), np.array([0.002, -0.002, 0.002])))


def test_another_size_is_noticed() -> None:
    case = _case(1.006)
    assert case.found.scale_free
    assert case.found.move.scale == pytest.approx(1 / 1.006, abs=4e-4)
    assert case.off(case.found.block)[0] < 0.08


def test_the_same_inputs_give_the_same_bytes() -> None:
    first = _case(1.0).found.block.centres.tobytes()
    _case.cache_clear()
    assert _case(1.0).found.block.centres.tobytes() == first


def test_few_patches_hold_nothing() -> None:
    true = _cameras()
    xyz = np.random.default_rng(1).uniform((30, 30, 0), (70, 70, 5), (30, 3))
    ties = _seen(true, xyz, 1)
    block = replace(Block.of(true, np.zeros(3)), xyz=xyz)
    planes = Planes(ties, xyz, np.tile((0.0, 0.0, 1.0), (30, 1)), np.zeros(30, np.int64))
    assert held_by_survey(Block.of(true, np.zeros(3)), block, ties, planes, Sigmas(IMAGE_PX, POSITION_M, ANGLE)) is None


def test_patches_lie_on_ground_roofs_and_walls_and_not_across_edges() -> None:
    town = houses(1)
    scan = measured(town, 2, 150_000, 0.02, 0.2) - PLACE
    found = patches_of(scan, scan[::40], 2.0, 1.5)
    assert all(np.sum(found.kind == kind) > 30 for kind in Kind)
    flat = found.kind != Kind.WALL
    off = (found.xyz[flat, 2] - surface(town, found.xyz[flat, :2])) * found.normals[flat, 2]
    assert np.percentile(np.abs(off), 90) < 0.02
    assert (found.normals[:, 2] >= 0).all()


def _brightness(xyz: np.ndarray) -> np.ndarray:
    """(N,) of a ground with a texture of many wave lengths."""
    rng = np.random.default_rng(9)
    waves, phase = rng.normal(0, 2.5, (40, 2)), rng.uniform(0, 6, 40)
    return np.asarray(120 + 12 * np.sin(xyz[:, :2] @ waves.T + phase).sum(axis=1))


class _Drawn:
    """A picture of level ground."""

    def __init__(self, image: OrientedImage) -> None:
        self.height, self.width, self.bands, self.dtype = image.camera.height, image.camera.width, 1, np.dtype(np.uint8)
        self._image = image

    def window(self, rows: tuple[int, int], cols: tuple[int, int], level: int = 0) -> np.ndarray:
        """Level 0 alone."""
        assert level == 0
        row, col = np.mgrid[rows[0] : rows[1], cols[0] : cols[1]]
        rays = self._image.rays(np.column_stack([col.reshape(-1) + 0.5, row.reshape(-1) + 0.5]))
        ground = self._image.centre + rays * (-self._image.centre[2] / rays[:, 2])[:, None]
        return np.asarray(np.clip(_brightness(ground), 0, 255).astype(np.uint8).reshape(*row.shape, 1))


def test_pictures_show_patches_where_the_ground_is_and_not_where_the_scan_has_it() -> None:
    true = _cameras()
    place = np.array([[x, y, 0.13] for x in (45.0, 55.0, 65.0) for y in (40.0, 50.0)])
    patches = Patches(place, np.tile((0.0, 0.0, 1.0), (6, 1)), np.zeros(6, np.int64))
    sides = sides_of(patches, Heights(place), true)
    crops = [crops_of(sides, sides.of(k), i, _Drawn(i), 255.0, 0.1) for k, i in enumerate(true)]
    found = patch_ties(sides, crops, true, 0.1)
    assert len(found.side) >= 5
    read, cell_m = decode_sides(encode_sides(sides, 0.1))
    again = patch_ties(read, [decode_crops(encode_crops(c)) for c in crops], true, cell_m)
    assert again.ties.uv.tobytes() == found.ties.uv.tobytes()
    assert again.side.tolist() == found.side.tolist()
    assert found.ties.lengths.min() >= 3
    block = triangulated(Block.of(true, np.zeros(3)), found.ties)
    assert np.abs(block.xyz[:, 2]).max() < 0.02
    assert np.median(np.abs(residuals(block, found.ties)[0])) < 0.1


def test_without_a_patch_or_a_picture_of_one_nothing_is_found() -> None:
    true = _cameras()
    for patches in (Patches.none(), Patches(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.zeros(1, np.int64))):
        sides, _ = decode_sides(encode_sides(sides_of(patches, Heights(np.zeros((1, 3))), true), 0.1))
        assert len(sides) == len(patches.xyz)
        found = patch_ties(sides, [decode_crops(encode_crops({}))] * len(true), true, 0.1)
        assert found.ties.points == 0
        assert len(found.side) == 0


def test_what_stands_before_a_patch_hides_it() -> None:
    wall = np.array([[5.0, y, z] for y in np.arange(-5, 5, 0.3) for z in np.arange(0, 9, 0.3)])
    heights = Heights(np.concatenate([wall, [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]]]))
    centres = np.array([[40.0, 0.0, 50.0], [-40.0, 0.0, 50.0], [0.0, 0.0, -50.0]])
    assert heights.sees(np.zeros(3), np.array([0.0, 0.0, 1.0]), centres).tolist() == [False, True, False]

"""Pairs of the plain of known height: taken as they are, put right where rows are off, refused with the reason."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.pixels import ArrayPixels
from cityflow.matching.lattice import LatticeParameters, PairLattice
from cityflow.matching.pairs import PairReport, coarse_level, prepared_pair
from cityflow.matching.sgm import SgmClock
from plain_scene import CAMERA, DISPARITY_PX, lattice_of, photograph, raw_grey, views

HEIGHTS = (-1.0, 4.0)
"""A fifth above the lowest is 0, the height of the scene's reference plane."""
PARAMETERS = LatticeParameters(block_px=128, halo_px=24, coarsest_px=96)


def prepared(
    partner: OrientedImage, pixels: ArrayPixels | None = None, most_px: float = 2.0
) -> tuple[PairLattice | None, PairReport]:
    base, true = views()
    images = raw_grey("base", photograph(base)), raw_grey("partner", pixels or photograph(true))
    return prepared_pair(base, partner, images, HEIGHTS, PARAMETERS, most_px, SgmClock())


@cache
def off_by(rows: float, most_px: float = 4.0) -> tuple[PairLattice | None, PairReport]:
    """The partner's picture stands so many rows lower than its pose has it."""
    _, partner = views()
    camera = Camera(CAMERA.width, CAMERA.height, CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy - rows)
    return prepared(replace(partner, camera=camera), most_px=most_px)


def test_a_good_pair_is_taken_with_what_was_matched() -> None:
    lattice, report = off_by(0.0)
    assert lattice is not None
    assert (report.partner, report.used, report.reason) == ("partner", True, "")
    assert report.parallax_px < 0.1
    assert report.matched > 0.6
    assert {level for level, _ in lattice.blocks} == {coarse_level(lattice)}
    assert abs(np.nanmedian(lattice.region(0, (60, 110), (150, 250))) - DISPARITY_PX) < 0.05


def test_rows_that_are_off_are_measured_and_put_right() -> None:
    lattice, report = off_by(-1.0)
    assert lattice is not None
    assert report.used
    assert report.parallax_px == pytest.approx(1.0, rel=0.25)
    assert report.parallax_rest_px < 0.1
    assert abs(np.nanmedian(lattice.region(0, (60, 110), (150, 250))) - DISPARITY_PX) < 0.1


def test_a_pair_that_is_off_by_more_than_allowed_is_refused() -> None:
    lattice, report = off_by(-1.0, most_px=0.5)
    assert lattice is None
    assert not report.used
    assert report.reason.startswith("vertical parallax")
    assert report.parallax_px == pytest.approx(1.0, rel=0.25)


def test_pictures_with_nothing_in_common_are_refused() -> None:
    _, partner = views()
    noise = np.random.default_rng(1).integers(0, 256, (240, 320, 1)).astype(np.uint8)
    lattice, report = prepared(partner, ArrayPixels(noise))
    assert lattice is None
    assert not report.used
    assert "of the pixels could be matched" in report.reason
    assert report.matched < 0.05


def test_two_images_from_one_place_are_refused() -> None:
    base, _ = views()
    lattice, report = prepared(replace(base, name="twin"))
    assert lattice is None
    assert (report.partner, report.used) == ("twin", False)
    assert report.reason


def test_small_images_are_judged_at_their_coarsest_level() -> None:
    lattice = lattice_of()
    assert coarse_level(lattice) == lattice.coarsest == 1

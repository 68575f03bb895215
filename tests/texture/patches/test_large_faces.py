"""Faces of millions of pixels: they are made in little memory, and no larger than asked for."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from shapely import Polygon

from cityflow.core.building import Semantic
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.pixels import ArrayPixels
from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import INTERPOLATED, FaceGrid, FacePlane, FaceView, SeenFace
from cityflow.texture.patches.compose import FaceSources
from cityflow.texture.patches.make import FacePatches, make_patches
from cityflow.texture.patches.patch_parameters import PatchParameters
from cityflow.texture.source_image import Source, UnitSources

CELL = 0.05
MOST_BYTES = 85
"""Per pixel, with what a fixed number of pixels takes at a time."""


def photographed(cols: int, rows: int, parameters: PatchParameters | None = None) -> FacePatches:
    """A flat roof of so many pixels, straight from above, a tenth of which nobody sees."""
    ring = np.array([[0, 0, 0], [cols, 0, 0], [cols, rows, 0], [0, rows, 0]]) * CELL
    ring -= ring[2] / 2
    east, north, up = np.eye(3)
    face = FacePlane(
        ("solid", 0), Semantic.ROOF, (ring,), np.zeros(3), east, north, up, Polygon(ring[:, :2])
    )  # fmt: skip
    wide, tall = cols + 60, rows + 60
    camera = OrientedImage(
        "a", Camera(wide, tall, 2000.0, 2000.0, wide / 2, tall / 2), np.diag([1.0, -1, -1]), np.array([0, 0, 100.0])
    )
    pixels = np.random.default_rng(0).integers(100, 140, (tall, wide, 3), dtype=np.uint8)
    grid = FaceGrid.over(face.polygon, cols * CELL / 30)
    seen = SeenFace(FaceView(0, CELL, 0.0, 1.0), RunLengthMask.of(np.ones((grid.rows, grid.cols), bool)))
    sources = UnitSources([Source(ColourImage(camera, ArrayPixels(pixels)), 255.0)])
    made = make_patches(
        face,
        FaceSources(grid, [seen], 1),
        sources,
        lambda image, xyz: np.abs(xyz[:, 0]) > 0.05 * cols * CELL,
        parameters,
    )
    assert made is not None
    return made


def peak_bytes() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@pytest.mark.parametrize(("cols", "rows"), [(900, 900), (2600, 130)])
def test_a_patch_has_no_more_pixels_than_asked_for(cols: int, rows: int) -> None:
    made = photographed(cols, rows, PatchParameters(largest_mpx=0.2))
    for patch in (made.raw, made.rectified):
        assert 0.19e6 < patch.mask.size < 0.203e6
        assert 0.05 < (patch.index == INTERPOLATED).mean() < 0.12
        assert 110 < patch.pixels[patch.mask].mean() < 130
    assert made.notes[0] == "not in the geometry of its root image"
    assert made.notes[1].startswith("pixels of 0.050 m became 0.")
    assert all(d == 1.0 for ring in made.raw.corners for d in ring[:, 2])


def test_a_patch_that_is_no_larger_stays_as_it_is() -> None:
    made = photographed(900, 200, PatchParameters(largest_mpx=0.2))
    assert made.raw.mask.shape == made.rectified.mask.shape == (208, 908)
    assert not made.notes


@pytest.mark.skipif(sys.platform != "linux", reason="peaks of memory are counted otherwise")
def test_pixels_take_little_memory() -> None:
    """In a process of its own, as a peak is that of all a process ever did."""
    folder = Path(__file__).parent
    code = (
        "import test_large_faces as t; t.photographed(300, 300); first = t.peak_bytes();"
        "t.photographed(1300, 1300); print(t.peak_bytes() - first)"
    )
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False, timeout=300
    )
    assert run.returncode == 0, run.stderr
    assert int(run.stdout) / 1300**2 < MOST_BYTES

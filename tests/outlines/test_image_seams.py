"""Gaps that matching has bridged are found in images, and nothing is parted that is one roof or two that touch."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely

from box_scene import BoxScene, view
from cityflow.core.arrays import Float32Array
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Bounds, Grid
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.from_images.photographed import Photographed

GRID = Grid.covering((-20.0, -16.0, 20.0, 16.0), 0.5)
FINE = Grid.covering(GRID.bounds, 0.125)
TOP = 7.0
WHOLE = np.array([[-10.0, -5.0, 10.0, 5.0, TOP]])


def boxes(gap_m: float) -> np.ndarray:
    """Two of 10 by 10 m side by side."""
    return np.array([[-10.0 - gap_m / 2, -5.0, -gap_m / 2, 5.0, TOP], [gap_m / 2, -5.0, 10.0 + gap_m / 2, 5.0, TOP]])


def images_of(standing: np.ndarray) -> list[ColourImage]:
    """From above and from four sides askew, three of each, at 12 cm a pixel."""
    scene, found = BoxScene(boxes=standing), []
    for n, (x, y) in enumerate([(0.0, 0.0), (60.0, 30.0), (-60.0, -30.0), (30.0, -60.0), (-30.0, 60.0)]):
        for k, shift in enumerate((-8.0, 0.0, 8.0)):
            image = view(
                f"{n}{k}", (x + shift, y - shift / 2, 70.0), (shift / 4, 0.0, 0.0), focal=600.0, size=(420, 420)
            )
            found.append(ColourImage(image, scene.picture(image, gain=1.0 + 0.04 * (k - 1))))
    return found


def surface(standing: np.ndarray) -> RegionSurface:
    """One roof over all of it, as matching makes it, with the images."""
    roof = shapely.box(standing[:, 0].min(), -5.0, standing[:, 2].max(), 5.0)

    def heights(grid: Grid) -> Float32Array:
        return np.where(shapely.contains_xy(roof, *grid.centres()), TOP, 0.0).astype(np.float32)

    def read(bounds: Bounds) -> tuple[Grid, Float32Array]:
        return FINE, heights(FINE)

    ndsm, none = heights(GRID), np.zeros(GRID.shape, bool)
    classes = np.where(ndsm > 2.0, 6, 2).astype(np.uint8)
    seen = Photographed(images_of(standing), read)
    return RegionSurface(
        GRID, ndsm, classes, none, None, None, None, np.zeros_like(ndsm), highest=False, photographed=seen
    )  # fmt: skip


@cache
def apart() -> RegionSurface:
    return surface(boxes(1.1))


def test_two_blocks_that_stand_little_more_than_a_metre_apart_are_two() -> None:
    found = sorted((o.polygon for o in find_outlines(apart(), FindParameters())), key=lambda p: p.bounds[0])
    assert len(found) == 2
    true = [shapely.box(*b[:4]) for b in boxes(1.1)]
    assert all(
        shapely.intersection(f, t).area > 0.93 * shapely.union(f, t).area for f, t in zip(found, true, strict=True)
    )


@pytest.mark.parametrize("standing", [WHOLE, boxes(0.0)], ids=["one roof", "two roofs of other colours that touch"])
def test_what_is_one_stays_one(standing: np.ndarray) -> None:
    assert len(find_outlines(surface(standing), FindParameters())) == 1


def test_a_surface_without_images_says_nothing_of_the_gap() -> None:
    bare = apart()
    assert bare.photographed is not None
    few = RegionSurface(
        bare.grid, bare.ndsm, bare.klass, bare.holes, None, None, None, bare.dtm, highest=False,
        photographed=Photographed(bare.photographed.images[:3], bare.photographed.surface),
    )  # fmt: skip
    assert len(find_outlines(few, FindParameters())) == 1

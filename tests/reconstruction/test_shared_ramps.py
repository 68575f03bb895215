"""Ramps that matching draws at shared walls are no evidence of a roof."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely import LineString

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.shared_ramps import without_ramps
from cityflow.reconstruction.verdicts.judge import judged_model

CELL, ROOF_M = 0.125, 8.0
RNG = np.random.default_rng(5)


def beside(step: float, width: float, noise: float = 0.015) -> Evidence:
    """A flat roof east of a shared wall at x = 0, its neighbour `step` metres higher, and a ramp of `width` metres on either side between both."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(-2, 8, 0.25) + 0.1, np.arange(0, 9, 0.25) + 0.1))
    z = ROOF_M + step * np.clip(0.5 - x / 2 / width, 0, 1) + RNG.normal(0, noise, len(x))
    xyz = np.column_stack([x, y, z])
    outline = shapely.box(0, 0, 8, 9)
    inside = x > 0
    grid = Grid(-4, 13, CELL, 136, 128)
    level = np.zeros(grid.shape)
    return Evidence(
        "u", outline, _cloud(xyz[inside]), 0.0, around=_cloud(xyz), heights=HeightRaster(grid, level + ROOF_M, level),
        party=(LineString([(0, 0), (0, 9)]),), matched=True,
    )  # fmt: skip


def _cloud(xyz: FloatArray) -> PointCloud:
    return PointCloud.of(xyz, np.full(len(xyz), BUILDING))


@pytest.mark.parametrize("step", [0.6, -0.6, 2.5, -2.5])
@pytest.mark.parametrize("width", [0.4, 0.8, 1.3])
def test_points_of_a_ramp_are_left_out_and_hardly_others(step: float, width: float) -> None:
    given = beside(step, width)
    x, _, z = given.points.xyz.T
    kept = without_ramps(given).points.xyz
    assert np.mean(np.abs(kept[:, 2] - ROOF_M) > 0.1) < 0.01 < np.mean(np.abs(z - ROOF_M) > 0.1)
    assert (kept[:, 0] > width + 0.5).sum() > 0.99 * (x > width + 0.5).sum()


@pytest.mark.parametrize("step", [0.6, -1.5])
def test_the_roof_goes_on_to_the_shared_wall(step: float) -> None:
    judged = judged_model(beside(step, 1.0), ModelParameters(with_overhangs=False))
    solid = judged.choice.candidate.solid
    assert solid is not None
    x, y = (a.ravel() for a in np.meshgrid(np.arange(0.1, 8, 0.2), np.arange(0.1, 9, 0.2)))
    off = np.abs(distances_to_roof(solid, np.column_stack([x, y, np.full(len(x), ROOF_M)])))
    assert np.mean(off < 0.1) > 0.99


def test_a_roof_that_rises_to_its_neighbour_is_no_ramp() -> None:
    given = beside(1.2, 6.0)
    assert len(without_ramps(given).points) == len(given.points)


def test_level_neighbours_have_no_ramp() -> None:
    given = beside(0.1, 0.8)
    assert len(without_ramps(given).points) == len(given.points)


def test_points_of_a_scanner_stay_as_they_are() -> None:
    given = replace(beside(2.0, 0.8), matched=False)
    assert without_ramps(given) is given

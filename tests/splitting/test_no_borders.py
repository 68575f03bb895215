"""What crosses a single building and is no border: a seam of the mosaic, a staircase on one façade."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import FrameRasters, SplitEvidence
from cityflow.splitting.split import SplitParameters, split
from splitting.row_scene import ORIGIN, House, row_evidence

TURN_DEG, LENGTH_M = 17.0, 30.0
EAVES = ORIGIN[2] + House().eave - 0.2


def _places(raster: FrameRasters) -> tuple[FloatArray, FloatArray]:
    """(rows, cols) metres along the row of every cell, and its height."""
    grid = raster.grid
    x = grid.x_min + (np.arange(grid.cols) + 0.5) * grid.cell
    y = grid.y_max - (np.arange(grid.rows) + 0.5) * grid.cell
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    world = raster.frame.to_world(np.column_stack([xy, np.nan_to_num(raster.dsm).ravel()]))
    turn = np.radians(TURN_DEG)
    along = (world[:, :2] - ORIGIN[:2] - 30.0) @ np.array([np.cos(turn), np.sin(turn)])
    return np.asarray(along.reshape(grid.shape)), np.asarray(world[:, 2].reshape(grid.shape))


def _coloured(
    evidence: SplitEvidence,
    frame: int,
    where: tuple[float, float],
    gain: tuple[float, float, float],
    below: float = np.inf,
) -> SplitEvidence:
    """The same with one frame's ortho brighter between two places along the row, up to some height."""
    raster = evidence.frames[frame]
    assert raster.ortho is not None
    along, height = _places(raster)
    inside = (along > where[0]) & (along < where[1]) & (height < below)
    factor = np.where(inside[None], np.array(gain)[:, None, None], 1.0)
    ortho = np.clip(raster.ortho * factor, 0, 255).astype(np.uint8)
    frames = list(evidence.frames)
    frames[frame] = replace(raster, ortho=ortho)
    return replace(evidence, frames=tuple(frames))


@pytest.mark.parametrize("gain", [(0.75, 0.75, 0.75), (0.6, 0.7, 0.85), (1.35, 1.25, 1.15)])
def test_a_seam_between_pictures_of_two_exposures_is_no_border(gain: tuple[float, float, float]) -> None:
    evidence, _ = row_evidence([House(width=LENGTH_M)], TURN_DEG)
    assert not split(_coloured(evidence, 0, (14.0, 99.0), gain), SplitParameters()).cut_lines


@pytest.mark.parametrize("width", [1.5, 2.5])
def test_a_staircase_on_one_facade_is_no_border(width: float) -> None:
    evidence, _ = row_evidence([House(width=LENGTH_M)], TURN_DEG)
    assert not split(_coloured(evidence, 1, (14.0, 14.0 + width), (0.5, 0.5, 0.5), EAVES), SplitParameters()).cut_lines

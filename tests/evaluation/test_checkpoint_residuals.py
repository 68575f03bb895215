"""Checkpoints on a tilted plane."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.grid import Grid
from cityflow.evaluation.checkpoint_residuals import heights_at, ortho_shift

GRID = Grid(100.0, 220.0, 0.5, 40, 40)


def plane(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return 30 + 0.1 * (x - 100) - 0.2 * (y - 200)


DSM = plane(*np.meshgrid(GRID.x_centres(), GRID.y_centres()))


def test_heights_of_a_plane_are_exact() -> None:
    xy = np.random.default_rng(0).uniform((101, 201), (119, 219), (50, 2))
    assert heights_at(DSM, GRID, xy) == pytest.approx(plane(xy[:, 0], xy[:, 1]), abs=1e-9)
    assert np.isnan(heights_at(DSM, GRID, np.array([[99.0, 210.0], [110.0, 221.0]]))).all()


def test_no_height_beside_a_hole() -> None:
    xy = np.array([[110.0, 210.0]])
    hole = DSM.copy()
    row, col = GRID.indices(xy[:, 0], xy[:, 1])
    hole[row, col] = np.nan
    assert np.isnan(heights_at(hole, GRID, xy)).all()


def test_ortho_shows_what_lies_on_the_ray() -> None:
    """A surface 1 m too high under a ray leaning 3 : 4 east moves the point 0.75 m towards the camera."""
    xyz = np.array([[110.0, 210.0, plane(np.array(110.0), np.array(210.0)) - 1.0]])
    centre = xyz + np.array([[300.0, 0.0, 400.0]])
    place = ortho_shift(xyz, heights_at(DSM, GRID, xyz[:, :2]) - xyz[:, 2], centre)
    assert place[0] == pytest.approx((0.75, 0.0), abs=1e-9)
    # by hand: from the place shown, at the surface's height there taken level, the camera sees the checkpoint
    shown = np.array([xyz[0, 0] + place[0, 0], xyz[0, 1], xyz[0, 2] + 1.0])
    assert np.cross(shown - xyz[0], centre[0] - xyz[0]) == pytest.approx(np.zeros(3), abs=1e-9)

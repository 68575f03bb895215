"""Ground that a reference image and its partners see, against rectangles worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.grid import Bounds, Grid
from cityflow.core.ground_cells import GroundCells
from cityflow.orientation.flight_plan import FlightPlan, FlightPlanParameters
from cityflow.orientation.look_directions import look_directions
from cityflow.orientation.surveyed_ground import BEYOND_M, MatchedGround, images_of_ground, looked_down_on
from cityflow.orientation.views import View

DOWN = np.diag([1.0, -1.0, -1.0])
CAMERA = Camera(400, 300, 400.0, 400.0, 200.0, 150.0)
"""From 100 m up: 100 x 75 m of level ground."""
WHOLE: Bounds = (0.0, 0.0, 200.0, 100.0)
GRID = Grid(0.0, 100.0, 1.0, 100, 200)


def image(x: float, y: float = 50.2) -> OrientedImage:
    return OrientedImage(f"at_{x:g}", CAMERA, DOWN, np.array([x, y, 100.0]))


def cells(tile: Bounds = WHOLE) -> GroundCells:
    chosen = tuple((c, r) for r in range(5) for c in range(10))
    return GroundCells(tile, 20.0, chosen)


def strip(first: float, last: float) -> np.ndarray:
    """Cells of the grid with a centre between two x, in the images' 75 m of y."""
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    return np.asarray((x > first) & (x < last) & (np.abs(y - 50.2) < 37.5))


def test_counts_are_those_of_frames_that_overlap() -> None:
    matched = MatchedGround(image(60.0), (image(90.0), image(120.0)), cells())
    found = images_of_ground([matched], GRID, np.zeros(GRID.shape))
    # frames: 10 to 110, 40 to 140, 70 to 170
    assert np.array_equal(found == 3, strip(70.0, 110.0))
    assert np.array_equal(found == 2, strip(40.0, 70.0))
    assert (found[~strip(40.0, 110.0)] == 0).all(), "what the base does not see has no height, whatever partners see"


def test_the_most_of_several_bases_counts_and_not_their_sum() -> None:
    one = MatchedGround(image(60.0), (image(90.0),), cells())
    two = MatchedGround(image(90.0), (image(60.0), image(120.0)), cells())
    found = images_of_ground([one, two], GRID, np.zeros(GRID.shape))
    assert found.max() == 3
    assert np.array_equal(found == 3, strip(70.0, 110.0))
    assert np.array_equal(found, images_of_ground([two, one], GRID, np.zeros(GRID.shape)))


def test_a_base_answers_for_its_cells_alone_and_tiles_together_for_all() -> None:
    halves = [(0.0, 0.0, 90.0, 100.0), (90.0, 0.0, 200.0, 100.0)]
    parts = [MatchedGround(image(60.0), (image(90.0),), cells(half)) for half in halves]
    whole = MatchedGround(image(60.0), (image(90.0),), cells())
    ground = np.zeros(GRID.shape)
    assert np.array_equal(images_of_ground(parts, GRID, ground), images_of_ground([whole], GRID, ground))
    left = images_of_ground(parts[:1], GRID, ground)
    assert not left[:, 90:].any()
    beside = Grid(300.0, 100.0, 1.0, 10, 10)
    assert not images_of_ground(parts, beside, np.zeros(beside.shape)).any()


def test_higher_ground_is_seen_less_far() -> None:
    matched = MatchedGround(image(60.0), (image(90.0),), cells())
    found = images_of_ground([matched], GRID, np.full(GRID.shape, 50.0))
    # frames of half the size: 35 to 85 and 65 to 115
    assert np.flatnonzero(found.any(axis=0))[[0, -1]].tolist() == [65, 84]


@pytest.mark.parametrize(("count", "most"), [(2, 2), (4, 4)])
def test_a_plan_knows_the_most_images_that_are_matched_together(count: int, most: int) -> None:
    views = [View(image(60.0 + 15.0 * k), (0.0, 10.0)) for k in range(count)]
    frames = look_directions([v.image for v in views])
    assert FlightPlan(views, frames, FlightPlanParameters()).most_views == most


def tilted(degrees: float) -> View:
    a = np.radians(degrees)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(a), np.sin(a)], [0.0, -np.sin(a), np.cos(a)]])
    return View(OrientedImage(f"tilt_{degrees:g}", CAMERA, turn @ DOWN, np.array([60.0, 50.2, 100.0])), (0.0, 10.0))


def test_slanting_images_alone_make_no_survey() -> None:
    steep = [View(image(60.0), (0.0, 10.0)), View(image(90.0), (0.0, 10.0))]
    ground = looked_down_on([*steep, tilted(45.0)])
    # frames of both: 10 to 140 and 12.7 to 87.7
    low, high = np.array([10.0, 50.2 - 37.5]) - BEYOND_M, np.array([140.0, 50.2 + 37.5]) + BEYOND_M
    assert np.allclose(ground.bounds, [*low, *high])
    assert ground.equals(looked_down_on(steep))
    alone = looked_down_on([steep[0], tilted(45.0), tilted(50.0)])
    assert alone.area > 1.5 * ground.area, "one steep view has no partner that is steep: all views count"

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Grid
from cityflow.orientation.coverage import Coverage, coverage
from cityflow.orientation.image_overlap import overlaps
from cityflow.orientation.look_directions import COMPASS, look_directions
from cityflow.orientation.shortfalls import ShortfallParameters, shortfalls
from cityflow.orientation.views import View
from orientation.regular_flight import CAMERA, FLYING_HEIGHT, flight, images_of, looking

GRID = Grid.covering((-300.0, -300.0, 500.0, 600.0), 10.0)


def maps_of(views: list[View], grid: Grid = GRID) -> Coverage:
    return coverage(views, look_directions(images_of(views)), grid)


def vertical(name: str, x: float) -> View:
    return View(
        OrientedImage(name, CAMERA, looking((0, 0, -1), (0, 1, 0)), np.array([x, 0.0, FLYING_HEIGHT])), (0.0, 20.0)
    )


def test_two_vertical_views_by_hand() -> None:
    maps = maps_of([vertical("a", 0.0), vertical("b", 100.0)])
    assert (maps.views == 1).sum() == 2 * 100 * 200 / 100
    assert (maps.views == 2).sum() == 200 * 200 / 100
    row, col = GRID.indices(np.array([50.0]), np.array([0.0]))
    assert maps.gsd[row[0], col[0]] == pytest.approx(0.2 * np.hypot(1, 45 / 360), rel=0.02)
    assert maps.angle_deg[row[0], col[0]] == pytest.approx(2 * np.degrees(np.arctan(50 / 360)), rel=0.1)
    assert np.isnan(maps.gsd[maps.views == 0]).all()
    assert maps.alone == ()


@pytest.mark.parametrize(("head", "sees_walls"), [("F", "west"), ("B", "east"), ("L", "south"), ("R", "north")])
def test_a_view_to_the_east_sees_west_walls(head: str, sees_walls: str) -> None:
    maps = maps_of(flight(1, 3, heads=head, jitter_deg=0.0), Grid.covering((-700.0, -700.0, 800.0, 700.0), 10.0))
    totals = maps.walls.sum(axis=(1, 2))
    assert COMPASS[int(np.argmax(totals))] == sees_walls
    assert totals[(COMPASS.index(sees_walls) + 4) % 8] == 0
    assert totals[COMPASS.index(sees_walls)] == maps.views.sum()


def test_the_order_of_views_does_not_matter() -> None:
    views = flight(heads="NL")
    one, two = maps_of(views), maps_of(views[::-1])
    assert np.array_equal(one.walls, two.walls)
    assert np.array_equal(one.gsd, two.gsd, equal_nan=True)
    assert np.array_equal(one.angle_deg, two.angle_deg, equal_nan=True)


def test_a_surface_of_heights_is_followed() -> None:
    views = [vertical("a", 2.0)]
    frames = look_directions(images_of(views))
    hill = coverage(views, frames, GRID, np.full(GRID.shape, 180.0))
    assert hill.views.sum() == 150 * 100 / 100


@pytest.mark.parametrize(("forward", "side"), [(0.8, 0.6), (0.6, 0.3)])
def test_overlaps_of_a_regular_flight(forward: float, side: float) -> None:
    views = flight(4, 8, heads="NF", forward=forward, side=side, jitter_deg=0.2)
    found = {o.direction: o for o in overlaps(views, look_directions(images_of(views)))}
    assert np.median(found["nadir"].forward) == pytest.approx(forward, abs=0.03)
    assert np.median(found["nadir"].side) == pytest.approx(side, abs=0.04)


def test_what_will_suffer_is_said_with_area_and_place() -> None:
    views = flight(3, 6, heads="NF", jitter_deg=0.0)
    maps = maps_of(views)
    within = np.zeros(GRID.shape, bool)
    within[20:60, 35:55] = True
    found = shortfalls(maps, within, ShortfallParameters())
    east = [s for s in found if " east walls" in s.sentence]
    assert east
    count = int((within & (maps.views >= 2) & (maps.walls[COMPASS.index("east")] < 2)).sum())
    assert east[0].area_m2 == pytest.approx(count * 100.0)
    assert f"{count / 100:.1f} ha" in east[0].sentence
    x_min, y_min, x_max, y_max = east[0].places[0]
    assert GRID.x_min + 350 <= x_min < x_max <= GRID.x_min + 550
    assert GRID.y_max - 600 <= y_min < y_max <= GRID.y_max - 200


def test_gaps_lone_images_and_thin_overlap_are_told() -> None:
    views = flight(2, 5, forward=0.45)
    lone = View(replace(views[0].image, name="lone", centre=np.add(views[0].image.centre, (9000, 0, 0))), (0.0, 20.0))
    views = [*views, lone]
    frames = look_directions(images_of(views))
    maps = coverage(views, frames, GRID)
    text = "\n".join(
        s.sentence for s in shortfalls(maps, np.ones(GRID.shape, bool), ShortfallParameters(), overlaps(views, frames))
    )
    assert "no image" in text
    assert "lone" in text
    assert "forward overlap of nadir is 4" in text

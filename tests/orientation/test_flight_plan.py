from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds, tiles_over
from cityflow.orientation.flight_plan import FlightPlan, FlightPlanParameters, FlightTile
from cityflow.orientation.look_directions import look_directions
from cityflow.orientation.partners import PartnerParameters
from cityflow.orientation.reference_images import ReferenceImageParameters
from cityflow.orientation.thinning import shares_of
from cityflow.orientation.views import View, sees
from orientation.regular_flight import CAMERA, FLYING_HEIGHT, flight, images_of, looking

AREA = (-200.0, -200.0, 400.0, 450.0)


def plan_of(views: list[View], **reference_images: float) -> FlightPlan:
    frames = look_directions(images_of(views))
    return FlightPlan(
        views, frames, FlightPlanParameters(reference_images=ReferenceImageParameters(cell_m=20.0, **reference_images))
    )


def tiles_of(plan: FlightPlan, size: float = 150.0, area: Bounds = AREA) -> list[FlightTile]:
    return [t for tile in tiles_over(area, size) for t in plan.flight_tiles(tile.name, tile.bounds)]


def owners(tiles: list[FlightTile]) -> dict[tuple[str, tuple[int, int]], set[str]]:
    result: dict[tuple[str, tuple[int, int]], set[str]] = {}
    for tile in tiles:
        for cell in tile.cells.chosen:
            result.setdefault((tile.direction, cell), set()).add(tile.reference)
    return result


def test_each_cell_has_one_master_in_each_direction_that_sees_it() -> None:
    views = flight(heads="NFBLR")
    plan = plan_of(views)
    cells = owners(tiles_of(plan))
    assert all(len(names) == 1 for names in cells.values())
    image = {v.name: v.image for v in views}
    for direction in plan.directions:
        members = [image[n] for n in plan.directions[direction][0].images]
        for col in range(-5, 15):
            corners = np.array([[col + i, 5 + j, h / 20] for i in (0, 1) for j in (0, 1) for h in (0, 20)]) * 20.0
            if any(sees(i, corners).all() for i in members):
                (name,) = cells[direction, (col, 5)]
                assert sees(image[name], corners).all()


@pytest.mark.parametrize("size", [70.0, 150.0, 400.0])
def test_masters_and_partners_know_no_tiles_and_no_order(size: float) -> None:
    views = flight(heads="NL", seed=2)
    everywhere = (-1000.0, -1000.0, 1200.0, 1200.0)
    one, two = tiles_of(plan_of(views), 150.0, everywhere), tiles_of(plan_of(views[::-1]), size, everywhere)
    assert owners(one) == owners(two)
    assert {t.reference: t.partners for t in one} == {t.reference: t.partners for t in two}


def test_without_thinning_the_nearest_centre_is_master() -> None:
    views = flight(jitter_deg=0.0)
    plan = plan_of(views, max_overlap=1.0)
    centre = {v.name: v.image.centre[:2] for v in views}
    for (_, cell), (name,) in owners(tiles_of(plan)).items():
        middle = (np.array(cell) + 0.5) * 20
        away = {n: float(np.hypot(*(middle - c))) for n, c in centre.items()}
        inside = np.all(np.abs(middle - centre[name]) < (70, 120))
        assert not inside or away[name] <= min(away.values()) + 2.5


@pytest.mark.parametrize("seed", [0, 1])
def test_thinning_makes_fewer_masters_and_smaller_windows(seed: int) -> None:
    views = flight(4, 10, forward=0.9, seed=seed)
    work, count = {}, {}
    for allowed in (0.2, 1.0):
        plan = plan_of(views, max_overlap=allowed)
        reference_images = plan.reference_images("nadir")
        names = np.unique(reference_images.view)
        owned = [reference_images.cell[reference_images.view == k] for k in names]
        windows = [
            shares_of(plan.around.views[k], cells, 20.0, 64).window(np.arange(len(cells)))
            for k, cells in zip(names, owned, strict=True)
        ]
        work[allowed], count[allowed] = sum(w.area for w in windows), len(names)
        assert sum(len(reference_images.cell[reference_images.view == k]) for k in names) == len(reference_images.cell)
    assert count[0.2] < 0.7 * count[1.0]
    assert work[0.2] < work[1.0]


def test_a_cell_may_have_several_masters() -> None:
    cells = owners(tiles_of(plan_of(flight(), images_per_cell=2)))
    inner = [names for (_, (col, row)), names in cells.items() if 0 <= col < 10 and 0 <= row < 10]
    assert len(inner) == 100
    assert all(len(names) == 2 for names in inner)


def test_partners_stand_on_both_sides_and_across_at_good_angles() -> None:
    views = flight(3, 9)
    plan = plan_of(views)
    image = {v.name: v.image for v in views}
    base = "N_01_04"
    away = np.array([image[n].centre - image[base].centre for n in plan.partners(base)])
    assert (away[:, 0] > 20).any()
    assert (away[:, 0] < -20).any()
    assert (np.abs(away[:, 1]) > 60).any()
    angles = np.degrees(np.arctan2(np.hypot(away[:, 0], away[:, 1]), FLYING_HEIGHT))
    assert angles.min() > 4
    assert angles.max() < 35
    assert len(away) <= PartnerParameters().partners


def test_images_without_partners_are_named_with_the_reason() -> None:
    views = flight(2, 5)
    shifted = replace(views[0].image, name="lost", centre=np.add(views[0].image.centre, (5000, 0, 0)))
    up = OrientedImage("up", CAMERA, looking((0.2, 0, 1), (0, 1, 0)), views[3].image.centre)
    twin = replace(views[7].image, name="other_scale", centre=views[7].image.centre * (1, 1, 20))
    plan = plan_of([*views, *(View(i, (0.0, 20.0)) for i in (shifted, up, twin))])
    problems = dict(plan.problems())
    assert set(problems) == {"lost", "up", "other_scale"}
    assert "no other image" in problems["lost"]
    assert "horizon" in problems["up"]
    assert not {t.reference for t in tiles_of(plan)} & set(problems)


def test_a_single_image_has_no_tiles_but_a_reason() -> None:
    plan = plan_of(flight(1, 1))
    assert tiles_of(plan) == []
    assert len(plan.problems()) == 1


def test_images_that_stand_in_each_others_line_of_sight_are_no_pair() -> None:
    low = flight(1, 1)[0]
    high = View(replace(low.image, name="high", centre=np.add(low.image.centre, (10, 0, 90))), low.heights)
    assert len(plan_of([low, high]).problems()) == 2


def test_flight_tiles_hold_every_point_of_the_flown_ground_once() -> None:
    tiles = [t for t in tiles_of(plan_of(flight(), max_overlap=0.2), 130.0) if t.direction == "nadir"]
    rng = np.random.default_rng(5)
    x, y = rng.uniform(0, 180, 500), rng.uniform(0, 230, 500)
    assert np.array_equal(np.sum([t.cells.holds(x, y) for t in tiles], axis=0), np.ones(500))
    assert len({t.name for t in tiles}) == len(tiles)


def test_few_images_that_look_elsewhere_join_the_nearest_direction() -> None:
    views = flight(2, 8)
    tilted = [replace(v.image, name=f"T{v.name}", rotation=looking((0.25, 0, -1), (1, 0, 0))) for v in views[:3]]
    plan = plan_of([*views, *(View(i, (0.0, 20.0)) for i in tilted)])
    assert list(plan.directions) == ["nadir"]
    assert len(plan.directions["nadir"][1]) == 19

"""A scan of the synthetic town against its truth."""

from __future__ import annotations

import numpy as np
import pytest

from cityflow.core import points as las
from cityflow.synthetic.mesh import Part
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidar, TownLidarParameters, plan_strips, town_lidar


@pytest.fixture(scope="module")
def town() -> Town:
    return make_town(2, TownParameters(width_m=150, height_m=150, street_tree_share=0.8))


@pytest.fixture(scope="module")
def survey(town: Town) -> TownLidar:
    return town_lidar(town, 1)


def test_density_is_as_asked(town: Town, survey: TownLidar) -> None:
    assert np.sum(survey.points.return_number == 1) / 150**2 == pytest.approx(8.0, rel=0.1)
    x, y = town.bounds[:2]
    part = (x + 60, y + 60, x + 90, y + 90)
    dense = town_lidar(town, 1, TownLidarParameters(density_m2=20), part).points
    assert len(dense) / len(survey.points.within(part)) == pytest.approx(2.5, rel=0.1)


def test_ground_and_roofs_lie_at_their_true_height(town: Town, survey: TownLidar) -> None:
    x, y, z = survey.points.xyz.T
    ground = survey.truth_class == las.GROUND
    error = z[ground] - town.dtm(x[ground], y[ground])
    assert abs(np.median(error)) < 0.05
    assert 1.4826 * np.median(np.abs(error - np.median(error))) < 0.04
    roof = (survey.truth_part == Part.ROOF) & (survey.truth_unit >= 0)
    off = [
        z[rows] - town.units[k].z(x[rows], y[rows])
        for k in np.unique(survey.truth_unit[roof])
        for rows in [np.flatnonzero(roof & (survey.truth_unit == k))]
    ]
    heights = np.concatenate(off)
    assert np.nanmedian(np.abs(heights)) < 0.05


def test_returns_are_numbered_and_several_in_foliage(survey: TownLidar) -> None:
    number, of = survey.points.return_number, survey.points.number_of_returns
    assert number.min() == 1
    assert (number <= of).all()
    leaves = survey.truth_class == las.HIGH_VEGETATION
    assert leaves.sum() > 500
    assert np.mean(of[leaves] > 1) > 0.15
    assert np.mean(of[survey.truth_class == las.GROUND] > 1) < 0.1
    firsts = survey.points.xyz[:-1][(of[:-1] > 1) & (number[:-1] == 1) & (number[1:] == 2)]
    seconds = survey.points.xyz[1:][(of[:-1] > 1) & (number[:-1] == 1) & (number[1:] == 2)]
    assert np.mean(firsts[:, 2] > seconds[:, 2]) > 0.97


def test_walls_are_met_and_hide_the_ground_behind(town: Town, survey: TownLidar) -> None:
    assert 0.001 < survey.is_wall.mean() < 0.15
    walls = survey.points.xyz[survey.is_wall & (survey.truth_part == Part.WALL)]
    unit = survey.truth_unit[survey.is_wall & (survey.truth_part == Part.WALL)]
    top = np.array([u.ridge_m for u in town.units])[unit]
    assert np.mean(walls[:, 2] < top) > 0.99


def test_strips_cover_the_town_and_overlap(town: Town, survey: TownLidar) -> None:
    strips = plan_strips(town, TownLidarParameters())
    assert len(np.unique(survey.strip[survey.strip >= 0])) == len(strips.line) >= 2
    cells = np.zeros((15, 15), int)
    col = ((survey.points.xyz[:, 0] - town.bounds[0]) / 10).astype(int)
    row = ((survey.points.xyz[:, 1] - town.bounds[1]) / 10).astype(int)
    np.add.at(cells, (row, col), 1)
    assert cells.min() > 200


def test_points_do_not_depend_on_the_part_asked_for(town: Town, survey: TownLidar) -> None:
    x, y = town.bounds[:2]
    part = (x + 30, y + 50, x + 90, y + 100)
    once, again = town_lidar(town, 1, bounds=part).points, survey.points.within(part)
    assert np.array_equal(once.xyz, again.xyz)
    assert not np.array_equal(once.xyz[:50], town_lidar(town, 2, bounds=part).points.xyz[:50])


def test_classes_are_carried_when_asked_for(town: Town, survey: TownLidar) -> None:
    assert not survey.points.has_classes()
    x, y = town.bounds[:2]
    told = town_lidar(town, 1, TownLidarParameters(classes="perfect"), (x, y, x + 40, y + 40))
    assert np.array_equal(told.points.classification, told.truth_class)
    assert np.sum(survey.truth_class == las.LOW_NOISE) > 0

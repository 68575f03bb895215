"""Noise of image points before façades are looked for in them."""

from __future__ import annotations

import numpy as np

from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from cityflow.reconstruction.noise.voxel_filter import NoiseParameters
from cityflow.stages.walls import without_noise
from cityflow.survey.survey_parameters import SurveyParameters
from wall_scenes import ORIGIN, facade, image_points

STRAYS = 400


def test_strays_before_a_facade_go_and_the_facade_stays() -> None:
    rng = np.random.default_rng(3)
    wall, centre = facade(rng, np.array([0.0, 0.0]), np.array([12.0, 0.0]), (0.0, 9.0))
    strays = np.column_stack([rng.uniform((0, -3.0), (12, -0.6), (STRAYS, 2)), rng.uniform(0, 9, STRAYS)])
    strays[:, :2] += ORIGIN
    cloud = image_points([(wall, centre), (strays, centre)])
    kept = without_noise(cloud, NoiseParameters(remove=True))
    outside = kept.xyz[:, 1] - ORIGIN[1] < -0.6
    assert outside.sum() < 0.2 * STRAYS
    assert (~outside).sum() > 0.95 * len(wall)
    assert len(find_wall_points(kept, WallPointParameters())) > 0.95 * len(
        find_wall_points(image_points([(wall, centre)]), WallPointParameters())
    )


def test_nothing_is_removed_unless_asked_for() -> None:
    rng = np.random.default_rng(4)
    cloud = image_points([facade(rng, np.array([0.0, 0.0]), np.array([8.0, 0.0]), (0.0, 5.0))])
    assert without_noise(cloud, SurveyParameters().walls.noise) is cloud
    empty = cloud.take(np.zeros(len(cloud), bool))
    assert len(without_noise(empty, NoiseParameters(remove=True))) == 0

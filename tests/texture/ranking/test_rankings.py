"""Orders of the images of a face."""

from __future__ import annotations

import numpy as np

from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FaceView, SeenFace
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.ranking_parameters import RankingParameters
from cityflow.texture.ranking.rankings import METHODS
from texture_scenes import house

FACE = face_planes(house(0, 0, 10, 8, 6), None)[0]


def _seen(image: int, gsd: float, incidence: float, share: float) -> SeenFace:
    mask = np.zeros((10, 10), bool)
    mask.ravel()[: round(100 * share)] = True
    return SeenFace(FaceView(image, gsd, incidence, 1.0), RunLengthMask.of(mask))


SEEN = [
    _seen(4, 0.10, 10, 1.0),
    _seen(2, 0.08, 60, 0.2),
    _seen(9, 0.08, 60, 0.9),
    _seen(1, 0.05, 85, 1.0),
    _seen(0, 0.04, 20, 0.0),
]


def test_worst_distance_first_equals_by_number_without_the_blind_and_the_grazing() -> None:
    assert METHODS["worst_gsd"](FACE, SEEN, RankingParameters(last_resort_deg=80)) == [1, 2, 0]
    assert METHODS["worst_gsd"](FACE, SEEN, RankingParameters(most_incidence_deg=88)) == [3, 1, 2, 0]


def test_share_angle_gsd_weighs_share_angle_and_resolution() -> None:
    p = RankingParameters(last_resort_deg=80)
    assert METHODS["share_angle_gsd"](FACE, SEEN, p) == [0, 2, 1]
    only = {"last_resort_deg": 80, "visible_weight": 0.0, "angle_weight": 0.0, "resolution_weight": 0.0}
    assert METHODS["share_angle_gsd"](FACE, SEEN, RankingParameters(**{**only, "resolution_weight": 1.0})) == [1, 2, 0]
    assert METHODS["share_angle_gsd"](FACE, SEEN, RankingParameters(**{**only, "visible_weight": 1.0})) == [0, 2, 1]
    assert METHODS["share_angle_gsd"](FACE, SEEN, RankingParameters(**{**only, "angle_weight": 1.0})) == [0, 1, 2]


def test_images_that_graze_a_face_come_last_whatever_else_speaks_for_them() -> None:
    assert METHODS["worst_gsd"](FACE, SEEN, RankingParameters()) == [1, 2, 0, 3]
    assert METHODS["share_angle_gsd"](FACE, SEEN, RankingParameters()) == [0, 2, 1, 3]
    assert 3 not in METHODS["worst_gsd"](FACE, SEEN, RankingParameters(last_resort_deg=84))


def test_nothing_seen_is_no_order() -> None:
    for rank in METHODS.values():
        assert rank(FACE, [], RankingParameters()) == []
        assert rank(FACE, [SEEN[4]], RankingParameters()) == []

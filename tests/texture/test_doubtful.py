from __future__ import annotations

from math import hypot, nan

import numpy as np
import pytest
from shapely import LineString

from cityflow.core.building import EAVE_SPREAD_M, OutlineEdge
from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FaceGrid, FacePlane, FaceView, SeenFace
from cityflow.texture.doubtful import lost_to_slope, wall_sigma, without_doubtful
from cityflow.texture.planes import face_planes
from texture_scenes import GROUND, house, looking

LONG, TALL = 30.0, 6.0
SOUTH = ("solid", 2)


def wall() -> FacePlane:
    """The south wall of a block, 30 m long and 6 m high."""
    return next(f for f in face_planes(house(-LONG / 2, 0.0, LONG, 8.0, TALL), None) if f.key == SOUTH)


def lost(
    incidence_deg: float, sigma_m: float, level: bool = False, gsd_m: float = 0.05, gap_m: float | None = None
) -> float:
    """From 60 m away, above the middle of the wall or beside it on the ground."""
    face = wall()
    grid = FaceGrid.over(face.polygon, 0.2)
    out, aside = 60 * np.cos(np.radians(incidence_deg)), 60 * np.sin(np.radians(incidence_deg))
    away = np.array([aside, -out, 0.0]) if level else np.array([0.0, -out, aside])
    middle = np.array([0.0, 0.0, GROUND + TALL / 2])
    image = looking(middle + away, middle)
    whole = np.ones((grid.rows, grid.cols), bool)
    seen = whole if gap_m is None else np.abs(grid.centres()[..., 1] - grid.centres()[..., 1].mean()) < gap_m / 2
    one = SeenFace(FaceView(0, gsd_m, incidence_deg, 1.0), RunLengthMask.of(seen))
    return lost_to_slope(face, grid, whole, one, image, sigma_m)


def test_a_wall_seen_steeply_from_above_may_be_the_ground_before_it() -> None:
    """30 cm at 82° are 2.1 m of 6 m of height, at 45° 0.3 m."""
    assert lost(82.0, 0.3) == pytest.approx((0.3 * np.tan(np.radians(82)) - 0.3) / TALL, abs=0.04)
    assert lost(60.0, 0.3) < 0.05
    assert lost(45.0, 0.3) == 0.0


def test_a_long_wall_seen_along_the_street_stays() -> None:
    """The same angle, but 2.1 m of 30 m of length."""
    assert lost(82.0, 0.3, level=True) < 0.08


def test_a_wall_that_is_well_known_may_be_seen_steeply_until_a_pixel_is_too_long() -> None:
    assert lost(82.0, 0.03) < 0.1
    # a pixel of 1 m² is 2.7 m high and 0.37 m wide there
    assert lost(82.0, 0.03, gsd_m=1.0) == pytest.approx((2.7 - 0.37) / TALL, abs=0.05)


def test_a_strip_of_a_wall_that_others_see_too_is_no_worse_than_the_whole_of_it() -> None:
    assert lost(82.0, 0.3, gap_m=1.0) == pytest.approx(lost(82.0, 0.3), abs=0.02)


def test_views_go_and_none_is_kept_for_want_of_a_better_one() -> None:
    face = wall()
    grid = FaceGrid.over(face.polygon, 0.2)
    mask = RunLengthMask.of(np.ones((grid.rows, grid.cols), bool))
    middle = np.array([0.0, 0.0, GROUND + TALL / 2])
    images = [looking(middle + np.array(away), middle) for away in ([0.0, -30.0, 30.0], [0.0, -4.0, 60.0])]
    seen = [SeenFace(FaceView(k, 0.05, angle, 1.0), mask) for k, angle in enumerate((45.0, 86.0))]
    assert [one.view.image for one in without_doubtful(face, grid, seen, images, 0.3)] == [0]
    assert without_doubtful(face, grid, seen[1:], images, 0.3) == ()


def test_how_exactly_walls_are_known_by_hand() -> None:
    def edge(source: str, sigma_m: float, seen: float, metres: float = 10.0) -> OutlineEdge:
        return OutlineEdge(LineString([(0, 0), (metres, 0)]), source, sigma_m, seen)

    assert wall_sigma([], 0.15) == 0.15
    assert wall_sigma([edge("wall", 0.04, 1.0)], 0.1) == pytest.approx(0.04)
    assert wall_sigma([edge("given", nan, 0.0)], 0.12) == pytest.approx(0.12)
    assert wall_sigma([edge("roof", 0.1, 0.0)], 0.1) == pytest.approx(hypot(0.1, EAVE_SPREAD_M))
    assert wall_sigma([edge("roof", 0.1, 1.0)], 0.1) == pytest.approx(0.1), "façades were seen all along it"
    both = wall_sigma([edge("wall", 0.0, 1.0, 30.0), edge("wall", 0.2, 1.0, 10.0)], 0.1)
    assert both == pytest.approx(0.1), "by their lengths"

"""Rims that outlines had before their walls moved in."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import LineString

from cityflow.core.building import OutlineEdge
from cityflow.geometry.straight_edges import WallEdge
from cityflow.reconstruction.overhangs.known_rims import with_known_rim
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.rim_decision import RimOfEdge, decided, unseen
from cityflow.reconstruction.overhangs.standing_wall import StandingWall

P = OverhangParameters()
EDGE = WallEdge(np.array([[0.5, 0.5], [7.5, 0.5]]), False)
RIM = OutlineEdge(LineString([(0, 0), (8, 0)]), "roof", 0.06)


def test_a_rim_that_nobody_saw_is_where_the_outline_was() -> None:
    rim = with_known_rim(unseen(EDGE), (RIM,), P)
    (overhang,) = decided([rim], [StandingWall(0.0, 0.03)], P)
    assert overhang.reach_m == pytest.approx(0.5)
    assert overhang.sigma_m == pytest.approx(np.hypot(0.06, 0.03))


def test_both_by_their_precision() -> None:
    seen = RimOfEdge(EDGE, 0.62, 0.06, 0.03, 0.9, True, 0.62, False)
    rim = with_known_rim(seen, (RIM,), P)
    assert rim.reach_m == pytest.approx(0.56)
    assert rim.sigma_m > 0.06
    assert rim.confirmed


@pytest.mark.parametrize(
    "line",
    [
        [(8, 0), (0, 0)],  # of a building on the other side
        [(0, 0), (3, 0)],  # of a part of the edge
        [(0, 1), (8, 1)],  # inside
        [(0, -3), (8, -3)],  # farther than roofs reach
        [(0, 0), (8, 0.4)],  # not parallel
    ],
)
def test_what_is_no_rim_of_this_edge(line: list[tuple[float, float]]) -> None:
    bare = unseen(EDGE)
    assert with_known_rim(bare, (OutlineEdge(LineString(line), "roof", 0.06),), P) is bare
    party = unseen(WallEdge(EDGE.xy, True))
    assert with_known_rim(party, (RIM,), P) is party

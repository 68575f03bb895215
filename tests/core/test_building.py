"""Slope and aspect of roof planes that are written down."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import box

from cityflow.core.building import Building, Face, Polyhedron, RoofPlane, Semantic
from cityflow.core.verdicts import Verdict, verdict_counts


@pytest.mark.parametrize(
    ("slopes", "slope", "aspect"),
    [
        ((0.0, -1.0), 45.0, 0.0), ((-1.0, 0.0), 45.0, 90.0), ((0.0, 1.0), 45.0, 180.0), ((1.0, 0.0), 45.0, 270.0),
        ((-(3**-0.5), 0.0), 30.0, 90.0), ((-0.5, -0.5), np.degrees(np.arctan(0.5**0.5)), 45.0),
    ],
)  # fmt: skip
def test_a_roof_falls_to_where_its_aspect_says(slopes: tuple[float, float], slope: float, aspect: float) -> None:
    """A plane that rises to the south falls to the north: aspect 0, and clockwise from there."""
    plane = RoofPlane(*slopes, 8.0, (100.0, 200.0))
    assert plane.slope_deg == pytest.approx(slope)
    assert plane.aspect_deg == pytest.approx(aspect)
    away = np.radians(plane.aspect_deg)
    here, there = plane.z(np.array([100.0, 100.0 + np.sin(away)]), np.array([200.0, 200.0 + np.cos(away)]))
    assert here == 8.0
    assert here - there == pytest.approx(np.tan(np.radians(slope)))


def test_a_level_roof_falls_nowhere() -> None:
    plane = RoofPlane(0.0, 0.0, 8.0, (0.0, 0.0))
    assert plane.slope_deg == 0.0
    assert np.isnan(plane.aspect_deg)


def test_faces_are_found_by_what_they_are_and_rings_by_their_vertices() -> None:
    solid = Polyhedron(
        np.arange(12.0).reshape(4, 3),
        (Face(((0, 2, 1),), Semantic.GROUND), Face(((0, 1, 3),), Semantic.ROOF), Face(((1, 2, 3),), Semantic.ROOF)),
    )
    assert [f.rings for f in solid.of_semantic(Semantic.ROOF)] == [((0, 1, 3),), ((1, 2, 3),)]
    assert solid.of_semantic(Semantic.WALL) == ()
    assert solid.ring((3, 0)).tolist() == [[9, 10, 11], [0, 1, 2]]


def test_more_attributes_leave_the_first_building_as_it_was() -> None:
    first = Building("a", box(0, 0, 1, 1), 0.0, {}, attributes={"x": 1, "y": 2})
    assert first.with_attributes({"y": 3, "z": None}).attributes == {"x": 1, "y": 3, "z": None}
    assert first.attributes == {"x": 1, "y": 2}


def test_what_is_no_verdict_counts_as_poor() -> None:
    counts = verdict_counts(["good", Verdict.LOOK, "splendid", None, 3, "poor"])
    assert counts == {Verdict.GOOD: 1, Verdict.LOOK: 1, Verdict.POOR: 4}
    assert sum(verdict_counts([]).values()) == 0

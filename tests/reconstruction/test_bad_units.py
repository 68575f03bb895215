"""Whatever evidence a unit has: a valid solid over its outline, a reason where it is less than asked for, bounded work."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from bad_units import HOUSE, ORIGIN, bad_units, gable, large_units, scanned, unit
from cityflow.core.building import Semantic, Status
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.choose import DEFAULT_METHODS, MODULES, Choice
from cityflow.reconstruction.model import ModelParameters, model

UNITS, LARGE = bad_units(), large_units()
METHODS = {"default": DEFAULT_METHODS, "all": tuple(MODULES)}
NOT_KNOWN = ("one point", "on one line", "at one place", "half a roof missing", "below the floor")
"""Units whose roof nobody can know from their points: they must say so."""
KNOWN = ("chimneys and antenna", "tower of 200 m", "two roofs in one outline", "outline shifted by a metre")
"""Units whose roof is known: nothing is to be excused."""


def modelled(evidence: Evidence, methods: str) -> Choice:
    choice = model(evidence, ModelParameters(methods=METHODS[methods]))
    assert choice.status in (Status.DONE, Status.DEGRADED)
    assert (choice.reason != "") == (choice.status is Status.DEGRADED)
    assert choice.candidate.solid is not None
    assert check_polyhedron(choice.candidate.solid) == []
    return choice


@pytest.mark.parametrize("methods", METHODS)
@pytest.mark.parametrize("name", UNITS)
def test_a_valid_solid_over_the_outline(name: str, methods: str) -> None:
    evidence = UNITS[name]
    choice = modelled(evidence, methods)
    solid = choice.candidate.solid
    assert solid is not None
    floors = [shapely.Polygon(solid.ring(f.rings[0])[:, :2]) for f in solid.of_semantic(Semantic.GROUND)]
    assert shapely.area(shapely.union_all(floors)) == pytest.approx(evidence.outline.area, rel=0.05)
    assert solid.vertices[:, 2].min() == pytest.approx(evidence.ground_height, abs=0.01)


@pytest.mark.parametrize("name", NOT_KNOWN)
def test_says_that_the_roof_is_not_known(name: str) -> None:
    assert modelled(UNITS[name], "default").status is Status.DEGRADED


@pytest.mark.parametrize("name", KNOWN)
def test_nothing_to_excuse(name: str) -> None:
    assert modelled(UNITS[name], "default").status is Status.DONE


def test_ten_points_tell_a_gable() -> None:
    solid = modelled(UNITS["ten points"], "default").candidate.solid
    assert solid is not None
    assert len(solid.of_semantic(Semantic.ROOF)) == 2
    dense = unit(scanned(gable, HOUSE, 10.0, 0.0, 0)).points.xyz
    assert np.mean(np.abs(distances_to_roof(solid, dense)) <= 0.2) > 0.9


@pytest.mark.parametrize(
    ("name", "planes"), [("chimneys and antenna", 2), ("tree over the roof", 2), ("rough and alike", 2)]
)
def test_clutter_makes_no_planes(name: str, planes: int) -> None:
    assert len(modelled(UNITS[name], "default").candidate.planes) == planes


@pytest.mark.parametrize("hidden", [0.0, 0.15, 0.3])
@pytest.mark.parametrize("seed", [0, 1])
def test_planes_reach_over_what_nobody_saw_and_say_so(hidden: float, seed: int) -> None:
    """A gable whose lower end lies in shadow: both planes stay right to the walls, and know what share was seen."""
    points = scanned(gable, HOUSE, 12.0, 0.04, seed)
    choice = modelled(unit(points[points[:, 0] < 12 * (1 - hidden)]), "default")
    assert len(choice.candidate.planes) == 2
    x, y = ORIGIN[0] + np.array([11.9, 11.9]), ORIGIN[1] + np.array([0.1, 7.9])
    heights = np.sort([p.z(x, y) for p in choice.candidate.planes], axis=0)[0] - ORIGIN[2]
    assert np.abs(heights - gable(x - ORIGIN[0], y - ORIGIN[1])).max() < 0.15
    # a place counts as seen as far as 0.75 m beyond the last points
    for plane in choice.candidate.planes:
        assert plane.seen == pytest.approx(1.0 - max(hidden - 0.75 / 12, 0.0), abs=0.03)


def test_two_roofs_stand_at_their_heights() -> None:
    choice = modelled(UNITS["two roofs in one outline"], "default")
    x, y = ORIGIN[0] + np.array([3.0, 9.0]), ORIGIN[1] + np.array([3.0, 3.0])
    heights = np.array([p.z(x, y) for p in choice.candidate.planes]) - ORIGIN[2]
    assert np.abs(heights[:, 0] - 3.0).min() < 0.05
    assert np.abs(heights[:, 1] - 8.4).min() < 0.05


def test_a_tower_has_its_height() -> None:
    solid = modelled(UNITS["tower of 200 m"], "default").candidate.solid
    assert solid is not None
    assert np.ptp(solid.vertices[:, 2]) == pytest.approx(200.0, abs=0.1)


def test_150_planes_are_bounded_work() -> None:
    """More planes than the bounds allow: a solid with as many as they do, and the reason."""
    choice = modelled(LARGE["150 planes"], "default")
    assert choice.status is Status.DEGRADED
    assert "largest number" in choice.reason
    limits = ModelParameters().orientation_histogram
    assert len(choice.candidate.planes) <= limits.max_planes
    assert int(str(choice.candidate.notes["cells"])) <= limits.partition.max_cells


def test_200_000_points_are_thinned() -> None:
    choice = modelled(LARGE["200,000 points"], "default")
    assert choice.status is Status.DONE
    assert len(choice.candidate.planes) == 2
    assert int(str(choice.candidate.notes["points_used"])) < 4000

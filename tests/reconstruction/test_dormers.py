"""Dormers stand out of a slope where heights and lines say so, and nowhere else."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from shapely import Polygon, affinity

from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.roof_types import best_roofs, reconstruct
from cityflow.reconstruction.roof_types_parts.composition import Composition
from cityflow.reconstruction.roof_types_parts.dormer_values import DormerParameters
from cityflow.reconstruction.roof_types_parts.dormers import height_gains
from cityflow.reconstruction.roof_types_parts.roof_evidence import Reading, RoofTypesParameters, read
from cityflow.reconstruction.roof_types_parts.roof_model import roof_model
from roof_skeletons import found_shapes
from scenes.drawn_houses import DrawnHouse, dormer_outlines, drawn_house

PARAMETERS = RoofTypesParameters()


def evidence_of(house: DrawnHouse, pictures: bool = True) -> Evidence:
    seen = (house.ortho(),) if pictures else ()
    heights = house.heights(0.5, noise=0.15, whole_metres=False)
    return Evidence(house.shape, house.outline, PointCloud.empty(), house.ground, heights=heights, pictures=seen)


@cache
def level(seed: int) -> tuple[DrawnHouse, Reading, Composition]:
    """A house with level dormers, and what is found of it."""
    house = drawn_house("level dormers", seed)
    return house, *found(house)


def found(house: DrawnHouse, parameters: RoofTypesParameters = PARAMETERS) -> tuple[Reading, Composition]:
    reading = read(evidence_of(house), parameters)
    return reading, best_roofs(reading, "", parameters)[0]


def dormers_of(reading: Reading, roof: Composition) -> list[Polygon]:
    return [affinity.translate(Polygon(p.skeleton.quad.ring()), *reading.origin[:2]) for p in roof.dormers]


def test_level_dormers_are_found_where_they_are() -> None:
    true = hit = false = 0
    for seed in range(300, 305):
        house, reading, roof = level(seed)
        shapes = found_shapes(dormer_outlines(house), dormers_of(reading, roof))
        true, hit, false = true + shapes.true, hit + shapes.hit, false + shapes.false
    assert true >= 10
    assert hit >= 0.5 * true
    assert false <= 1


@pytest.mark.parametrize("shape", ["gable", "hip", "half-hip"])
def test_bare_roofs_have_none(shape: str) -> None:
    assert sum(len(dormers_of(*found(drawn_house(shape, seed)))) for seed in (300, 301, 302)) == 0


def test_the_solid_has_them_and_the_type_is_that_of_the_main_roof() -> None:
    tried = (reconstruct(evidence_of(drawn_house("level dormers", seed)), PARAMETERS) for seed in range(300, 304))
    candidate = next(c for c in tried if c.notes["dormers"] not in (0, None))
    assert candidate.roof_type == "gable"
    assert candidate.solid is not None
    assert not check_polyhedron(candidate.solid)
    assert len(candidate.planes) >= 3


def test_heights_over_dormers_are_nearer_to_the_truth() -> None:
    before, after = list[float](), list[float]()
    for seed in range(300, 303):
        house, reading, roof = level(seed)
        for outline in dormer_outlines(house):
            xy = np.asarray(outline.representative_point().coords)
            col, row = (xy[0, 0] - house.grid.x_min) / 0.125, (house.grid.y_max - xy[0, 1]) / 0.125
            z = house.height[int(row), int(col)] - reading.origin[2]
            local = xy - np.asarray(reading.origin[:2])
            before.append(float(abs(roof_model(roof.parts).heights(local)[0] - z)))
            after.append(float(abs(roof_model(roof.standing).heights(local)[0] - z)))
    assert np.mean(after) < 0.7 * np.mean(before)


def test_none_are_sought_where_nobody_wants_them_or_nothing_shows_lines() -> None:
    house = drawn_house("level dormers", 300)
    none = PARAMETERS.model_copy(update={"dormers": DormerParameters(most=0)})
    assert dormers_of(*found(house, none)) == []
    assert reconstruct(evidence_of(house, pictures=False), PARAMETERS).notes["dormers"] == 0


def test_gain_is_largest_for_the_true_height() -> None:
    u, v = (a.ravel() for a in np.meshgrid(np.arange(0.25, 8, 0.5), np.arange(0.25, 4, 0.5)))
    over = np.where((u > 2) & (u < 5) & (v > 1), np.maximum(1.5 - 0.8 * (v - 1), 0), 0.0)
    numbers = np.array([[2.0, 5.0, 1.0, front, 0.0, 0.0] for front in (0.7, 1.5, 2.5)])
    uv, weight = np.column_stack([u, v]), np.full(len(u), 0.2)
    gains = height_gains(numbers, uv, 0.8, np.arange(len(u)), over / 0.3, weight, 0.3)
    assert gains.argmax() == 1
    assert gains[1] > 5

"""Level sections of polyhedra."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box

from cityflow.core.building import Polyhedron
from cityflow.geometry.level_section import level_section
from geometry_shapes import extrude, gable, stepped, tower_on_roof


def test_a_block_with_a_court_keeps_its_hole() -> None:
    outer, inner = box(0, 0, 20, 12), box(5, 4, 9, 8)
    rings = [list(outer.exterior.coords)[:-1], list(inner.exterior.coords)[:-1][::-1]]
    solid = extrude([r if Polygon(r).exterior.is_ccw == (k == 0) else r[::-1] for k, r in enumerate(rings)], 0, 9)
    assert level_section(solid, 4.0).symmetric_difference(outer.difference(inner)).area == pytest.approx(0, abs=1e-9)


def test_a_gable_gets_narrower_upwards() -> None:
    areas = [level_section(gable(width=8, length=12, eave=3, ridge=6), z).area for z in (1.0, 4.5, 5.99, 6.5)]
    assert areas == pytest.approx([96, 48, 0.32, 0], abs=0.05)


def test_parts_above_a_lower_roof_remain() -> None:
    for solid in (stepped(), tower_on_roof()):
        low, high = solid.vertices[:, 2].min(), solid.vertices[:, 2].max()
        below, above = level_section(solid, low + 0.5), level_section(solid, high - 0.5)
        assert 0 < above.area < below.area
        assert below.buffer(1e-6).contains(above)


def test_heights_of_vertices_are_no_trouble() -> None:
    solid = stepped()
    for z in sorted({float(v) for v in solid.vertices[:, 2]}):
        assert level_section(solid, z).is_valid


def test_nothing_has_no_section() -> None:
    assert level_section(Polyhedron(np.empty((0, 3)), ()), 1.0).is_empty

"""Axis strips of outlines whose strips one can count by hand."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Point, Polygon, affinity, box

from cityflow.splitting.strips.axis_strips import AxisStrip, axis_strips, is_round
from cityflow.splitting.strips.strip_rasters import uv_mask

STEP_M, SHORTEST_M = 0.16, 4.5


def _pieces(outline: Polygon, *aspects: float) -> tuple[AxisStrip, ...]:
    return axis_strips(outline, aspects, STEP_M, SHORTEST_M)


def test_row_with_annexe_is_one_strip() -> None:
    row = affinity.rotate(box(0, 0, 40, 9).union(box(3, 8, 8, 12)), 23, origin=(0, 0))
    (strip,) = _pieces(row)
    assert strip.length == pytest.approx(40, abs=0.4)
    assert strip.depth == pytest.approx(9, abs=0.05)
    assert strip.aspect_deg == pytest.approx(23, abs=0.01)


def test_ring_has_a_strip_on_each_side() -> None:
    ring = affinity.rotate(box(0, 0, 60, 50).difference(box(11, 11, 49, 39)), 10)
    strips = _pieces(ring)
    assert sorted(round(p.length) for p in strips) == [28, 28, 38, 38]
    assert all(p.depth == pytest.approx(11, abs=0.05) for p in strips)


def test_wings_of_an_l() -> None:
    strips = _pieces(box(0, 0, 30, 9).union(box(0, 0, 9, 25)))
    assert sorted((round(p.length), round(p.aspect_deg)) for p in strips) == [(16, 90), (21, 0)]


def test_curved_row_is_a_chain_of_strips_across_it() -> None:
    angle = np.pi / 2 + np.linspace(-1, 1, 19)
    spoke = np.column_stack([np.cos(angle), np.sin(angle)])
    strips = _pieces(Polygon(np.concatenate([26 * spoke, 16 * spoke[::-1]])))
    assert len(strips) >= 8
    assert all(p.chain_m > 35 for p in strips)
    for p in strips:
        k = len(p.stations) // 2
        middle = p.to_world(np.array([p.stations[k], (p.low[k] + p.high[k]) / 2]))
        # chords run through the centre of the arc, which is the origin
        assert abs(middle @ p.along) / np.linalg.norm(middle) < np.sin(np.radians(9))
        assert p.depth == pytest.approx(10, abs=0.4)


def test_bent_row_keeps_both_directions() -> None:
    bent = box(0, 0, 30, 9).union(affinity.rotate(box(28, 0, 60, 9), 25, origin=(29, 0)))
    assert sorted(round(p.aspect_deg) for p in _pieces(bent)) == [0, 25]


def test_known_aspect_replaces_the_edges_own() -> None:
    row = affinity.rotate(box(0, 0, 40, 9), 23.4, origin=(0, 0))
    assert _pieces(row, 23.0, 113.0)[0].aspect_deg == pytest.approx(23.0, abs=1e-6)


def test_a_row_of_which_only_the_direction_across_is_known_has_its_strip() -> None:
    """As where roofs are flat, and steps between them are all that points show."""
    (strip,) = _pieces(box(0, 0, 30, 10), 90.0)
    assert strip.aspect_deg % 180 == pytest.approx(0, abs=0.01)
    assert strip.length == pytest.approx(30, abs=0.4)


def test_slanting_bits_do_not_part_a_strip() -> None:
    row = Polygon([(0, 0), (18, 0), (19.5, 1.2), (40, 1.2), (40, 10), (0, 10)])
    strip = _pieces(row, 0.0, 90.0)[0]
    assert strip.length == pytest.approx(40, abs=0.4)


@pytest.mark.parametrize("seed", range(4))
def test_trees_along_a_wing_do_not_part_its_strip(seed: int) -> None:
    """Bits of 3 to 4.5 m that slant by up to 35°, with straight wall between, along one side of a wing of 16 m that meets another one."""
    rng = np.random.default_rng(seed)
    side = [(0.0, 16.0)]
    for start in (4.0, 17.0, 30.0, 43.0):
        a, b = start + rng.uniform(0, 2), float(rng.uniform(1.0, 2.0))
        side += [
            (a, 16.0),
            (a + rng.uniform(3.0, 4.5), 16.0 + b),
            (a + 8.0, 16.0 + b),
            (a + 8.0 + rng.uniform(1.5, 3.0), 16.0),
        ]
    wing = Polygon([(0, 0), (60, 0), (60, 16), *side[::-1]])
    longest = _pieces(wing.union(box(-15, -20, 0, 60)), 0.0, 90.0)[0]
    assert longest.length == pytest.approx(60, abs=1.0)
    assert longest.stations[0] == pytest.approx(-longest.origin[0], abs=0.6)


def test_thousands_of_vertices() -> None:
    x = np.linspace(0, 40, 3000)
    front = np.column_stack([x, np.random.default_rng(0).normal(0, 0.03, len(x))])
    (strip,) = _pieces(Polygon(np.concatenate([front, [(40, 9), (0, 9)]])))
    assert strip.length == pytest.approx(40, abs=0.5)


def test_circles_have_no_axis() -> None:
    assert is_round(Point(0, 0).buffer(9))
    assert not is_round(box(0, 0, 9, 9))
    assert _pieces(Point(0, 0).buffer(9)) == ()


def test_there_and_back() -> None:
    strip = _pieces(affinity.rotate(box(0, 0, 40, 9), 23, origin=(0, 0)))[0]
    xy = np.array([[3.0, 4.0], [-5.0, 8.0]])
    assert np.allclose(strip.to_world(strip.to_uv(xy)), xy)


def test_mask_has_the_outline_s_area() -> None:
    outline = affinity.rotate(box(0, 0, 40, 9).difference(box(10, 3, 14, 6)), 23, origin=(0, 0))
    strip = _pieces(outline)[0]
    corners = strip.to_uv(np.array(outline.exterior.coords))
    u, v = (np.arange(corners[:, k].min() - 1, corners[:, k].max() + 1, 0.1) for k in (0, 1))
    assert uv_mask(strip, outline, u, v).sum() * 0.01 == pytest.approx(outline.area, rel=0.03)

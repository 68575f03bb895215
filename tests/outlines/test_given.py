from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely
from shapely import MultiPolygon, Polygon, box

from cityflow.core.building import Outline
from cityflow.outlines.given.given import clean_outlines


def cleaned(*polygons: Any) -> tuple[list[Outline], list[str]]:
    kept, refused = clean_outlines([Outline(f"h{i}", p) for i, p in enumerate(polygons)])
    return kept, [r.reason for r in refused]


def test_a_sound_outline_stays_as_it_is_but_for_its_direction() -> None:
    (kept,), refused = cleaned(shapely.reverse(box(0, 0, 8, 6)))
    assert kept.polygon.equals(box(0, 0, 8, 6))
    assert kept.polygon.exterior.is_ccw
    assert not kept.remark
    assert not refused


def test_a_bow_tie_becomes_its_two_halves() -> None:
    kept, _ = cleaned(Polygon([(0, 0), (10, 10), (10, 0), (0, 10)]))
    assert [o.id for o in kept] == ["h0-1", "h0-2"]
    assert [o.polygon.area for o in kept] == pytest.approx([25, 25])
    assert "self-intersection" in kept[0].remark


def test_parts_get_numbers_and_a_single_part_keeps_its_id() -> None:
    kept, _ = cleaned(MultiPolygon([box(0, 0, 2, 2), box(5, 0, 9, 4)]), MultiPolygon([box(20, 0, 25, 5)]))
    assert [o.id for o in kept] == ["h0-1", "h0-2", "h1"]
    assert kept[0].polygon.area == 16


@pytest.mark.parametrize(
    ("geometry", "reason"),
    [
        (None, "empty"),
        (Polygon(), "empty"),
        (Polygon([(0, 0), (5, 5), (10, 10)]), "area"),
        (box(0, 0, 0.2, 0.2), "area"),
        (shapely.Point(1, 1), "Point"),
    ],
)
def test_what_is_no_building_is_refused_with_a_reason(geometry: object, reason: str) -> None:
    kept, refused = cleaned(geometry, box(50, 50, 60, 60))
    assert [o.id for o in kept] == ["h1"]
    assert len(refused) == 1
    assert reason in refused[0]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_coordinates_that_are_not_numbers_are_refused() -> None:
    kept, refused = cleaned(Polygon([(0, 0), (np.nan, 5), (5, 5), (5, 0)]))
    assert not kept
    assert "finite" in refused[0]


def test_the_same_polygon_twice_names_the_first_however_it_is_written() -> None:
    turned = Polygon(np.roll(np.array(box(0, 0, 8, 6).exterior.coords)[:-1], 1, axis=0))
    kept, refused = cleaned(box(0, 0, 8, 6), turned)
    assert [o.id for o in kept] == ["h0"]
    assert refused == ["same polygon as h0"]


def test_the_same_id_for_another_polygon_gets_a_suffix() -> None:
    kept, refused = clean_outlines([Outline("a", box(0, 0, 5, 5)), Outline("a", box(9, 0, 14, 5))])
    assert [o.id for o in kept] == ["a", "a-2"]
    assert "twice" in kept[1].remark
    assert not refused


def test_heights_spikes_and_idle_vertices_go() -> None:
    ring = [(0, 0, 3), (5, 0, 3), (5, 2.5, 3), (5, 5, 3), (9, 9, 3), (5, 5.002, 3), (2, 5.0005, 3), (0, 5, 3)]
    (kept,), _ = cleaned(Polygon(ring))
    assert not kept.polygon.has_z
    assert shapely.get_num_coordinates(kept.polygon) == 5
    assert kept.polygon.area == pytest.approx(25, abs=0.02)


def test_a_finely_drawn_circle_keeps_its_shape() -> None:
    disc = shapely.Point(0, 0).buffer(10, quad_segs=2000)
    (kept,), _ = cleaned(disc)
    assert shapely.hausdorff_distance(kept.polygon, disc) < 0.003
    assert shapely.get_num_coordinates(kept.polygon) < 700


def test_a_hole_that_touches_the_shell_becomes_a_notch_and_a_tiny_hole_is_filled() -> None:
    shell = [(0, 0), (10, 0), (10, 10), (0, 10)]
    kept, _ = cleaned(
        Polygon(shell, [[(0, 2), (3, 2), (3, 7), (0, 7)]]),
        Polygon([(x + 50, y) for x, y in shell], [[(51, 1), (51.05, 1), (51.05, 1.05)]]),
    )
    assert [o.polygon.area for o in kept] == pytest.approx([85, 100])
    assert all(o.polygon.is_valid for o in kept)
    assert not kept[1].polygon.interiors

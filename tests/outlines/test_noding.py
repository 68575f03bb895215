from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, affinity, box

from cityflow.core.building import Outline
from cityflow.outlines.given.given import clean_outlines
from cityflow.outlines.noded.noding import neighbours, node_outlines, noded_parts

ORIGIN = (85000.0, 447500.0)


def named(*polygons: Polygon) -> list[Outline]:
    return [Outline(f"h{i:03}", p) for i, p in enumerate(polygons)]


def terrace(seed: int, noise_m: float) -> list[Outline]:
    """Houses in a row at different depths, some with a shed behind, every vertex given with noise."""
    rng = np.random.default_rng(seed)
    x, polygons = 0.0, []
    for _ in range(rng.integers(2, 12)):
        width, depth, front = rng.uniform(4, 8), rng.uniform(8, 12), rng.uniform(-2, 2)
        polygons.append(box(x, front, x + width, front + depth))
        if rng.random() < 0.3:
            polygons.append(box(x, front + depth, x + width / 2, front + depth + 3))
        x += width
    rings = [np.array(p.exterior.coords)[:-1] for p in polygons]
    shaken = [Polygon(ring + rng.uniform(-noise_m, noise_m, ring.shape)) for ring in rings]
    turned = [affinity.rotate(p, seed * 7.3 % 360, origin=(0, 0)) for p in shaken]
    return named(*[affinity.translate(p, *ORIGIN) for p in turned])


def array(outlines: list[Outline]) -> np.ndarray:
    return np.array([o.polygon for o in outlines], dtype=object)


def overlap_m2(outlines: list[Outline]) -> float:
    return float(shapely.area(array(outlines)).sum() - shapely.union_all(array(outlines)).area)


@pytest.mark.parametrize("seed", range(3))
def test_vertices_depend_neither_on_the_order_nor_on_outlines_far_away(seed: int) -> None:
    """Noding by tile needs this: any order, and each chain of neighbours alone, to the bit."""
    rows = [
        affinity.translate(o.polygon, 40.0 * (k % 3), 12.0 * (k // 3))
        for k in range(6)
        for o in terrace(10 * seed + k, 0.02)
    ]
    outlines = named(*rows)
    whole = {o.id: o.polygon.wkb for o in node_outlines(clean_outlines(outlines)[0])}
    shuffled = [outlines[i] for i in np.random.default_rng(seed).permutation(len(outlines))]
    assert {o.id: o.polygon.wkb for o in node_outlines(clean_outlines(shuffled)[0])} == whole
    chains = shapely.get_parts(shapely.union_all(shapely.buffer(array(outlines), 0.1)))
    assert len(chains) > 1
    for chain in chains:
        alone = [o for o in outlines if chain.intersects(o.polygon)]
        for noded in node_outlines(clean_outlines(alone)[0]):
            assert noded.polygon.wkb == whole[noded.id]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.002, 0.01, 0.02]))
def test_terraces_with_noise_become_a_coverage(seed: int, noise_m: float) -> None:
    clean, _ = clean_outlines(terrace(seed, noise_m))
    noded = node_outlines(clean)
    assert [o.id for o in noded] == [o.id for o in clean]
    assert shapely.is_valid(array(noded)).all()
    assert shapely.coverage_is_valid(array(noded))
    assert abs(overlap_m2(noded)) < 1e-6
    for before, after in zip(clean, noded, strict=True):
        assert abs(after.polygon.area - before.polygon.area) <= before.polygon.length * 0.05
        assert shapely.hausdorff_distance(after.polygon, before.polygon) < 0.12
        xy = shapely.get_coordinates(after.polygon)
        assert (xy == np.round(xy, 4)).all()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([0.05, 0.1, 0.2]))
def test_noise_beyond_the_tolerance_still_leaves_a_coverage_and_is_remarked(seed: int, noise_m: float) -> None:
    clean, _ = clean_outlines(terrace(seed, noise_m))
    noded = node_outlines(clean)
    assert shapely.is_valid(array(noded)).all()
    assert shapely.coverage_is_valid(array(noded))
    assert abs(overlap_m2(noded)) < 1e-6
    for before in clean:
        parts = [o for o in noded if o.id == before.id or o.id.rpartition("-")[0] == before.id]
        assert parts
        change = abs(sum(o.polygon.area for o in parts) - before.polygon.area)
        assert change <= before.polygon.length * 0.05 or any(o.remark for o in parts)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000))
def test_what_is_far_away_changes_nothing(seed: int) -> None:
    here = terrace(seed, 0.02)
    there = [Outline(f"far{o.id}", affinity.translate(o.polygon, 300, 40)) for o in terrace(seed + 1, 0.02)]
    alone = node_outlines(clean_outlines(here)[0])
    together = node_outlines(clean_outlines([*there, *here])[0])
    assert {o.id: o.polygon.wkb for o in together if not o.id.startswith("far")} == {o.id: o.polygon.wkb for o in alone}


def test_noding_again_changes_nothing() -> None:
    once = node_outlines(clean_outlines(terrace(5, 0.01))[0])
    assert [o.polygon.wkb for o in node_outlines(once)] == [o.polygon.wkb for o in once]


def test_a_corner_on_the_neighbours_wall_becomes_a_vertex_of_it() -> None:
    a, b = node_outlines(named(box(0, 0, 10, 10), box(10.03, 3, 15, 7)))
    common = {(x, y) for x, y in a.polygon.exterior.coords} & {(x, y) for x, y in b.polygon.exterior.coords}
    assert len(common) == 2
    assert a.polygon.touches(b.polygon)


def test_a_gap_wider_than_the_tolerance_stays() -> None:
    a, b = node_outlines(named(box(0, 0, 10, 10), box(10.2, 0, 20, 10)))
    assert a.polygon.distance(b.polygon) == pytest.approx(0.2)


def test_an_overlap_goes_to_the_smaller_and_is_remarked() -> None:
    large, small = node_outlines(named(box(0, 0, 10, 10), box(9, 2, 14, 6)))
    assert small.polygon.area == pytest.approx(20)
    assert large.polygon.area == pytest.approx(96)
    assert "4.00 m² given" in large.remark
    assert not small.remark


def test_an_outline_inside_another_leaves_it_a_courtyard() -> None:
    outer, inner = node_outlines(named(box(0, 0, 10, 10), box(3, 3, 5, 5)))
    assert len(outer.polygon.interiors) == 1
    assert outer.polygon.area + inner.polygon.area == pytest.approx(100)


def test_a_covered_outline_is_named_and_a_divided_one_numbered() -> None:
    covered = named(box(0, 0, 10, 10), box(0, 0, 5, 10), box(5, 0, 10, 10))
    assert [[o.id for o in parts] for parts in noded_parts(covered)] == [[], ["h001"], ["h002"]]
    divided = node_outlines(named(box(0, 0, 20, 5), box(8, -1, 10, 7)))
    assert [o.id for o in divided] == ["h000-1", "h000-2", "h001"]


def test_neighbours_share_the_length_of_their_wall() -> None:
    row = node_outlines(named(box(0, 0, 5, 10), box(5, 2, 10, 12), box(10.02, 2, 15, 12), box(30, 0, 35, 5)))
    beside = neighbours(row)
    assert beside["h000"] == pytest.approx({"h001": 8.0})
    assert set(beside["h001"]) == {"h000", "h002"}
    assert beside["h002"]["h001"] == pytest.approx(10.0, abs=0.05)
    assert "h003" not in beside


def test_a_tolerance_that_would_spoil_an_outline_is_lowered_there() -> None:
    comb = Polygon([(0, 0), (0.2, 0), (0.2, 5), (0.24, 5), (0.24, 0), (4, 0), (4, 6), (0, 6)])
    noded = node_outlines(named(comb, box(-3, 0, 0, 6)))
    assert shapely.is_valid(array(noded)).all()
    assert shapely.coverage_is_valid(array(noded))
    assert noded[0].polygon.area == pytest.approx(comb.area, abs=comb.length * 0.05)


def test_parts_of_an_outline_take_no_name_that_a_neighbour_has() -> None:
    """House 12 is cut in two by house 14, and its other neighbour is called 12-1: one of two units of one name would be lost."""
    row = [Outline("12", box(0, 0, 30, 10)), Outline("14", box(10, -1, 12, 11)), Outline("12-1", box(30, 0, 40, 10))]
    noded = node_outlines(row)
    assert {o.id: round(o.polygon.area) for o in noded} == {"12-2": 180, "12-3": 100, "14": 24, "12-1": 100}
    assert len(noded) == 4

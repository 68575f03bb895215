"""Chains of neighbours, all at once and cell after cell; and how they are dealt out to tiles."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import affinity, box

from cityflow.core.arrays import IntArray
from cityflow.core.building import Outline
from cityflow.outlines.noded.chains import chains, chains_by_cells
from cityflow.outlines.noded.dealing import deal
from cityflow.outlines.noded.noding import node_outlines

ROW = np.array([box(7 * k, 0, 7 * k + 6.98, 10) for k in range(30)], dtype=object)


def same_sets(a: IntArray, b: IntArray) -> bool:
    """Whether two numberings part the same things alike."""
    pairs = np.unique(np.column_stack([a, b]), axis=0)
    return len(pairs) == len(np.unique(a)) == len(np.unique(b))


@pytest.mark.parametrize("cell_m", [3.0, 40.0, 1000.0])
@pytest.mark.parametrize("seed", range(4))
def test_cells_change_no_chain(seed: int, cell_m: float) -> None:
    """Outlines of half a metre to 60 m, some over many cells, some that touch across a border only within the tolerance."""
    rng = np.random.default_rng(seed)
    low, size = rng.uniform(-150, 150, (300, 2)), rng.choice([0.5, 8.0, 60.0], (300, 2), p=[0.3, 0.68, 0.02])
    loose = [affinity.rotate(box(*p, *(p + s)), a) for p, s, a in zip(low, size, rng.uniform(0, 90, 300), strict=True)]
    polygons = np.array([*loose, box(-0.04 - 5, 200, -0.04, 205), box(0, 200, 5, 205), box(0, 205.04, 5, 210)])
    whole = chains(polygons, 0.05)
    assert 20 < len(np.unique(whole)) < 290
    assert len(set(whole[-3:].tolist())) == 1
    most: list[int] = []

    def read(numbers: IntArray) -> np.ndarray:
        most.append(len(numbers))
        return polygons[numbers]

    assert same_sets(chains_by_cells(shapely.bounds(polygons), 0.05, cell_m, read), whole)
    assert cell_m > 100 or max(most) < 60


def test_a_chain_goes_to_one_tile_and_tells_all_that_it_reaches() -> None:
    alone = box(-500, 0, -490, 10)
    polygons = np.array([*ROW, alone, box(5000, 0, 5010, 10)], dtype=object)
    known = {"0_0", "1_0", "2_0", "-5_0"}
    bounds, points = shapely.bounds(polygons), shapely.get_coordinates(shapely.point_on_surface(polygons))
    found = deal(bounds, points, chains(polygons, 0.05), 100.0, known, 0.05)
    assert found.members == {"0_0": list(range(30)), "-5_0": [30]}
    assert found.reached == {"0_0": ["0_0", "1_0", "2_0"], "-5_0": ["-5_0"]}
    assert found.outside == [31]


def test_noding_may_ask_for_a_whole_chain() -> None:
    """An overlap at one end: the rings at the other begin elsewhere. So a chain is noded in one piece, and never a part of it."""
    row = [Outline(f"h{k:02}", p) for k, p in enumerate(ROW)]
    plain = {o.id: o.polygon for o in node_outlines(row)}
    mended = {o.id: o.polygon for o in node_outlines([*row, Outline("over", box(-3, 2, 2, 8))])}
    last = row[-1].id
    assert plain[last].wkb != mended[last].wkb
    assert plain[last].normalize().wkb == mended[last].normalize().wkb

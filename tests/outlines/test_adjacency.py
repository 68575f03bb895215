"""Edges that outlines have in common."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import shapely
from shapely import Polygon

from cityflow.core.building import Outline
from cityflow.outlines.noded.adjacency import party_edges, shared_boundaries


def quarter(seed: int) -> list[Outline]:
    """Squares of a lattice joined at random, courtyards among them: neighbours have all vertices in common."""
    rng = np.random.default_rng(seed)
    owner = rng.integers(0, 6, (7, 7))
    joined = [
        shapely.union_all([shapely.box(c, r, c + 1, r + 1) for r, c in np.argwhere(owner == k)], grid_size=1e-3)
        for k in range(1, 6)
    ]
    parts = [p for shape in joined for p in shapely.get_parts(shape) if isinstance(p, Polygon)]
    return [Outline(f"o{n}", shapely.segmentize(p, 1.0)) for n, p in enumerate(parts)]


@pytest.mark.parametrize("seed", range(6))
def test_party_edges_are_those_that_two_outlines_have(seed: int) -> None:
    outlines = quarter(seed)
    edges = {
        o.id: [
            (tuple(a), tuple(b))
            for ring in shapely.get_rings(o.polygon)
            for a, b in zip(shapely.get_coordinates(ring)[:-1].tolist(), shapely.get_coordinates(ring)[1:].tolist(), strict=True)
        ]
        for o in outlines
    }  # fmt: skip
    owners = Counter(e for mine in edges.values() for e in {frozenset(e) for e in mine})
    found = party_edges(outlines)
    assert list(found) == [o.id for o in outlines]
    for name, mine in edges.items():
        expected = [e for e in mine if owners[frozenset(e)] > 1]
        assert [tuple(map(tuple, shapely.get_coordinates(line).tolist())) for line in found[name]] == expected
    length = sum(line.length for lines in found.values() for line in lines)
    assert length == pytest.approx(2 * sum(s.length for s in shared_boundaries(outlines)))
    assert any(found.values())


def test_no_outlines_no_edges() -> None:
    assert party_edges([]) == {}

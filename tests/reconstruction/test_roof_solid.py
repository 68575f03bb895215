from __future__ import annotations

import numpy as np
import pytest
from shapely.affinity import translate

from cityflow.core.building import Polyhedron
from cityflow.geometry.faults import Fault
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction import roof_solid
from cityflow.reconstruction.roof_partition import PartitionParameters
from cityflow.reconstruction.roof_solid import build_roof, coarser
from roof_cases import ORIGIN, roof_cases

CASES = roof_cases()


@pytest.mark.parametrize("name", sorted(CASES))
def test_first_attempt_is_valid(name: str) -> None:
    outline = translate(CASES[name].outline, *ORIGIN[:2])
    built = build_roof(outline, CASES[name].segments(0), 1.0, PartitionParameters())
    assert (built.simplified, built.faults) == (0, ())
    assert check_polyhedron(built.solid) == []


def test_faults_lead_to_a_coarser_partition(monkeypatch: pytest.MonkeyPatch) -> None:
    """A check that accepts no solid with more than six faces leaves the block of the last attempt."""

    def only_blocks(solid: Polyhedron) -> list[Fault]:
        return [] if len(solid.faces) < 8 else [Fault.of(204)]

    monkeypatch.setattr(roof_solid, "check_polyhedron", only_blocks)
    segments = CASES["dormer"].segments(0)
    small = PartitionParameters()
    built = build_roof(translate(CASES["dormer"].outline, *ORIGIN[:2]), segments, 1.0, small)
    assert built.simplified > 0
    assert len(built.solid.faces) == 7
    assert built.faults == ()


def test_what_stays_faulty_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(roof_solid, "check_polyhedron", lambda _: [Fault.of(204)])
    built = build_roof(
        translate(CASES["gable"].outline, *ORIGIN[:2]), CASES["gable"].segments(0), 1.0, PartitionParameters()
    )
    assert built.faults == (204,)


def test_coarser_stays_within_bounds() -> None:
    most = coarser(PartitionParameters(edge_cost=9.0, min_width=4.0, min_length=9.0), 2)
    assert PartitionParameters(**most.model_dump()) == most
    assert np.all(np.array([most.edge_cost, most.min_width, most.min_length]) == (10, 5, 10))

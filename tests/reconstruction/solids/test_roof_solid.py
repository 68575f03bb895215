from __future__ import annotations

import numpy as np
import pytest
from shapely.affinity import translate

from cityflow.core.building import Polyhedron
from cityflow.geometry.faults import Fault
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.partition.plane_energy import PartitionParameters
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.solids import roof_solid
from cityflow.reconstruction.solids.roof_solid import build_roof, coarser
from roof_cases import ORIGIN, edges_are_matched, roof_cases

CASES = roof_cases()


@pytest.mark.parametrize("name", sorted(CASES))
def test_first_attempt_is_valid(name: str) -> None:
    outline = translate(CASES[name].outline, *ORIGIN[:2])
    built = build_roof(outline, CASES[name].segments(0), 1.0, PartitionParameters())
    assert (built.simplified, built.faults) == (0, ())
    assert check_polyhedron(built.solid) == []


@pytest.mark.parametrize("seed", range(6))
def test_planes_without_sense_give_a_valid_solid(seed: int) -> None:
    """Random planes and half-random labels over a courtyard block: whatever is cut, the solid is closed."""
    case = CASES["courtyard"]
    rng = np.random.default_rng(seed)
    points = case.segments(seed, density=6.0, noise=0.1).points
    centres = points[rng.integers(0, len(points), int(rng.integers(2, 25)))]
    labels = np.argmin(np.hypot(*(points[:, None, :2] - centres[None, :, :2]).transpose(2, 0, 1)), axis=1)
    labels = np.where(rng.random(len(points)) < 0.15, rng.integers(-1, len(centres), len(points)), labels)
    slopes = rng.normal(0, 0.5, (len(centres), 2))
    heights = centres[:, 2] + rng.normal(0, 1, len(centres)) - (slopes * centres[:, :2]).sum(axis=1)
    planes = np.column_stack([slopes, heights])
    segments = PlaneSegments(ORIGIN, points, labels, planes, np.full(len(planes), 0.1), 0.1)
    built = build_roof(translate(case.outline, *ORIGIN[:2]), segments, -2.0, PartitionParameters())
    assert built.faults == ()
    assert edges_are_matched(built.solid)
    area = sum(built.partition.polygon(cell).area for cell in built.partition.cells)
    assert area == pytest.approx(case.outline.area, rel=1e-6)


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

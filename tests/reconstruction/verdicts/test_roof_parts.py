"""Planes of a roof and steps within it; what shares a wall, or is divided under noisy points, is trusted less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import LineString

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.roof_distances import roof_hits
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.verdicts.figures import Figures, roof_places
from cityflow.reconstruction.verdicts.judge import judged_model
from cityflow.reconstruction.verdicts.roof_parts import plane_count, slight_share, step_length
from roof_scenes import ORIGIN, OUTLINE, SCENES, scan


def solid_of(evidence: Evidence) -> Polyhedron:
    solid = choose(evidence, ReconstructParameters()).candidate.solid
    assert solid is not None
    return solid


@pytest.mark.parametrize(("name", "planes", "step"), [("gable", 2, 0.0), ("hip", 4, 0.0), ("two levels", 2, 8.0)])
def test_planes_and_steps_are_those_of_the_roof(name: str, planes: int, step: float) -> None:
    """The outline's own walls are no steps; the wall between two levels is, all across the building."""
    evidence = scan(SCENES[name][0], OUTLINE, 12.0, 0.02, 1)
    solid = solid_of(evidence)
    assert plane_count(solid) == planes
    assert step_length(solid, evidence.outline) == pytest.approx(step, abs=0.1)


def figures_of_unit(evidence: Evidence) -> Figures:
    found = judged_model(evidence, ModelParameters(with_overhangs=False)).figures
    assert found is not None
    return found


def test_the_fewer_the_points_the_less_a_step_and_a_shared_wall_are_known() -> None:
    sparse, dense = (scan(SCENES["two levels"][0], OUTLINE, density, 0.02, 1) for density in (2.0, 20.0))
    wall = LineString([(ORIGIN[0], ORIGIN[1]), (ORIGIN[0], ORIGIN[1] + 8.0)])
    few, many = (figures_of_unit(replace(e, party=(wall,))) for e in (sparse, dense))
    assert few.steps == pytest.approx(8.0 / 96.0 / 2.0**0.5, rel=0.3)
    assert few.steps > 2.0 * many.steps > 0.0
    assert few.shared > 2.0 * many.shared > 0.0
    assert figures_of_unit(sparse).shared == 0.0


def test_noise_counts_by_the_number_of_planes() -> None:
    hip, gable = (figures_of_unit(scan(SCENES[name][0], OUTLINE, 12.0, 0.05, 1)) for name in ("hip", "gable"))
    assert hip.divided == pytest.approx(4 * hip.noise / 96.0**0.5)
    assert hip.divided > 1.5 * gable.divided


@pytest.mark.parametrize(
    ("step", "noise", "share"),
    [(0.4, 0.02, 0.0), (0.4, 0.1, 5 / 12 * np.exp(-0.32)), (1.2, 0.1, 5 / 12 * np.exp(-2.88)), (0.15, 0.1, 0.0)],
)
def test_a_plane_near_a_larger_one_may_be_of_noise(step: float, noise: float, share: float) -> None:
    """The smaller part of the roof counts, where it is more than 20 cm and only a few times the noise away; not for what is one plane or far apart."""

    def level(x: FloatArray, _: FloatArray) -> FloatArray:
        return np.where(x < 7, 6.0, 6.0 + step)

    evidence = scan(level, OUTLINE, 12.0, 0.005, 1)
    solid, places = solid_of(evidence), roof_places(evidence.outline)
    face, _ = roof_hits(solid, np.column_stack([places, np.zeros(len(places))]))
    assert slight_share(solid, face, places, noise) == pytest.approx(share, abs=0.01)


def test_planes_of_plain_roofs_are_not_doubted() -> None:
    for name in ("gable", "hip", "parallel slopes"):
        evidence = scan(SCENES[name][0], OUTLINE, 12.0, 0.03, 1)
        assert figures_of_unit(replace(evidence, matched=True)).slight < 0.001

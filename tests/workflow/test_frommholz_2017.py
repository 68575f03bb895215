"""The workflow in the order of Frommholz 2017: monolithic, volumetric where that fails, then simpler."""

from __future__ import annotations

from pathlib import Path

import pytest

from cityflow.core.building import Semantic, Status
from cityflow.core.reconstruction import Evidence
from cityflow.geometry.polyhedron import volume
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction import volumetric
from cityflow.reconstruction.choose import Choice
from cityflow.reconstruction.model import model
from cityflow.runs.settings import load_workflow
from roof_scenes import OUTLINE, gable, scan, two_levels
from storey_scenes import VOLUME_M3, storeys

PARAMETERS = load_workflow(Path(__file__).parents[2] / "workflows" / "frommholz_2017.yaml").city


def made(evidence: Evidence) -> tuple[Choice, list[str]]:
    """The finished choice, valid, and the methods in the order of trying."""
    choice = model(evidence, PARAMETERS.reconstruct)
    assert choice.candidate.solid is not None
    assert check_polyhedron(choice.candidate.solid) == []
    return choice, [s.method for s in choice.scores]


def volume_of(choice: Choice) -> float:
    assert choice.candidate.solid is not None
    return volume(choice.candidate.solid)


def test_a_monolithic_building_needs_no_other_method() -> None:
    choice, tried = made(scan(gable, OUTLINE, 30.0, 0.03, 1))
    assert tried == ["monolithic"]
    assert choice.candidate.notes["surfaces"] == 2


def test_a_building_with_discontinuities_is_made_by_the_volumetric_method() -> None:
    choice, tried = made(storeys("set-back", 0.02, 5))
    assert tried == ["monolithic", "volumetric"]
    assert choice.scores[0].valid is False
    assert volume_of(choice) == pytest.approx(VOLUME_M3["set-back"], rel=0.005)


@pytest.mark.parametrize("kind", ["arcade", "passage"])
def test_voids_are_cut_out_of_a_monolithic_model(kind: str) -> None:
    """Its roof shows nothing of them, so the method is consistent."""
    choice, tried = made(storeys(kind, 0.02, 5))
    assert tried == ["monolithic"]
    assert volume_of(choice) == pytest.approx(VOLUME_M3[kind], rel=0.005)
    assert choice.candidate.solid is not None
    assert len(choice.candidate.solid.of_semantic(Semantic.OUTER_CEILING)) == 1


def test_where_both_fail_simpler_roofs_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = volumetric.reconstruct

    def failing(evidence: Evidence, parameters: volumetric.VolumetricParameters):  # type: ignore[no-untyped-def]
        if parameters == PARAMETERS.reconstruct.volumetric:
            raise ArithmeticError("made so")
        return whole(evidence, parameters)

    monkeypatch.setattr(volumetric, "reconstruct", failing)
    choice, tried = made(scan(two_levels, OUTLINE, 30.0, 0.03, 1))
    assert tried == ["monolithic", "volumetric", "volumetric/1"]
    assert choice.status is Status.DEGRADED


def test_where_nothing_else_is_left_it_is_a_block(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(evidence: Evidence, parameters: volumetric.VolumetricParameters) -> None:
        raise ArithmeticError("made so")

    monkeypatch.setattr(volumetric, "reconstruct", failing)
    assert made(scan(two_levels, OUTLINE, 30.0, 0.03, 1))[1][-1] == "extruded"


def test_noise_is_removed_before_facades_are_looked_for() -> None:
    assert PARAMETERS.walls.noise.remove

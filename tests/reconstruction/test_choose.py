from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.building import Semantic, Status
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.roof_distances import distances_to_roof, summarise
from cityflow.reconstruction import monolithic, orientation_histogram
from cityflow.reconstruction.choose import ReconstructParameters, choose, solid_of_method
from cityflow.reconstruction.measures import measure
from cityflow.reconstruction.orientation_histogram import OrientationHistogramParameters
from cityflow.reconstruction.scores import independent_points
from roof_scenes import OUTLINE, SCENES, gable, scan

DEFAULT = ReconstructParameters()


def test_planes_win_over_the_block() -> None:
    choice = choose(scan(gable, OUTLINE, 8.0, 0.03, 1), DEFAULT)
    assert choice.status is Status.DONE
    assert choice.candidate.method == "orientation_histogram"
    assert [s.method for s in choice.scores] == ["orientation_histogram", "extruded"]
    assert choice.scores[0].penalty < choice.scores[1].penalty


def test_invalid_roofs_climb_down_the_ladder(monkeypatch: pytest.MonkeyPatch) -> None:
    real = orientation_histogram.reconstruct

    def broken_at_full_detail(evidence: Evidence, parameters: OrientationHistogramParameters) -> Candidate:
        candidate = real(evidence, parameters)
        if parameters.max_planes > 8 and candidate.solid is not None:
            open_shell = replace(candidate.solid, faces=candidate.solid.faces[1:])
            return replace(candidate, solid=open_shell)
        return candidate

    monkeypatch.setattr(orientation_histogram, "reconstruct", broken_at_full_detail)
    choice = choose(scan(gable, OUTLINE, 8.0, 0.03, 1), DEFAULT)
    assert [s.valid for s in choice.scores] == [False, False, True, True]
    assert choice.candidate.method == "orientation_histogram"
    assert choice.status is Status.DEGRADED
    assert "no valid solid" in choice.reason


def test_numerical_trouble_ends_in_a_block(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(evidence: Evidence, parameters: OrientationHistogramParameters) -> Candidate:
        raise ZeroDivisionError("of a made-up kind")

    monkeypatch.setattr(orientation_histogram, "reconstruct", failing)
    choice = choose(scan(gable, OUTLINE, 8.0, 0.03, 1), ReconstructParameters(methods=("orientation_histogram",)))
    assert choice.candidate.method == "extruded"
    assert choice.status is Status.DEGRADED
    assert "of a made-up kind" in choice.reason


def test_units_without_points_fail_with_a_reason() -> None:
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 1)
    none = replace(evidence, points=evidence.points.take(np.arange(0)))
    choice = choose(none, DEFAULT)
    assert choice.status is Status.FAILED
    assert "0 roof points" in choice.reason
    assert measure(choice, none)["roof_points"] == 0


def test_measures_of_a_known_gable() -> None:
    evidence = scan(gable, OUTLINE, 8.0, 0.02, 1)
    found = measure(choose(evidence, DEFAULT), evidence)
    area = 12 * 8 / np.cos(np.radians(40))
    eave = 9 - np.tan(np.radians(40)) * 4
    assert found["planes"] == 2
    assert found["roof_type"] == "gable"
    assert found["lod"] == "2.2"
    assert found["roof_area_m2"] == pytest.approx(area, rel=0.01)
    assert found["volume_m3"] == pytest.approx(96 * (9 + eave) / 2, rel=0.01)
    assert found["ridge_height_m"] == pytest.approx(11, abs=0.05)
    assert found["eave_height_m"] == pytest.approx(2 + eave, abs=0.05)
    assert found["nmad"] == pytest.approx(0.02, abs=0.006)
    assert found["share_explained"] == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize(("name", "kind"), [("hip", "hip"), ("two levels", "stepped flat")])
def test_roof_types(name: str, kind: str) -> None:
    evidence = scan(SCENES[name][0], OUTLINE, 8.0, 0.02, 1)
    assert measure(choose(evidence, DEFAULT), evidence)["roof_type"] == kind


def test_few_independent_points_speak_for_few_faces() -> None:
    """A noisy coarse surface, laid out as many points, is no reason for many faces."""
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 1)
    coarse = replace(evidence, alike_m=1.0)
    assert evidence.observations == len(evidence.points)
    assert coarse.observations == pytest.approx(evidence.outline.area)
    fine_score, coarse_score = (choose(e, DEFAULT).scores[0] for e in (evidence, coarse))
    assert fine_score.faces == coarse_score.faces == 2
    assert coarse_score.penalty > fine_score.penalty + 0.01


def test_a_method_without_an_answer_hands_over(monkeypatch: pytest.MonkeyPatch) -> None:
    def unsure(evidence: Evidence, parameters: object) -> Candidate:
        return Candidate("monolithic", None, reason="inconsistent: made so")

    monkeypatch.setattr(monolithic, "reconstruct", unsure)
    choice = choose(scan(gable, OUTLINE, 8.0, 0.03, 1), ReconstructParameters(methods=("monolithic", "extruded")))
    assert [s.method for s in choice.scores] == ["monolithic", "volumetric", "extruded"]
    assert choice.candidate.method == "volumetric"
    assert choice.status is Status.DONE


def test_a_method_alone_makes_what_it_makes_among_others() -> None:
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 1)
    alone = solid_of_method("orientation_histogram", evidence, ReconstructParameters())
    among = choose(evidence, ReconstructParameters()).candidate.solid
    assert alone is not None
    assert among is not None
    assert np.array_equal(alone.vertices, among.vertices)


def test_a_method_alone_that_fails_leaves_the_block(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(evidence: Evidence, parameters: OrientationHistogramParameters) -> Candidate:
        raise np.linalg.LinAlgError("singular")

    monkeypatch.setattr(orientation_histogram, "reconstruct", failing)
    evidence = scan(gable, OUTLINE, 8.0, 0.03, 1)
    solid = solid_of_method("orientation_histogram/1", evidence, ReconstructParameters())
    assert solid is not None
    assert len(solid.of_semantic(Semantic.ROOF)) == 1


@pytest.mark.parametrize("seed", range(3))
def test_errors_that_are_alike_make_few_points_of_many(seed: int) -> None:
    rng = np.random.default_rng(seed)
    xyz = np.column_stack([rng.uniform(0, 30, 9000), rng.uniform(0, 20, 9000), np.zeros(9000)])
    alone = rng.normal(0, 0.15, 9000)
    cell = np.floor(xyz[:, :2] / 1.5).astype(int)
    waves = rng.normal(0, 0.15, (40, 40))[cell[:, 0], cell[:, 1]] + rng.normal(0, 0.05, 9000)
    uneven = 0.3 * waves / 1.5 + rng.normal(0, 0.03, 9000)
    assert independent_points(xyz, alone) > 6000
    assert independent_points(xyz, waves) < 600
    assert independent_points(xyz, uneven) > 4000


def test_structure_that_a_model_lacks_is_no_noise() -> None:
    rng = np.random.default_rng(1)
    xyz = np.column_stack([rng.uniform(0, 30, 9000), rng.uniform(0, 20, 9000), np.zeros(9000)])
    things = rng.random((45, 30))[tuple(np.floor(xyz[:, :2] / 0.67).astype(int).T)] < 0.3
    distance = rng.normal(0, 0.03, 9000) + things * 0.8
    assert independent_points(xyz, distance) > 4000


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("density", [0.5, 1.0, 2.0])
def test_whole_shapes_are_tried_where_points_are_sparse(density: float, seed: int) -> None:
    evidence = scan(SCENES["hip"][0], OUTLINE, density, 0.03, seed)
    choice = choose(evidence, DEFAULT)
    assert {"roof_types", "primitives"} <= {s.method for s in choice.scores}
    assert choice.candidate.solid is not None
    dense = scan(SCENES["hip"][0], OUTLINE, 30.0, 0.0, seed)
    assert summarise(distances_to_roof(choice.candidate.solid, dense.points.xyz)).within_20cm > 0.9
    dense_enough = choose(scan(gable, OUTLINE, 8.0, 0.03, seed), DEFAULT)
    assert {"roof_types", "primitives"}.isdisjoint(s.method for s in dense_enough.scores)


@pytest.mark.parametrize("seed", range(3))
def test_eight_points_on_a_gable_are_no_block(seed: int) -> None:
    choice = choose(scan(gable, OUTLINE, 0.09, 0.03, seed), DEFAULT)
    assert choice.candidate.solid is not None
    assert len(choice.candidate.solid.of_semantic(Semantic.ROOF)) == 2

"""Verdicts of roofs whose truth is known: sound, missed, seen in part, scarce, none."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from shapely import Polygon
from shapely.affinity import scale, translate

from cityflow.core.grid import Grid
from cityflow.core.points import UNCLASSIFIED, PointCloud
from cityflow.core.reconstruction import Candidate, Evidence, HeightRaster
from cityflow.core.verdicts import Verdict, verdict_counts
from cityflow.reconstruction import extruded
from cityflow.reconstruction.extruded import ExtrudedParameters
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.verdicts.figures import Figures
from cityflow.reconstruction.verdicts.fitted_weights import MATCHED, SCANNED
from cityflow.reconstruction.verdicts.judge import attributes_of, judged_model
from cityflow.reconstruction.verdicts.verdict import judgement_of, probability_of
from roof_scenes import OUTLINE, SCENES, scan

PARAMETERS = ModelParameters(with_overhangs=False)
BLOCK = PARAMETERS.model_copy(update={"methods": ("extruded",)})


def verdict_of(evidence: Evidence, parameters: ModelParameters = PARAMETERS) -> Verdict:
    return Verdict(str(attributes_of(judged_model(evidence, parameters))["verdict"]))


@pytest.mark.parametrize("name", ["gable", "hip", "two levels", "parallel slopes"])
def test_a_model_of_a_plain_roof_is_good(name: str) -> None:
    assert verdict_of(scan(SCENES[name][0], OUTLINE, 12.0, 0.02, 1)) is Verdict.GOOD


def test_a_block_in_the_place_of_a_gable_is_poor() -> None:
    judged = judged_model(scan(SCENES["gable"][0], OUTLINE, 8.0, 0.02, 1), BLOCK)
    told = attributes_of(judged)
    assert told["verdict"] == Verdict.POOR
    assert "more than 20 cm away from" in str(told["verdict_reason"])


def test_an_upper_storey_that_is_missed_is_not_good() -> None:
    evidence = scan(SCENES["two levels"][0], OUTLINE, 8.0, 0.02, 1)
    assert verdict_of(evidence, BLOCK) is not Verdict.GOOD


def test_an_outline_out_of_place_is_not_good() -> None:
    evidence = scan(SCENES["hip"][0], OUTLINE, 8.0, 0.02, 1)
    moved = translate(evidence.outline, 2.5, 0.0)
    inside = evidence.points.take(evidence.points.xyz[:, 0] > moved.bounds[0])
    assert verdict_of(replace(evidence, outline=moved, points=inside, around=evidence.points)) is not Verdict.GOOD
    small = scale(evidence.outline, 0.6, 0.6)
    x, y = evidence.points.xyz[:, :2].T
    b = small.bounds
    inside = evidence.points.take((x > b[0]) & (x < b[2]) & (y > b[1]) & (y < b[3]))
    near = evidence.points.take((x > b[0] - 2) & (x < b[2] + 2) & (y > b[1] - 2) & (y < b[3] + 2))
    assert verdict_of(replace(evidence, outline=small, points=inside, around=near)) is not Verdict.GOOD


def test_a_crown_in_the_place_of_a_building_is_not_good() -> None:
    rng = np.random.default_rng(7)
    evidence = scan(lambda x, y: 7 + rng.uniform(0, 2, len(x)), OUTLINE, 8.0, 0.02, 1)
    crown = replace(evidence, points=PointCloud.of(evidence.points.xyz, UNCLASSIFIED))
    assert verdict_of(crown) is not Verdict.GOOD


def test_without_points_there_is_nothing_good() -> None:
    evidence = scan(SCENES["gable"][0], OUTLINE, 8.0, 0.02, 1)
    none = replace(evidence, points=evidence.points.take(np.arange(0)))
    told = attributes_of(judged_model(none, PARAMETERS))
    assert (told["verdict"], told["good_probability"]) == (Verdict.POOR, 0.0)
    assert "0 roof points" in str(told["verdict_reason"])


def test_where_points_are_scarce_all_make_the_model_and_half_of_them_test_others() -> None:
    scarce = scan(SCENES["gable"][0], OUTLINE, 1.5, 0.02, 2)
    judged = judged_model(scarce, PARAMETERS)
    assert judged.figures is not None
    assert 0.3 < judged.figures.held / len(scarce.points) < 0.7
    dense = scan(SCENES["gable"][0], OUTLINE, 8.0, 0.02, 2)
    judged = judged_model(dense, PARAMETERS)
    assert judged.figures is not None
    assert 0.05 < judged.figures.held / len(dense.points) < 0.15


def test_models_that_test_another_have_no_rivals(monkeypatch: pytest.MonkeyPatch) -> None:
    """The block is made once, as the rival of the model that is kept, and not again for those that test it."""
    blocks: list[int] = []
    block = extruded.reconstruct

    def counted(evidence: Evidence, parameters: ExtrudedParameters) -> Candidate:
        blocks.append(len(evidence.points))
        return block(evidence, parameters)

    monkeypatch.setattr(extruded, "reconstruct", counted)
    scarce = scan(SCENES["gable"][0], OUTLINE, 1.5, 0.02, 2)
    judged = judged_model(scarce, PARAMETERS)
    assert judged.choice.candidate.method != "extruded"
    assert judged.held is not None
    assert len(judged.held.others) == PARAMETERS.held_back.tests
    assert blocks == [len(scarce.points)]


def test_the_order_of_points_changes_nothing() -> None:
    evidence = scan(SCENES["hip"][0], OUTLINE, 8.0, 0.03, 3)
    order = np.random.default_rng(0).permutation(len(evidence.points))
    turned = replace(evidence, points=evidence.points.take(order))
    assert attributes_of(judged_model(evidence, PARAMETERS)) == attributes_of(judged_model(turned, PARAMETERS))


BEST = Figures(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.02, 0.05, 0.02, 0, 0, 0.004, 0, 0.1, 0, 0, 0, 0, 400, 40)


@pytest.mark.parametrize("matched", [False, True])
@pytest.mark.parametrize(
    "name", [f.name for f in fields(Figures) if f.name not in ("held", "points", "matched", "worst_side")]
)
def test_no_figure_that_is_worse_makes_a_unit_better(name: str, matched: bool) -> None:
    best = replace(BEST, matched=matched)
    worse = replace(best, **{name: getattr(best, name) + 0.2})
    known = MATCHED if matched else SCANNED
    for model in (known.good, known.fair):
        assert probability_of(worse, model) <= probability_of(best, model)
    assert judgement_of(best).verdict is Verdict.GOOD


@pytest.mark.parametrize("matched", [False, True])
def test_a_roof_that_its_own_points_contradict_is_never_good(matched: bool) -> None:
    """As a slope of a gable was that a method had laid level: 44 % of the roof more than 20 cm away from clean points, all else as of a good unit."""
    against = replace(
        BEST, off=0.44, worst=0.8, loose=0.46, strange=0.48, error_m=0.38, few=0.08, faceted=0.27, matched=matched
    )
    assert judgement_of(against).verdict is not Verdict.GOOD
    assert judgement_of(replace(BEST, matched=matched)).verdict is Verdict.GOOD


def test_few_faces_are_no_reason_and_many_are() -> None:
    spoilt = replace(BEST, matched=True, worst=0.3, slight=0.1)
    assert "many faces" not in judgement_of(replace(spoilt, faceted=0.2)).reason
    assert "many faces" in judgement_of(replace(spoilt, faceted=0.9)).reason


def ground_up_to(outline: Polygon, x_end: float) -> HeightRaster:
    """Terrain around an outline, surveyed as far as a line."""
    x_min, y_min, x_max, y_max = outline.bounds
    grid = Grid.covering((x_min - 3, y_min - 3, x_max + 3, y_max + 3), 0.5)
    dtm = np.where(np.broadcast_to(grid.x_centres() < x_end, grid.shape), 0.0, np.nan)
    return HeightRaster(grid, dtm, dtm)


def test_a_building_at_the_end_of_the_survey_says_so() -> None:
    """Good as far as it was seen, it is not called good; where the survey goes on around it nothing is said."""
    sound = scan(SCENES["hip"][0], OUTLINE, 12.0, 0.02, 1)
    outline = sound.outline
    west, _, east, _ = outline.bounds
    whole = attributes_of(judged_model(replace(sound, heights=ground_up_to(outline, east + 9.0)), PARAMETERS))
    assert (whole["verdict"], whole["verdict_reason"]) == (Verdict.GOOD, "")
    ends = attributes_of(judged_model(replace(sound, heights=ground_up_to(outline, east + 0.2)), PARAMETERS))
    assert ends["verdict"] == Verdict.LOOK
    assert str(ends["verdict_reason"]).startswith("the survey ends here: ")
    cut = replace(
        sound,
        heights=ground_up_to(outline, (west + east) / 2),
        points=sound.points.take(sound.points.xyz[:, 0] < (west + east) / 2),
        around=sound.around.take(sound.around.xyz[:, 0] < (west + east) / 2),
    )
    told = attributes_of(judged_model(cut, PARAMETERS))
    assert told["verdict"] != Verdict.GOOD
    assert str(told["verdict_reason"]).startswith("the survey ends here: ")
    assert "outline and roof differ" not in str(told["verdict_reason"])
    assert "displaced" not in str(told["verdict_reason"])


def test_verdicts_are_counted() -> None:
    assert verdict_counts(["good", "look", "good", "poor", None, ""]) == {"good": 2, "look": 1, "poor": 3}

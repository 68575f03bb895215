"""The verdict of a unit's model from the held-back evidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cityflow.core.building import Scalar, Status
from cityflow.core.reconstruction import Evidence
from cityflow.core.verdicts import PROBABILITY_KEY, REASON_KEY, VERDICT_KEY
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.reconstruction.choose import Choice, solid_of_method
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.reconstruction.shared_ramps import without_ramps
from cityflow.reconstruction.verdicts.figures import Figures, HeldBack, figures_of
from cityflow.reconstruction.verdicts.held_back import FOLDS, groups_of, without_group
from cityflow.reconstruction.verdicts.roof_fit import RoofFit, fit_of
from cityflow.reconstruction.verdicts.survey_edge import survey_end
from cityflow.reconstruction.verdicts.verdict import judgement_of


@dataclass(frozen=True, slots=True)
class Judged:
    """A choice with its points judged: `fit` and `figures` are None where there is no solid; `survey_end` says where the survey ends at the unit."""

    choice: Choice
    fit: RoofFit | None = None
    figures: Figures | None = None
    held: HeldBack | None = None
    survey_end: str = ""


def judged_model(evidence: Evidence, parameters: ModelParameters) -> Judged:
    """The model of a unit, and what points that it was not made from say of it.

    Where a unit has points enough, a part of them is held back and the model made from the others. Where points are scarce each of them matters: the
    model is made from all, and other models, each without a part of the points, test it by that part.
    """
    evidence = without_ramps(evidence)
    how = parameters.held_back
    mine = groups_of(evidence.points.xyz, how.groups) == 0
    enough = int(mine.sum()) >= how.least
    choice = model(without_group(evidence, 0, how.groups) if enough else evidence, parameters)
    solid = choice.candidate.solid
    end = survey_end(evidence.outline, evidence.heights)
    if solid is None or choice.status is Status.FAILED:
        return Judged(choice, survey_end=end)
    fit = fit_of(solid, evidence)
    held = HeldBack(mine, fit.distance) if enough else _crossed(choice, evidence, parameters)
    claim = choice.candidate.notes.get("claimed_rmse_m")
    known = float(claim) if isinstance(claim, int | float) else None
    return Judged(choice, fit, figures_of(solid, evidence, fit, held, known), held, end)


def attributes_of(judged: Judged) -> dict[str, Scalar]:
    """Verdict, its probability and reason, and the figures that it comes from, as attributes of the unit."""
    judgement = judgement_of(judged.figures, judged.choice.reason, judged.survey_end)
    attributes: dict[str, Scalar] = {
        VERDICT_KEY: judgement.verdict.value,
        PROBABILITY_KEY: round(judgement.probability, 3),
        REASON_KEY: judgement.reason,
    }
    f = judged.figures
    if f is None:
        return attributes
    shares = {"held_back_off_share": f.loose, "roof_off_share": f.off, "roof_unseen_share": f.unseen}
    return {**attributes, "held_back_points": f.held, **{name: round(share, 4) for name, share in shares.items()}}


def _crossed(choice: Choice, evidence: Evidence, parameters: ModelParameters) -> HeldBack:
    """Distances of some of the points from models that the method of the choice made without them."""
    how, method = parameters.held_back, choice.scores[choice.kept].method
    group = groups_of(evidence.points.xyz, FOLDS)
    distance, others = np.full(len(group), np.nan), []
    for fold in range(min(how.tests, FOLDS)):
        solid = solid_of_method(method, without_group(evidence, fold, FOLDS), parameters)
        if solid is None:
            continue
        others.append(solid)
        mine = group == fold
        distance[mine] = distances_to_roof(solid, evidence.points.xyz[mine])
    return HeldBack(group < how.tests, distance, tuple(others))

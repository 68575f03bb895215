"""From figures to the probability that a model is right, and to a verdict with its reasons.

A model is good where at least 95 % of its roof are within 20 cm of the truth, and poor where not even 80 % are. Both probabilities are those of logistic
models, in which every figure can only lower them; their weights are fitted on synthetic towns whose truth is known, sound units and spoilt ones,
once for scanners and once for matched surfaces: ``benchmarks/verdicts.py`` makes the cases, fits and judges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace

from cityflow.core.verdicts import Verdict
from cityflow.reconstruction.verdicts.figures import Figures
from cityflow.reconstruction.verdicts.fitted_weights import MATCHED, SCANNED, Calibration, Logistic


@dataclass(frozen=True, slots=True)
class Judgement:
    """What is said of a unit.

    Attributes
    ----------
    probability : that at least 95 % of the roof are within 20 cm of the truth; 0 without a model
    reason : reasons against it, the weightiest first; empty for good ones
    """

    verdict: Verdict
    probability: float
    reason: str = ""


NO_MODEL = "no method gave a model"
MOST_REASONS, LEAST_COST = 3, 0.7
"""So many reasons are told, of those that lower the logit by this much; set by hand."""
USUAL_FACETED = 0.35
"""Median of truly good units of matched surfaces. No roof is without faces: only what goes beyond it is told as a reason."""
LEAST_SOUND = 1e-6
"""A fault is no surer; rounding."""
OF_SURVEY_END = frozenset({"unseen", "missed", "misplaced", "astray", "beside", "holed"})
"""Figures that say no more than that the survey ends, where it does."""


def judgement_of(figures: Figures | None, reason: str = "", survey_end: str = "") -> Judgement:
    """The verdict on a unit; without figures there is no model that points could speak of, `reason` says why.

    Where the survey ends at a unit, as `survey_end` says, it is not good: nobody knows how it goes on. What follows from that is no reason of its own.
    """
    if figures is None:
        return Judgement(Verdict.POOR, 0.0, "; ".join(filter(None, [survey_end, reason or NO_MODEL])))
    known = calibration_of(figures)
    probability = probability_of(figures, known.good)
    if probability >= known.good_from:
        return Judgement(Verdict.LOOK if survey_end else Verdict.GOOD, probability, survey_end)
    is_poor = probability_of(figures, known.fair) < known.poor_below
    told = reasons_of(figures, OF_SURVEY_END if survey_end else frozenset())
    return Judgement(
        Verdict.POOR if is_poor else Verdict.LOOK, probability, "; ".join(filter(None, [survey_end, told]))
    )


def calibration_of(figures: Figures) -> Calibration:
    """Matched surfaces err otherwise than scanners."""
    return MATCHED if figures.matched else SCANNED


def probability_of(figures: Figures, model: Logistic) -> float:
    """Estimated probability that as much of the roof is right as the model asks for."""
    logit = model.base - sum(_costs_of_terms(figures, model).values())
    sound = math.prod(1.0 - getattr(figures, fault) for fault in model.faults)
    return sound / (1.0 + math.exp(-min(max(logit, -50.0), 50.0)))


def costs_of(figures: Figures, model: Logistic) -> dict[str, float]:
    """By how much each figure lowers the logit, or the logarithm of the probability."""
    faults = {fault: -math.log(max(1.0 - getattr(figures, fault), LEAST_SOUND)) for fault in model.faults}
    return {**_costs_of_terms(figures, model), **faults}


def _costs_of_terms(figures: Figures, model: Logistic) -> dict[str, float]:
    costs: dict[str, float] = {}
    for figure, scale, weight in model.terms:
        costs[figure] = costs.get(figure, 0.0) + weight * math.log1p(getattr(figures, figure) / scale)
    return costs


def reasons_of(figures: Figures, without: Collection[str] = ()) -> str:
    """Reasons against a model, as text, the weightiest first; at least one, unless some figures are left out."""
    model = calibration_of(figures).good
    costs = costs_of(figures, model)
    costs["faceted"] = costs.get("faceted", 0.0) - costs_of(replace(figures, faceted=USUAL_FACETED), model).get(
        "faceted", 0.0
    )
    ranked = sorted(WORDS.keys() - without, key=lambda name: (-costs.get(name, 0.0), name))
    told = [name for name in ranked if costs.get(name, 0.0) >= LEAST_COST][:MOST_REASONS]
    return "; ".join(WORDS[name](figures) for name in told or ranked[: not without])


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.01 else f"{100 * share:.1f} %"


WORDS: Mapping[str, Callable[[Figures], str]] = {
    "off": lambda f: f"{_percent(f.off)} of the roof is more than 20 cm away from the points there: a part is missing or has a wrong height",
    "worst": lambda f: f"{_percent(f.worst)} of the points of one roof plane are more than 20 cm away from it",
    "unseen": lambda f: f"{_percent(f.unseen)} of the roof has no points nearby",
    "loose": lambda f: f"{_percent(f.loose)} of the points held back from the fit are more than 20 cm away from the roof",
    "strange": lambda f: f"{_percent(f.strange)} of the points held back from the fit are farther from the roof than three times their noise",
    "unsure": lambda f: f"{_percent(f.unsure)} of the roof changes when a quarter of the points is left out",
    "missed": lambda f: f"roof edges and façades indicate that outline and roof differ on up to {_percent(f.missed)} of the area",
    "misplaced": lambda f: f"roof edges and façades indicate a displaced outline, with a probability of {_percent(f.misplaced)}",
    "astray": lambda f: f.worst_side or f"single sides of the outline do not fit the building, with a probability of {_percent(f.astray)}",
    "elsewhere": lambda f: f"photographs show steps of the roof, or borders to neighbours, elsewhere, with a probability of {_percent(f.elsewhere)}",
    "beside": lambda f: f"the roof continues beyond the outline: {100 * f.beside:.0f} roof points outside for every 100 inside",
    "error_m": lambda f: f"the expected error of the model is {100 * f.error_m:.0f} cm",
    "divided": lambda f: f"the points scatter by {100 * f.noise:.0f} cm, which is much for roof planes of this size",
    "slight": lambda f: f"{_percent(f.slight)} of the roof is on planes so close to a larger one that the noise of the points may have made them",
    "faceted": lambda f: f"the roof has many faces for its size (as one of 100 m² with {10 * f.faceted:.0f}), and one of many is wrong sooner",
    "lacked": lambda f: f"{_percent(f.lacked)} of the roof lies at steps of the surface that the model lacks",
    "holed": lambda f: f"beside {_percent(f.holed)} of the outline the images show neither ground nor façade: the building may continue there",
    "ramped": lambda f: f"{_percent(f.ramped)} of the roof slopes towards a neighbour at another height, as matching often draws it where there is a step",
    "stepped": lambda f: f"{_percent(f.stepped)} of the roof is within 20 cm of a neighbour at another height, where matched surfaces are uncertain",
    "steps": lambda f: f"{_percent(f.steps)} of the roof is closer to a height step than the spacing of the points",
    "shared": lambda f: f"{_percent(f.shared / f.few)} of the outline touches neighbours, and few points show which roof is higher there",
    "few": lambda f: f"a roof plane is supported by only about {round(1 / f.few**2)} points",
}  # fmt: skip

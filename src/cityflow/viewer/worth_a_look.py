"""Which models a person should look at first: those that stand out from the others of the run, not all that a coarse survey makes coarse."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.core.building import Status
from cityflow.viewer.report_parameters import WorthALookParameters
from cityflow.viewer.rows import UnitRow

USUAL = WorthALookParameters()

Value = Callable[[UnitRow], float | None]


@dataclass(frozen=True, slots=True)
class Suspect:
    """A model to look at; `excess`: how far beyond the limit its worst figure is, in units of that limit."""

    unit: UnitRow
    reason: str
    excess: float


@dataclass(frozen=True, slots=True)
class _Measure:
    """A figure of which more is worse: how it is read, what never stands out, and how it is said."""

    value: Value
    least: Callable[[WorthALookParameters], float]
    text: Callable[[float, float], str]


def worth_a_look(units: Sequence[UnitRow], parameters: WorthALookParameters = USUAL) -> list[Suspect]:
    """The worst models by scatter of their points, share unexplained and expected error, the worst first, each with its reason."""
    made = [u for u in units if u.status in (Status.DONE, Status.DEGRADED)]
    found: dict[str, list[Suspect]] = {}
    for measure in MEASURES:
        known = [(u, v) for u in made if (v := measure.value(u)) is not None and math.isfinite(v)]
        if not known:
            continue
        middle, limit = _limit([v for _, v in known], measure.least(parameters), parameters.outlying)
        for unit, value in known:
            if value > limit:
                found.setdefault(unit.id, []).append(Suspect(unit, measure.text(value, middle), value / limit))
    worst = [_joined(suspects) for suspects in found.values()]
    worst.sort(key=lambda s: (-s.excess, s.unit.id))
    return worst[: max(parameters.always, math.floor(parameters.most_share * len(made)))]


def _limit(values: Sequence[float], least: float, outlying: float) -> tuple[float, float]:
    """Median of the run, and the value above which a model stands out."""
    middle = float(np.median(values))
    spread = float(1.4826 * np.median(np.abs(np.asarray(values) - middle)))
    return middle, max(least, middle + outlying * spread)


def _joined(suspects: Sequence[Suspect]) -> Suspect:
    ordered = sorted(suspects, key=lambda s: -s.excess)
    return Suspect(ordered[0].unit, "; ".join(s.reason for s in ordered), ordered[0].excess)


def _claim(unit: UnitRow) -> float | None:
    value = unit.attributes.get("claimed_rmse_m")
    return float(value) if isinstance(value, int | float) else None


def _unexplained(unit: UnitRow) -> float | None:
    return None if unit.share_explained is None else 1 - unit.share_explained


MEASURES = (
    _Measure(
        lambda u: u.nmad,
        lambda p: p.least_error_m,
        lambda v, middle: f"points scatter by {100 * v:.0f} cm about the roof (median of all {100 * middle:.0f} cm)",
    ),
    _Measure(
        _unexplained,
        lambda p: p.least_share,
        lambda v, middle: f"{100 * v:.0f} % of the points are off the roof (median of all {100 * middle:.0f} %)",
    ),
    _Measure(
        _claim,
        lambda p: p.least_error_m,
        lambda v, middle: f"expects an error of {100 * v:.0f} cm (median of all {100 * middle:.0f} cm)",
    ),
)

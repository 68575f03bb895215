"""What a candidate's penalty is made of, and the price of a roof face that all candidates of a unit pay alike."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cityflow.reconstruction.choose import LAST_RESORT, ScoreParameters, least_face_penalty

EQUAL = 1e-9


@dataclass(frozen=True, slots=True)
class ScoreParts:
    """Parts of one penalty; they add up to it.

    Attributes
    ----------
    unexplained, uncovered, distance : points off the roof, points under no roof, scatter
    faces, simpler : price of the roof faces, and of a model simpler than asked for; None where the record cannot tell them apart
    rest : the two together
    """

    unexplained: float
    uncovered: float
    distance: float
    rest: float
    faces: float | None
    simpler: float | None


def score_parts(
    scores: Sequence[Mapping[str, Any]], weights: ScoreParameters, points: int
) -> tuple[float | None, list[ScoreParts | None]]:
    """The price of a face, and the parts of every score; None for a candidate without a penalty.

    The price depends on how many independent observations a unit's points are worth; records keep the penalties only. But it is the same for
    all candidates, and no lower than `points` independent points make it: whether each was fined for being simpler follows from that.

    Parameters
    ----------
    scores : as a record of reconstruction keeps them
    points : roof points of the unit
    """
    known = [None if s.get("penalty") is None else _known(s, weights) for s in scores]
    rest = [None if k is None else float(s["penalty"]) - sum(k) for s, k in zip(scores, known, strict=True)]
    paying = [(s, r) for s, r in zip(scores, rest, strict=True) if r is not None and s["faces"]]
    price = _price(paying, weights, max(weights.face, least_face_penalty(points)))
    return price, [
        None if k is None or r is None else ScoreParts(*k, r, *_told_apart(s, r, price))
        for s, k, r in zip(scores, known, rest, strict=True)
    ]


def _known(score: Mapping[str, Any], weights: ScoreParameters) -> tuple[float, float, float]:
    """What follows from the figures of a score."""
    scatter = score["nmad"] if score["covered"] and score["nmad"] is not None else 1.0
    return (
        weights.unexplained * (1 - score["within_20cm"]),
        weights.uncovered * (1 - score["covered"]),
        weights.distance_per_m * scatter,
    )


def _told_apart(score: Mapping[str, Any], rest: float, price: float | None) -> tuple[float | None, float | None]:
    if price is None:
        return None, None
    faces = price * score["faces"]
    simpler = rest - faces
    return faces, simpler if abs(simpler) > EQUAL else 0.0


def _price(paying: Sequence[tuple[Mapping[str, Any], float]], weights: ScoreParameters, least: float) -> float | None:
    """The one price that fits all scores; None where none does, or several do."""
    if not paying:
        return None
    options = [[(r - n * weights.degraded) / s["faces"] for n in _fines(s)] for s, r in paying]
    fitting = [
        p for p in options[0]
        if p >= least - EQUAL and all(any(math.isclose(p, q, rel_tol=0, abs_tol=EQUAL) for q in o) for o in options)
    ]  # fmt: skip
    return fitting[0] if fitting and max(fitting) - min(fitting) <= EQUAL else None


def _fines(score: Mapping[str, Any]) -> tuple[int, ...]:
    """How often a candidate may have been fined for being simpler than asked for: by its method, and by its rung of the ladder."""
    method, _, rung = str(score["method"]).partition("/")
    if method == LAST_RESORT:
        return (1,)
    return (1, 2) if rung and score["valid"] else (0, 1)

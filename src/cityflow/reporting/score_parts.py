"""Parts of a candidate's penalty."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cityflow.reconstruction.partition.simplification import PLANE_NUMBERS

EQUAL = 1e-9


@dataclass(frozen=True, slots=True)
class ScoreParts:
    """Parts of one penalty; they add up to it.

    Attributes
    ----------
    unexplained, uncovered, distance : points off the roof, points under no roof, scatter
    faces, simpler : price of the roof faces, and of a model simpler than asked for
    """

    unexplained: float
    uncovered: float
    distance: float
    faces: float
    simpler: float


def score_parts(score: Mapping[str, Any]) -> ScoreParts | None:
    """The parts of a score as a record of reconstruction keeps it; None for a candidate without a penalty, or of a record without the price of a face."""
    if score.get("penalty") is None or score.get("face_price") is None:
        return None
    distance = score["nmad"] if score["covered"] and score["nmad"] is not None else 1.0
    unexplained = 1 - score["within_20cm"]
    uncovered = 1 - score["covered"]
    faces = score["face_price"] * score.get("numbers", PLANE_NUMBERS * score["faces"]) / PLANE_NUMBERS
    simpler = score["penalty"] - unexplained - uncovered - distance - faces
    return ScoreParts(unexplained, uncovered, distance, faces, simpler if abs(simpler) > EQUAL else 0.0)

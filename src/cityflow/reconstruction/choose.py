"""Runs the methods that the workflow names and keeps the best candidate, by one yardstick for all.

Validity comes first: a candidate with a fault never wins over one without. Then the distance of the points from the roof, the share of points that
some roof covers, and the number of faces decide. The order of the methods decides between equals.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import Field, field_validator

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Candidate, Evidence, Semantic, Status
from cityflow.core.parameters import Parameters
from cityflow.geometry.roof_heights import roof_heights
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction import extruded, orientation_histogram
from cityflow.reconstruction.extruded import ExtrudedParameters
from cityflow.reconstruction.orientation_histogram import OrientationHistogramParameters

Method = Callable[[Evidence, Any], Candidate]

METHODS: Mapping[str, Method] = {
    "orientation_histogram": orientation_histogram.reconstruct,
    "extruded": extruded.reconstruct,
}


class ChoiceParameters(Parameters):
    """What candidates are compared by; the candidate with the lowest sum wins."""

    distance_cap_m: float = Field(1.0, gt=0, le=20, description="points further off count as so far off, m")
    uncovered_m: float = Field(1.0, ge=0, le=20, description="what a point under no roof costs, as metres of distance")
    face_cost_m: float = Field(0.002, ge=0, le=1, description="what a roof face costs, as metres of mean distance")


class ReconstructParameters(Parameters):
    """Which methods are tried, and how each is set."""

    methods: tuple[str, ...] = Field(
        ("orientation_histogram", "extruded"),
        min_length=1,
        description="names, or module:function of a method of your own",
    )
    orientation_histogram: OrientationHistogramParameters = OrientationHistogramParameters()
    extruded: ExtrudedParameters = ExtrudedParameters()
    choice: ChoiceParameters = ChoiceParameters()

    @field_validator("methods")
    @classmethod
    def _known(cls, methods: tuple[str, ...]) -> tuple[str, ...]:
        unknown = [m for m in methods if m not in METHODS and ":" not in m]
        if unknown:
            raise ValueError(f"no method '{unknown[0]}'; known: {', '.join(METHODS)}, or module:function")
        return methods


@dataclass(frozen=True, slots=True)
class Score:
    """How one candidate did.

    Attributes
    ----------
    faults : codes of broken validity rules; none for a valid solid
    distance : mean vertical distance of the points from the roof, capped, metres
    covered : share of the points over or under a roof face
    roof_faces : number of roof faces
    total : what the choice goes by, metres; lower is better
    """

    method: str
    status: Status
    reason: str
    faults: tuple[int, ...] = ()
    distance: float = float("nan")
    covered: float = 0.0
    roof_faces: int = 0
    total: float = float("inf")


@dataclass(frozen=True, slots=True)
class Choice:
    """The winner with the points' signed vertical distances from it ((N,) metres, NaN where uncovered), and all scores."""

    candidate: Candidate
    residuals: FloatArray
    scores: tuple[Score, ...]
    status: Status
    reason: str


def choose(evidence: Evidence, parameters: ReconstructParameters) -> Choice:
    """The best candidate; its status says whether it is what was asked for, and why not.

    Every method in the list is tried, but the extruded block only where no other gave a valid solid: it is the last resort,
    not a rival.
    """
    tried: list[tuple[Candidate, Score, FloatArray]] = []
    for name in parameters.methods:
        if name == "extruded" and any(not s.faults and c.solid is not None for c, s, _ in tried):
            continue
        candidate = _method(name)(evidence, getattr(parameters, name, None))
        tried.append((candidate, *score(candidate, evidence, parameters.choice)))
    scores = tuple(s for _, s, _ in tried)
    candidate, best, residuals = min(tried, key=lambda t: (t[0].solid is None, bool(t[1].faults), t[1].total))
    if candidate.solid is None or best.faults:
        reason = "; ".join(_why_not(s) for s in scores)
        return Choice(candidate, residuals, scores, Status.FAILED, reason)
    lost = (
        [_why_not(s) for s in scores if s.status is not Status.DONE or s.faults]
        if candidate.status is not Status.DONE
        else []
    )
    return Choice(candidate, residuals, scores, candidate.status, "; ".join(dict.fromkeys(lost)))


def score(candidate: Candidate, evidence: Evidence, parameters: ChoiceParameters) -> tuple[Score, FloatArray]:
    """Validity, distance, coverage, simplicity; and the residuals of the points."""
    xyz = evidence.points.xyz
    if candidate.solid is None:
        return Score(candidate.method, candidate.status, candidate.reason), np.full(len(xyz), np.nan)
    z, _ = roof_heights(candidate.solid, xyz[:, 0], xyz[:, 1])
    residuals = xyz[:, 2] - z
    covered = np.isfinite(residuals)
    off = np.minimum(np.abs(residuals[covered]), parameters.distance_cap_m)
    distance = float(off.mean()) if len(off) else parameters.distance_cap_m
    share = float(covered.mean()) if len(covered) else 0.0
    faces = len(candidate.solid.of_semantic(Semantic.ROOF))
    total = distance + (1 - share) * parameters.uncovered_m + faces * parameters.face_cost_m
    faults = tuple(sorted({f.code for f in check_polyhedron(candidate.solid)}))
    return Score(candidate.method, candidate.status, candidate.reason, faults, distance, share, faces, total), residuals


def _method(name: str) -> Method:
    if name in METHODS:
        return METHODS[name]
    module, _, function = name.partition(":")
    method: Method = getattr(importlib.import_module(module), function)
    return method


def _why_not(score: Score) -> str:
    if score.faults:
        return f"{score.method}: not valid (rules {', '.join(map(str, score.faults))})"
    return f"{score.method}: {score.reason or score.status}"

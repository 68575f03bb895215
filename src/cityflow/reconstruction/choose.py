"""Runs the methods of the workflow, scores every candidate by the same measure and keeps the best.

Validity comes first: an invalid solid never wins over a valid one. A method whose full answer is invalid climbs down a
ladder of simpler roofs before it gives up. Whatever happens is in the scores.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType

import numpy as np
from pydantic import Field, field_validator
from shapely.errors import GEOSException

from cityflow.core.building import Polyhedron, Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction import extruded, monolithic, orientation_histogram, primitives, roof_types, volumetric
from cityflow.reconstruction.extruded import ExtrudedParameters
from cityflow.reconstruction.monolithic import MonolithicParameters
from cityflow.reconstruction.orientation_histogram import OrientationHistogramParameters
from cityflow.reconstruction.primitives import PrimitivesParameters
from cityflow.reconstruction.roof_types_parts.roof_evidence import RoofTypesParameters
from cityflow.reconstruction.scores import Score, ScoreParameters, scored, with_faces
from cityflow.reconstruction.solids.levels import LevelParameters
from cityflow.reconstruction.volumetric import VolumetricParameters

MODULES: Mapping[str, ModuleType] = {
    "orientation_histogram": orientation_histogram,
    "monolithic": monolithic,
    "volumetric": volumetric,
    "roof_types": roof_types,
    "primitives": primitives,
    "extruded": extruded,
}
"""Every method is a module with ``reconstruct``; one that can do with less has ``simpler``, which gives parameters for it."""

DEFAULT_METHODS = ("orientation_histogram", "extruded")
LAST_RESORT = "extruded"
HANDED_TO = {"monolithic": "volumetric", "roof_types": "orientation_histogram"}
"""Where a method finds no valid solid, because it sees itself inconsistent or knows no type, the other is tried in its place."""

BY_TYPE = "roof_types"
"""The method that is asked where a person has set a roof type: it alone can be told one."""

WHOLE_SHAPES = ("roof_types", "primitives")
"""Methods that are asked beside that of planes where points are sparse: whole shapes need fewer points than planes one by one."""


NUMERICAL_TROUBLE = (ArithmeticError, np.linalg.LinAlgError, GEOSException)
"""What the data of a single unit can provoke in a method; it becomes that candidate's reason. Anything else is a bug, and fails the unit."""


class ReconstructParameters(Parameters):
    """Which methods are tried for a unit, their parameters, and how the best is chosen."""

    methods: tuple[str, ...] = Field(
        DEFAULT_METHODS,
        min_length=1,
        description="methods that are tried; of equal results the earlier in this list is kept; module:function is a custom method",
        json_schema_extra={"functions": list(MODULES)},
    )
    orientation_histogram: OrientationHistogramParameters = OrientationHistogramParameters()
    monolithic: MonolithicParameters = MonolithicParameters()
    volumetric: VolumetricParameters = VolumetricParameters()
    roof_types: RoofTypesParameters = RoofTypesParameters()
    primitives: PrimitivesParameters = PrimitivesParameters()
    extruded: ExtrudedParameters = ExtrudedParameters()
    levels: LevelParameters = LevelParameters()
    score: ScoreParameters = ScoreParameters()
    sparse_per_m2: float = Field(
        4.0,
        ge=0,
        le=100,
        description="roof_types and primitives are also tried if a unit has no more roof points per m² than this; 0: never",
    )
    min_points: int = Field(3, ge=1, le=1000, description="units with fewer roof points become a block")
    min_explained: float = Field(
        0.3, ge=0, le=1, description="degraded if a smaller share of the points is within 20 cm"
    )

    @field_validator("methods")
    @classmethod
    def _known(cls, methods: tuple[str, ...]) -> tuple[str, ...]:
        unknown = [m for m in methods if m not in MODULES and ":" not in m]
        if unknown:
            raise ValueError(f"no method '{unknown[0]}'; known: {', '.join(MODULES)}, or module:function")
        return methods


@dataclass(frozen=True, slots=True)
class Choice:
    """The best candidate, how the unit ended, and all scores in the order of trying.

    Attributes
    ----------
    tried : the candidates that the scores are of
    kept : which of them is the best
    """

    candidate: Candidate
    status: Status
    reason: str
    scores: tuple[Score, ...]
    tried: tuple[Candidate, ...] = ()
    kept: int = 0


def choose(evidence: Evidence, parameters: ReconstructParameters) -> Choice:
    """Best candidate of the methods named; a block where none gives a valid solid."""
    tried: list[tuple[Candidate, Score]] = []
    enough = len(evidence.points) >= parameters.min_points
    for method in _methods(evidence, parameters) if enough else ():
        tried.extend(_climb_down(method, evidence, parameters))
        if evidence.wanted_type and method == BY_TYPE and not tried[-1][1].valid:
            # what a person wants cannot be had: what the method finds by itself
            tried.extend(_climb_down(method, replace(evidence, wanted_type=""), parameters))
        other = HANDED_TO.get(method)
        if other and other not in parameters.methods and not tried[-1][1].valid:
            tried.extend(_climb_down(other, evidence, parameters))
    if not any(score.valid for _, score in tried) and not any(score.method == LAST_RESORT for _, score in tried):
        tried.extend(_climb_down(LAST_RESORT, evidence, parameters))
    tried = with_faces(tried, evidence, parameters.score)
    kept = min(range(len(tried)), key=lambda k: _rank(*tried[k], evidence))
    candidate, score = tried[kept]
    scores = tuple(s for _, s in tried)
    return Choice(
        candidate, *_ending(candidate, score, scores, evidence, parameters), scores, tuple(c for c, _ in tried), kept
    )


def solid_of_method(method: str, evidence: Evidence, parameters: ReconstructParameters) -> Polyhedron | None:
    """First valid solid of one method alone, with no rivals and no score; where it has none, of the methods that stand in for it.

    Parameters
    ----------
    method : as in `ReconstructParameters.methods`; a rung of its ladder (``orientation_histogram/2``) stands for the whole ladder
    """
    enough = len(evidence.points) >= parameters.min_points
    first = method.partition("/")[0]
    names = (first, HANDED_TO.get(first, LAST_RESORT), LAST_RESORT) if enough else (LAST_RESORT,)
    for name in dict.fromkeys(names):
        for attempt in _ladder(name, parameters):
            solid = _attempt(name, attempt, evidence).solid
            if solid is not None and not check_polyhedron(solid):
                return solid
    return None


def _methods(evidence: Evidence, parameters: ReconstructParameters) -> tuple[str, ...]:
    """Those of the workflow; where a person has set the roof's type, or points are sparse, the method that knows types, too."""
    methods = parameters.methods
    if BY_TYPE in methods:
        return methods
    if evidence.wanted_type:
        return (BY_TYPE, *methods)
    sparse = len(evidence.points) <= parameters.sparse_per_m2 * evidence.outline.area
    made_by_planes = "orientation_histogram" in methods
    return (*methods, *WHOLE_SHAPES) if sparse and made_by_planes else methods


def _rank(candidate: Candidate, score: Score, evidence: Evidence) -> tuple[bool, bool, float]:
    """Less is better: valid first, then of the roof type that a person has set, then by penalty."""
    return not score.valid, evidence.wanted_type not in ("", candidate.roof_type), score.penalty


def _climb_down(
    method: str, evidence: Evidence, parameters: ReconstructParameters
) -> Iterator[tuple[Candidate, Score]]:
    """Candidates of one method, simpler and simpler, up to the first valid one."""
    for rung, attempt in enumerate(_ladder(method, parameters)):
        name = method if rung == 0 else f"{method}/{rung}"
        candidate = _attempt(method, attempt, evidence)
        score = scored(name, candidate, evidence, parameters.score)
        if rung and score.valid:
            candidate = replace(
                candidate, status=Status.DEGRADED, reason="no valid solid from the full roof: a simpler roof is used"
            )
            score = replace(score, penalty=score.penalty + parameters.score.degraded)
        yield candidate, score
        if score.valid:
            return


def _ladder(method: str, parameters: ReconstructParameters) -> list[Callable[[Evidence], Candidate]]:
    """The method as asked for, then with what its module calls simpler; a foreign method has one rung."""
    if ":" in method:
        module, _, name = method.partition(":")
        return [partial(getattr(importlib.import_module(module), name), parameters=parameters)]
    known, full = MODULES[method], getattr(parameters, method)
    rungs = (full, *known.simpler(full)) if hasattr(known, "simpler") else (full,)
    return [partial(known.reconstruct, parameters=p) for p in rungs]


def _attempt(method: str, attempt: Callable[[Evidence], Candidate], evidence: Evidence) -> Candidate:
    try:
        return attempt(evidence)
    except NUMERICAL_TROUBLE as error:
        return Candidate(method, None, status=Status.FAILED, reason=f"{type(error).__name__}: {error}")


def _ending(
    candidate: Candidate,
    score: Score,
    scores: tuple[Score, ...],
    evidence: Evidence,
    parameters: ReconstructParameters,
) -> tuple[Status, str]:
    """Status and reason of the unit."""
    if candidate.solid is None or not score.valid:
        return Status.FAILED, score.fault or "no method gave a valid solid"
    if len(evidence.points) < parameters.min_points:
        return (
            Status.DEGRADED,
            f"{len(evidence.points)} roof points, {parameters.min_points} are needed: modelled as a block",
        )
    if candidate.status is not Status.DONE:
        faults = "; ".join(f"{s.method}: {s.fault}" for s in scores if s.fault)
        return Status.DEGRADED, f"{candidate.reason} ({faults})" if faults else candidate.reason
    if score.within_20cm < parameters.min_explained:
        return Status.DEGRADED, f"{100 * score.within_20cm:.0f} % of the points lie within 20 cm of the roof"
    return Status.DONE, ""

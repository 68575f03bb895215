"""Score of candidates: validity, distance of the points, coverage, number of faces."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Semantic, Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.roof_distances import distances_to_roof, summarise
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.partition.simplification import PLANE_NUMBERS
from cityflow.reconstruction.planes.plane_labels import OUTLIER
from cityflow.reconstruction.planes.waves import UNEVEN_M, WAVE_M
from cityflow.reconstruction.precision import NO_PART_M

ABOUT_AS_GOOD = 0.2
"""A candidate is about as good as the best where it explains less by no more than this share of the points; set by hand."""


class ScoreParameters(Parameters):
    """What a candidate's penalty is made of, beside the shares of points farther than 20 cm off and under no roof polygon, and NMAD in metres."""

    face: float = Field(
        0.002,
        ge=0,
        le=1,
        description="penalty per roof face; more where few points support it (ln n / 3n for n independent points)",
    )
    degraded: float = Field(0.1, ge=0, le=100, description="penalty of a model that is simpler than requested")


@dataclass(frozen=True, slots=True)
class Score:
    """One candidate's figures.

    Attributes
    ----------
    method : with the rung of the ladder, as ``orientation_histogram/2``, below the first
    valid : closed, oriented, without faults;  fault : the first fault, or why there is no solid
    covered, within_20cm : shares of all roof points;  nmad : metres
    faces : number of roof faces
    numbers : that describe the roof: three for each face, or as many as the method says: whole shapes have fewer
    penalty : less is better; infinite without a solid
    face_price : what three numbers cost, those of a roof face; the same for all candidates of a unit, by the points that support them
    """

    method: str
    valid: bool
    fault: str = ""
    covered: float = 0.0
    within_20cm: float = 0.0
    nmad: float = float("nan")
    faces: int = 0
    numbers: int = 0
    penalty: float = float("inf")
    face_price: float = float("nan")


def scored(name: str, candidate: Candidate, evidence: Evidence, weights: ScoreParameters) -> Score:
    if candidate.solid is None:
        return Score(name, False, candidate.reason)
    faults = check_polyhedron(candidate.solid)
    distances = summarise(distances_to_roof(candidate.solid, evidence.points.xyz))
    faces = len(candidate.solid.of_semantic(Semantic.ROOF))
    penalty = (
        (1 - distances.within_20cm)
        + (1 - distances.covered)
        + (distances.nmad if distances.covered else 1.0)
        + weights.degraded * (candidate.status is not Status.DONE)
    )
    fault = f"{faults[0].code} {faults[0].name} {faults[0].where}".strip() if faults else ""
    numbers = PLANE_NUMBERS * faces if candidate.numbers is None else candidate.numbers
    return Score(
        name, not faults, fault, distances.covered, distances.within_20cm, distances.nmad, faces, numbers, penalty
    )


def with_faces(
    tried: list[tuple[Candidate, Score]], evidence: Evidence, weights: ScoreParameters
) -> list[tuple[Candidate, Score]]:
    """The candidates with what their faces cost: one price for all of them, by what the simplest of the good ones leaves unexplained."""
    good = [(c.solid, s) for c, s in tried if c.solid is not None and math.isfinite(s.nmad)]
    n = evidence.observations
    if good:
        best = max(s.within_20cm for _, s in good)
        simplest, _ = min(
            ((c, s) for c, s in good if s.within_20cm >= best - ABOUT_AS_GOOD), key=lambda pair: pair[1].faces
        )
        n = min(n, independent_points(evidence.points.xyz, distances_to_roof(simplest, evidence.points.xyz)))
    price = max(weights.face, least_face_penalty(n))
    return [(c, replace(s, penalty=s.penalty + price * s.numbers / PLANE_NUMBERS, face_price=price)) for c, s in tried]


def independent_points(xyz: FloatArray, distance: FloatArray) -> float:
    """How many points with independent errors the points are worth, whose distances to a model (metres) are alike among neighbours.

    Medians over squares of `WAVE_M` scatter by the noise over the root of their number, where errors are independent; by as much as they scatter
    more, and more than `UNEVEN_M`, the points are fewer than they seem. What stands on a roof moves no median, and noise is what scatters within
    squares: structure that the model lacks is neither noise nor wave.
    """
    known = np.isfinite(distance) & (np.abs(distance) <= NO_PART_M)
    if known.sum() < 2:
        return float(max(known.sum(), 1))
    middle, count, off = _block_medians(xyz[known], distance[known])
    each = float(np.median(count))
    noise, waves = 1.4826 * float(np.median(off)) * math.sqrt(each / max(each - 1, 1.0)), spread(middle)
    waves = math.sqrt(max(waves**2 - UNEVEN_M**2, 0.0))
    worth = noise**2 / max(waves**2 + noise**2 / each, 1e-12)
    return float(len(middle) * np.clip(worth, 1.0, each))


def _block_medians(xyz: FloatArray, distance: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(B,) median distance and number of points of each square of `WAVE_M`; (N,) how far points are off their square's median."""
    square = np.floor(xyz[:, :2] / WAVE_M).astype(np.int64)
    square -= square.min(axis=0)
    number = square[:, 1] * (int(square[:, 0].max()) + 1) + square[:, 0]
    order = np.lexsort((distance, number))
    number, ordered = number[order], distance[order]
    first = np.flatnonzero(np.r_[True, number[1:] != number[:-1]])
    count = np.diff(np.r_[first, len(ordered)])
    middle = (ordered[first + (count - 1) // 2] + ordered[first + count // 2]) / 2
    return middle, count.astype(np.float64), np.abs(ordered - np.repeat(middle, count))


def spread(values: FloatArray) -> float:
    """Robust standard deviation: the normalised median absolute deviation."""
    return float(1.4826 * np.median(np.abs(values - np.median(values))))


def least_face_penalty(observations: float) -> float:
    """What the three numbers of a plane cost by Schwarz's criterion, as a share of the points: so many on no plane would cost the same.

    >>> round(least_face_penalty(10_000), 4), round(least_face_penalty(80), 3)
    (0.0003, 0.018)
    """
    n = max(observations, math.e)
    return 1.5 * math.log(n) / (OUTLIER * n)

"""Units of flights with models that are spoilt on purpose: what a flight seldom gets wrong must still lower a verdict.

A unit's own points, outline and truth stay as the flight has them; its model is a block, has a few planes only, or is made from the points on one side of a
line. So the figures have the noise of real matching, and models contradict their points as those of a failed method do.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.model import model
from cityflow.reconstruction.verdicts.figures import Figures, HeldBack, figures_of
from cityflow.reconstruction.verdicts.held_back import groups_of
from cityflow.reconstruction.verdicts.roof_fit import fit_of
from verdict_cases import parameters_of_spoil, true_share
from verdict_flights import FlownUnit

HALF = "half of the points"
SPOILS = ("flattened", "few planes", HALF)
KEPT = (0.3, 0.9)
"""Share of the points that a model is made from."""


class Spoilt(NamedTuple):
    """How a model was spoilt, the true share of its roof within 20 cm, and its figures."""

    spoil: str
    true: float
    figures: Figures


def spoilt(unit: FlownUnit) -> Iterator[Spoilt]:
    """One model for each way; none where it gives no solid. The same for the same unit."""
    rng = np.random.default_rng([unit.seed, zlib.crc32(unit.unit.encode())])
    for spoil in SPOILS:
        how = parameters_of_spoil(spoil, rng)
        choice = model(_one_side(unit.evidence, rng) if spoil == HALF else unit.evidence, how)
        solid, claim = choice.candidate.solid, choice.candidate.notes.get("claimed_rmse_m")
        if solid is None:
            continue
        fit = fit_of(solid, unit.evidence)
        held = HeldBack(groups_of(unit.evidence.points.xyz, how.held_back.groups) == 0, fit.distance)
        known = float(claim) if isinstance(claim, int | float) else None
        figures = figures_of(solid, unit.evidence, fit, held, known)
        yield Spoilt(spoil, true_share(solid, unit.places, unit.evidence.outline), figures)


def _one_side(evidence: Evidence, rng: np.random.Generator) -> Evidence:
    """The evidence with the points on one side of a line."""
    angle = rng.uniform(0, 2 * np.pi)
    along = evidence.points.xyz[:, :2] @ (np.cos(angle), np.sin(angle))
    kept = along <= np.quantile(along, rng.uniform(*KEPT)) if len(along) else np.zeros(0, bool)
    points = evidence.points.take(kept)
    return replace(evidence, points=points, around=points)

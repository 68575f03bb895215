"""The model of one unit: the best candidate of the methods, with its overhangs and its precision."""

from __future__ import annotations

from dataclasses import replace

from pydantic import Field

from cityflow.core.building import Status
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.reconstruction.choose import LAST_RESORT, NUMERICAL_TROUBLE, Choice, ReconstructParameters, choose
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.overhang_solid import with_overhangs
from cityflow.reconstruction.overhangs.rim_search import find_overhangs
from cityflow.reconstruction.overhangs.step_eaves import with_step_eaves, with_step_walls
from cityflow.reconstruction.precision import with_precision
from cityflow.reconstruction.seen_steps.with_seen_steps import SeenStepParameters, with_seen_steps
from cityflow.reconstruction.solids.levels import BlockLevels, LevelParameters
from cityflow.reconstruction.verdicts.held_back import HeldBackParameters
from cityflow.reconstruction.voids.dormer_installations import find_dormers
from cityflow.reconstruction.voids.with_voids import VoidParameters, with_voids


class ModelParameters(ReconstructParameters):
    """Methods and their choice, steps in photographs, overhangs, points held back."""

    seen_steps: SeenStepParameters = SeenStepParameters()
    with_overhangs: bool = Field(True, description="roofs are extended to their overhangs as the surface shows them")
    overhangs: OverhangParameters = OverhangParameters()
    voids: VoidParameters = VoidParameters()
    held_back: HeldBackParameters = HeldBackParameters()
    max_unseen: float = Field(0.3, ge=0, le=1, description="degraded if a larger share of the roof area has no points")

    def of_outlines(self, sigma_m: float) -> ModelParameters:
        """The same for outlines that are so exact (standard deviation, metres)."""
        return self.model_copy(update={"overhangs": self.overhangs.model_copy(update={"outline_sigma_m": sigma_m})})


def model(evidence: Evidence, parameters: ModelParameters) -> Choice:
    """The choice whose candidate is finished; the candidates that were tried stay as they were scored."""
    choice = choose(evidence, parameters)
    best = _with_steps(_with_blocks(choice.candidate, parameters.levels), evidence, parameters.seen_steps)
    best = with_precision(best, evidence)
    if parameters.with_overhangs and best.method != LAST_RESORT:
        best = _with_eaves(best, evidence, parameters.overhangs)
    if best.method != LAST_RESORT:
        best = _with_voids(best, evidence, parameters.voids)
        best = _with_dormers(best, evidence)
    unseen = best.notes.get("unseen_share")
    if choice.status is Status.DONE and isinstance(unseen, float) and unseen > parameters.max_unseen:
        reason = f"{100 * unseen:.0f} % of the roof has no points: the planes around are extended over it"
        return replace(choice, candidate=best, status=Status.DEGRADED, reason=reason)
    return replace(choice, candidate=best)


def _with_blocks(best: Candidate, parameters: LevelParameters) -> Candidate:
    """The candidate with its lower levels of detail made; without, and with the reason, where that comes to nothing."""
    try:
        made = best.blocks.by(parameters) if isinstance(best.blocks, BlockLevels) else best.blocks
        return replace(best, blocks=dict(made))
    except NUMERICAL_TROUBLE as error:
        return replace(best, blocks={}, notes={**best.notes, "blocks_reason": f"{type(error).__name__}: {error}"})


def _with_steps(best: Candidate, evidence: Evidence, parameters: SeenStepParameters) -> Candidate:
    """The candidate with its steps where photographs show them; as it is, and with the reason, where that comes to nothing."""
    try:
        return with_seen_steps(best, evidence, parameters)
    except NUMERICAL_TROUBLE as error:
        return replace(best, notes={**best.notes, "step_reason": f"{type(error).__name__}: {error}"})


def _with_eaves(best: Candidate, evidence: Evidence, parameters: OverhangParameters) -> Candidate:
    """The candidate with what of its roof lies beyond the walls; without, and with the reason, where that comes to nothing."""
    try:
        best = with_step_walls(best, evidence, parameters)
        found = find_overhangs(evidence, best, parameters)
        extended = with_step_eaves(with_overhangs(best, found, evidence, parameters), best.solid, evidence, parameters)
    except NUMERICAL_TROUBLE as error:
        return replace(best, notes={**best.notes, "overhang_reason": f"{type(error).__name__}: {error}"})
    return replace(extended, solid=best.solid)


def _with_voids(best: Candidate, evidence: Evidence, parameters: VoidParameters) -> Candidate:
    """The candidate with the voids and bodies that points show; without, and with the reason, where that comes to nothing."""
    try:
        return with_voids(best, evidence, parameters)
    except NUMERICAL_TROUBLE as error:
        return replace(best, notes={**best.notes, "void_reason": f"{type(error).__name__}: {error}"})


def _with_dormers(best: Candidate, evidence: Evidence) -> Candidate:
    """The candidate with the dormers of its solid as installations."""
    found = () if best.solid is None else find_dormers(best.solid, evidence.points)
    if not found:
        return best
    return replace(best, installations=(*best.installations, *found), notes={**best.notes, "dormers": len(found)})

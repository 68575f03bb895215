"""The model of one unit: the best candidate of the methods, with its overhangs, and what it knows of its own precision."""

from __future__ import annotations

from dataclasses import replace

from cityflow.core.reconstruction import Evidence
from cityflow.reconstruction.choose import Choice, ReconstructParameters, choose
from cityflow.reconstruction.precision import PrecisionParameters, with_precision


class ModelParameters(ReconstructParameters):
    """Methods and their choice, overhangs, precision."""

    precision: PrecisionParameters = PrecisionParameters()


def model(evidence: Evidence, parameters: ModelParameters) -> Choice:
    """The choice whose candidate is finished; the candidates that were tried stay as they were scored."""
    choice = choose(evidence, parameters)
    return replace(choice, candidate=with_precision(choice.candidate, evidence, parameters.precision))

"""How poses are refined, by ``cityflow orient`` and before a city."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from cityflow.adjustment.bundle import AdjustmentParameters
from cityflow.adjustment.coarse_registration import RegistrationParameters
from cityflow.adjustment.descriptor_matching import MatchingParameters
from cityflow.adjustment.features import FeatureParameters
from cityflow.core.parameters import Parameters
from cityflow.orientation.tie_pairs import PairParameters


class TieParameters(Parameters):
    """How matches of pairs are found."""

    matching: MatchingParameters = MatchingParameters()
    bound_px: float = Field(
        12.0,
        gt=0.5,
        le=500,
        description="largest distance of a match from the place that the given poses predict, pixels",
    )


class OrientParameters(TieParameters):
    """How poses are refined."""

    features: FeatureParameters = FeatureParameters()
    pairs: PairParameters = PairParameters()
    adjustment: AdjustmentParameters = AdjustmentParameters()


class OntoParameters(OrientParameters):
    """The same, and how far images may be off a survey that they are registered to."""

    registration: RegistrationParameters = RegistrationParameters()


class RefineParameters(OrientParameters):
    """Whether the poses that a catalog gives are refined before its images are matched, and how."""

    refine: Literal["auto", "always", "never"] = Field(
        "auto",
        description="adjust given poses before matching: where a sample shows that they contradict each other, always, or never; "
        "tie points that are kept out decide whether the adjusted poses are taken",
    )

"""Parameters of occlusion."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters

OWN_M = 1.0
"""So far around a unit the surface is taken for its own blurred walls and eaves, metres; set by hand."""


class VisibilityParameters(Parameters):
    """How surface and models together hide faces."""

    rise_m: float = Field(
        0.7, ge=0.1, le=10, description="what rises this much above the models there is something else, and hides them; metres"
    )  # fmt: skip
    mounted_m: float = Field(
        2.5, ge=0, le=20,
        description="what rises less above the unit's own roof, well inside its plan, is part of it and hides nothing, as chimneys are; metres",
    )  # fmt: skip
    margin_m: float = Field(
        0.15, ge=0, le=2, description="what hides is widened by this, at least by a cell of the surface; metres, 0 widens nothing"
    )  # fmt: skip
    dip_m: float = Field(
        0.05, ge=0, le=1, description="rays may run this deep below the surface; its noise hides nothing then; metres"
    )  # fmt: skip

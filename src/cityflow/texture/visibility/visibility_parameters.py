"""Parameters of occlusion."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters

OWN_M = 1.0
"""So far around a unit the surface is taken for its own blurred walls and eaves, metres; set by hand."""


class VisibilityParameters(Parameters):
    """How surface and models together hide faces."""

    rise_m: float = Field(
        0.7, ge=0.1, le=10, description="objects of the surface that rise this much above the models hide faces, metres"
    )  # fmt: skip
    mounted_m: float = Field(
        2.5, ge=0, le=20,
        description="objects on the unit's own roof that rise less, such as chimneys, hide nothing, metres",
    )  # fmt: skip
    margin_m: float = Field(
        0.15, ge=0, le=2, description="hiding objects are widened by this, at least by a cell of the surface, metres; 0: not widened"
    )  # fmt: skip
    dip_m: float = Field(
        0.05, ge=0, le=1, description="rays may run this deep below the surface, so that its noise hides nothing, metres"
    )  # fmt: skip

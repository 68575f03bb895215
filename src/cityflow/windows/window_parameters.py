"""Parameters of windows."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from cityflow.core.parameters import Parameters


class WindowParameters(Parameters):
    """What counts as a window, and the confidence that is required."""

    when: Literal["auto", "never"] = Field(
        "auto", description="auto: if photographs show the unit; an ortho shows no walls"
    )
    least_m: float = Field(0.4, ge=0.2, le=2, description="shortest side of a window, m")
    most_m: float = Field(4.0, ge=1, le=10, description="longest side of a window, m")
    most_aspect: float = Field(4.0, ge=1, le=20, description="largest ratio of long to short side of a window")
    coarsest_m: float = Field(
        0.2, gt=0, le=1, description="largest pixel of a texture in which windows are searched, m"
    )
    finest_m: float = Field(0.04, gt=0, le=0.5, description="finer textures are resampled to cells of this size, m")
    bars_m: float = Field(0.13, ge=0, le=0.5, description="bars up to this width do not divide a window, m")
    least_contrast: float = Field(
        0.05,
        gt=0,
        le=1,
        description="difference across the edges of a window, as a share of white, brightness as its square root",
    )
    edge_sigmas: float = Field(
        2.5, gt=0, le=10, description="difference across an edge pixel by the scatter of the wall beside it"
    )
    least_confidence: float = Field(0.5, ge=0, le=1, description="least confidence of a window")

"""Parameters of the stage ``atlas``."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from cityflow.core.parameters import Parameters
from cityflow.texture.placement.place import PlacementParameters


class AtlasParameters(Parameters):
    """How patches stand on pages."""

    leaves: Literal[1, 2, 4, 8, 16, 32] = Field(
        4, description="leaves along the edge of a ground tile; each has pages of its own"
    )
    placement: PlacementParameters = PlacementParameters()
    form: Literal["jpeg", "png"] = Field("jpeg", description="of pages; png keeps every pixel of the images as it is")
    quality: int = Field(92, ge=50, le=100, description="of JPEG")

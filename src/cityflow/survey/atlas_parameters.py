"""Parameters of the stage ``atlas``."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from cityflow.core.parameters import Parameters
from cityflow.texture.placement.place import PlacementParameters


class AtlasParameters(Parameters):
    """How patches stand on pages."""

    cell_m: float = Field(
        64.0,
        ge=10,
        le=5000,
        description="edge of an atlas cell, about: a ground tile has a power of two of them along its edge, m",
    )
    placement: PlacementParameters = PlacementParameters()
    form: Literal["jpeg", "png"] = Field(
        "jpeg", description="format of pages; png keeps every pixel of the images as it is"
    )
    quality: int = Field(92, ge=50, le=100, description="quality of JPEG")
    full_colour: bool = Field(
        False, description="JPEG with as many values of colour as of brightness (4:4:4): finer colours, larger files"
    )

    def atlas_cells(self, tile_m: float) -> int:
        """Atlas cells along the edge of a ground tile.

        >>> AtlasParameters().atlas_cells(250.0), AtlasParameters().atlas_cells(60.0)
        (4, 1)
        """
        return 1 << max(round(math.log2(tile_m / self.cell_m)), 0)

"""How building regions become outlines: parameters."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters
from cityflow.outlines.from_heights.regions import RegionParameters
from cityflow.outlines.from_walls.wall_lines import WallLineParameters
from cityflow.outlines.joined.combine import CombineParameters


class FindParameters(Parameters):
    """How building regions become outlines."""

    regions: RegionParameters = Field(default_factory=RegionParameters, description="what is a building region")
    halo_m: float = Field(
        100.0,
        ge=0,
        le=1000,
        description="surface that is read around a tile, m; where a region is wider, `reach_m` is read",
    )
    reach_m: float = Field(
        200.0,
        ge=0,
        le=1000,
        description="widest region that stays whole, m; what is wider is cut at the edges of tiles",
    )

    @property
    def widest_m(self) -> float:
        """Surface that a tile may need around it."""
        return max(self.halo_m, self.reach_m)

    shortest_edge_m: float = Field(1.2, ge=0.2, le=10, description="shorter edges are generalised away, m")
    spot_m: float = Field(
        0.12, ge=0, le=2, description="how far a roof is seen beyond its edge (size of the laser's spot, noise), m"
    )
    combine: CombineParameters = Field(
        default_factory=CombineParameters, description="combination of walls and the roof above them into one footprint"
    )
    walls: WallLineParameters = Field(default_factory=WallLineParameters, description="detection of walls in plan")
    eaves_m: float = Field(0.0, ge=0, le=3, description="how far roofs reach beyond the outlines wanted, m")

"""Parameters of the search for roof rims and of roofs that stand out."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.building import EAVE_SPREAD_M, OUTLINE_SIGMA_M
from cityflow.core.parameters import Parameters


class OverhangParameters(Parameters):
    """How far from a wall the rim of its roof is looked for, when it counts, and what the roof there looks like."""

    most_reach_m: float = Field(1.6, gt=0, le=5, description="largest overhang (m)")
    least_reach_m: float = Field(0.08, ge=0, le=1, description="smallest overhang (m)")
    significance: float = Field(
        2.0, ge=0, le=10, description="an overhang counts if it is more than so many of its standard deviations"
    )
    alone_significance: float = Field(
        3.0,
        ge=0,
        le=10,
        description="an overhang that only heights show, not colours, counts if it is more than so many of its standard deviations",
    )
    each_significance: float = Field(
        1.5, ge=0, le=10, description="if both show it, each alone must reach so many standard deviations"
    )
    slab_m: float = Field(0.16, gt=0, le=1, description="vertical thickness of a roof beyond its walls (m)")
    smoothing_cells: float = Field(
        1.0, ge=0.3, le=5, description="Gaussian that the surface is smoothed with before it is differentiated, cells"
    )
    least_drop_m: float = Field(0.7, gt=0, le=10, description="the surface falls at least so far beyond a rim (m)")
    on_roof_m: float = Field(0.35, gt=0, le=5, description="a surface this near to the roof's plane is the roof (m)")
    widened_cells: float = Field(
        0.0,
        ge=-2,
        le=4,
        description="mean error of a rim in the surface, outwards, cells: matching widens high objects",
    )
    widened_sigma_cells: float = Field(
        0.8, ge=0, le=4, description="standard deviation of this error from edge to edge, cells"
    )
    picture_sigma_cells: float = Field(
        0.7, gt=0, le=10, description="standard deviation of a rim in a true ortho, cells of the ortho"
    )
    picture_window_cells: float = Field(
        3.5,
        ge=0,
        le=20,
        description="colours are searched so far outside the rim of the heights, cells of these; 0: no colours",
    )
    picture_inside_cells: float = Field(
        5.0,
        ge=0,
        le=20,
        description="colours are searched so far inside the rim of the heights, cells of these: matching extends bright roofs over shadow",
    )
    coarsest_cell_m: float = Field(
        0.3, gt=0, le=5, description="coarser cells do not show rims; then points are used (m)"
    )
    point_sigma_m: float = Field(
        0.06, ge=0, le=1, description="standard deviation of LiDAR points in plan, footprint included (m)"
    )
    point_on_roof_m: float = Field(
        0.2, gt=0, le=2, description="LiDAR points this near to the roof's plane are on it (m)"
    )
    patch_cells: float = Field(12.0, gt=0, le=100, description="so many cells along an edge have a common error")
    wall_sigma_m: float = Field(0.03, ge=0, le=2, description="least standard deviation of a façade's line (m)")
    outline_sigma_m: float | None = Field(
        None,
        ge=0,
        le=2,
        description="standard deviation of outlines of unknown accuracy (m), before their own edges are used; "
        "null: from the survey's façades, 0.1 without any",
    )
    outline_weight: float = Field(2.0, gt=0, le=100, description="outline_sigma_m counts as so many edges of the unit")
    roof_edge_off_m: float = Field(
        0.08, ge=0, le=2, description="a façade farther from an outline along the roof's edge is the wall instead (m)"
    )
    wall_edge_off_m: float = Field(
        0.2,
        ge=0,
        le=2,
        description="a façade farther from an outline that was found along walls is the wall instead (m)",
    )
    given_edge_off_m: float = Field(
        0.6,
        ge=0,
        le=2,
        description="a façade farther from a given outline, or one of unknown source, is the wall instead (m)",
    )
    eave_spread_m: float = Field(
        EAVE_SPREAD_M,
        gt=0,
        le=5,
        description="spread of the eaves of one building (standard deviation, m)",
    )
    least_seen: float = Field(0.45, ge=0, le=1, description="least share of an edge along which its rim is seen")

    @property
    def general_sigma_m(self) -> float:
        """`outline_sigma_m`, or a general value if unknown."""
        return OUTLINE_SIGMA_M if self.outline_sigma_m is None else self.outline_sigma_m

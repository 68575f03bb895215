"""Parameters of the search for roof rims and of roofs that stand out."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.building import EAVE_SPREAD_M, OUTLINE_SIGMA_M
from cityflow.core.parameters import Parameters


class OverhangParameters(Parameters):
    """How far from a wall the rim of its roof is looked for, when it counts, and what the roof there looks like."""

    most_reach_m: float = Field(1.6, gt=0, le=5, description="a roof stands out no farther than this (m)")
    least_reach_m: float = Field(0.08, ge=0, le=1, description="a roof that stands out less ends with its wall (m)")
    significance: float = Field(
        2.0, ge=0, le=10, description="an overhang is more than so many of its standard deviations"
    )
    alone_significance: float = Field(
        3.0, ge=0, le=10, description="the same where heights alone show it, and no colours do"
    )
    each_significance: float = Field(
        1.5, ge=0, le=10, description="where both do, each by itself stands out by so many standard deviations"
    )
    slab_m: float = Field(0.16, gt=0, le=1, description="thickness of a roof beyond its walls, upright (m)")
    smoothing_cells: float = Field(
        1.0, ge=0.3, le=5, description="Gaussian that the surface is smoothed with before it is differentiated, cells"
    )
    least_drop_m: float = Field(0.7, gt=0, le=10, description="the surface falls at least so far beyond a rim (m)")
    on_roof_m: float = Field(0.35, gt=0, le=5, description="a surface this near to the roof's plane is the roof (m)")
    widened_cells: float = Field(
        0.0,
        ge=-2,
        le=4,
        description="so much too far out the surface shows a rim, in the mean, cells: matching widens what is high",
    )
    widened_sigma_cells: float = Field(
        0.8, ge=0, le=4, description="standard deviation of that from edge to edge, cells"
    )
    picture_sigma_cells: float = Field(
        0.7, gt=0, le=10, description="standard deviation of a rim in a true ortho, cells of the ortho"
    )
    picture_window_cells: float = Field(
        3.5,
        ge=0,
        le=20,
        description="so far outside the rim of the heights colours are asked, cells of these; 0: not at all",
    )
    picture_inside_cells: float = Field(
        5.0, ge=0, le=20, description="and so far inside it: matching draws bright roofs out over shadow, cells"
    )
    coarsest_cell_m: float = Field(
        0.3, gt=0, le=5, description="a surface on coarser cells shows no rims; points have to tell (m)"
    )
    point_sigma_m: float = Field(
        0.06, ge=0, le=1, description="standard deviation of LiDAR points in plan, footprint included (m)"
    )
    point_on_roof_m: float = Field(
        0.2, gt=0, le=2, description="LiDAR points this near to the roof's plane are on it (m)"
    )
    patch_cells: float = Field(12.0, gt=0, le=100, description="along an edge so many cells have one error in common")
    wall_sigma_m: float = Field(
        0.03, ge=0, le=2, description="a façade's line is known no better than this (standard deviation, m)"
    )
    outline_sigma_m: float | None = Field(
        None,
        ge=0,
        le=2,
        description="an outline of which nothing is said stands so far from its walls (standard deviation, m), before its own edges tell; "
        "null: as the survey's façades show, 0.1 where none do",
    )
    outline_weight: float = Field(
        2.0, gt=0, le=100, description="what is known of outlines in general counts as so many edges of the unit"
    )
    roof_edge_off_m: float = Field(
        0.08, ge=0, le=2, description="an outline along the roof's edge is not the wall where façades are farther (m)"
    )
    wall_edge_off_m: float = Field(
        0.2, ge=0, le=2, description="the same for an outline that was found along walls (m)"
    )
    given_edge_off_m: float = Field(
        0.6, ge=0, le=2, description="the same for an outline of which nothing is said, or that was given (m)"
    )
    eave_spread_m: float = Field(
        EAVE_SPREAD_M,
        gt=0,
        le=5,
        description="how much eaves of one building differ from each other (standard deviation, m)",
    )
    least_seen: float = Field(0.45, ge=0, le=1, description="share of an edge along which its rim has to be seen")

    @property
    def general_sigma_m(self) -> float:
        """`outline_sigma_m`, or a general value if unknown."""
        return OUTLINE_SIGMA_M if self.outline_sigma_m is None else self.outline_sigma_m

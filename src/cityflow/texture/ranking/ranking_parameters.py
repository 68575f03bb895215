"""Common parameters of rankings."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters


class RankingParameters(Parameters):
    """Which images count at all, and what matters of them."""

    most_incidence_deg: float = Field(
        80.0, ge=10, le=89.9, description="images with a larger angle of incidence at a face are ranked last"
    )  # fmt: skip
    last_resort_deg: float = Field(
        86.0, ge=10, le=89.9, description="images with a larger angle of incidence at a face are not used"
    )  # fmt: skip
    visible_weight: float = Field(
        1.0,
        ge=0,
        le=100,
        description="weight of the share that is seen of all that any image sees (method share_angle_gsd)",
    )
    angle_weight: float = Field(
        1.0, ge=0, le=100, description="weight of the cosine of the angle of incidence (method share_angle_gsd)"
    )
    resolution_weight: float = Field(
        1.0,
        ge=0,
        le=100,
        description="weight of the finest sampling distance over that of the image (method share_angle_gsd)",
    )

    @property
    def steepest_deg(self) -> float:
        """Images that look at a face at more than this are left out."""
        return max(self.most_incidence_deg, self.last_resort_deg)

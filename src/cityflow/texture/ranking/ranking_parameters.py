"""What rankings share."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters


class RankingParameters(Parameters):
    """Which images count at all, and what matters of them."""

    most_incidence_deg: float = Field(
        80.0, ge=10, le=89.9, description="images that look at a face at more than this from its normal show nothing but smears of it"
    )  # fmt: skip
    visible_weight: float = Field(
        1.0, ge=0, le=100, description="weight of the share that is seen of all that any image sees (method gross)"
    )
    angle_weight: float = Field(
        1.0, ge=0, le=100, description="weight of the cosine of the angle of incidence (method gross)"
    )
    resolution_weight: float = Field(
        1.0, ge=0, le=100, description="weight of the finest sampling distance over that of the image (method gross)"
    )

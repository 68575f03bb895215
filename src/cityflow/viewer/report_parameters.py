"""Parameters of the report; none of them changes a product."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters


class UnitPageParameters(Parameters):
    """How many buildings get a page of their own, of about 100 kB each."""

    failed: int = Field(500, ge=0, le=100000, description="pages of failed buildings, the largest outlines first")
    refused: int = Field(24, ge=0, le=100000, description="pages of refused outlines, the largest first")
    degraded: int = Field(24, ge=0, le=100000, description="pages of simplified buildings, the largest outlines first")
    listed: int = Field(
        24,
        ge=0,
        le=100000,
        description="pages of buildings in the review list, the worst first, then of the furthest from their points and the slowest",
    )


class ReportParameters(Parameters):
    """What the report shows."""

    pages: UnitPageParameters = UnitPageParameters()
    looks: int = Field(
        40,
        ge=0,
        le=100000,
        description="buildings in the review list, the worst first; the table of all has the rest",
    )
    listed: int = Field(10, ge=0, le=1000, description="buildings in the lists of the worst and of the slowest")
    models: int = Field(
        600,
        ge=1,
        le=100000,
        description="largest number of models in the picture of the whole city; of more, those around the densest place",
    )
    rows: int = Field(
        100_000,
        ge=0,
        description="buildings up to which each has a row in the report; of more only the worst, the slowest and those that did not end as requested",
    )
    across_m: float = Field(130.0, ge=20, le=2000, description="ground across the views from four sides, m")

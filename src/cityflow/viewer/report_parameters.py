"""What of the report can be chosen; nothing here changes a product."""

from __future__ import annotations

from pydantic import Field

from cityflow.core.parameters import Parameters


class UnitPageParameters(Parameters):
    """How many buildings get a page of their own, of about 100 kB each."""

    failed: int = Field(500, ge=0, le=100000, description="pages of failed buildings, the largest outlines first")
    refused: int = Field(24, ge=0, le=100000, description="pages of refused outlines, the largest first")
    degraded: int = Field(24, ge=0, le=100000, description="pages of simplified buildings, the largest outlines first")
    listed: int = Field(
        12, ge=0, le=100000, description="pages of buildings worth a look, worst or slowest, though they did not fail"
    )


class WorthALookParameters(Parameters):
    """Which models stand out from the others of their run."""

    least_error_m: float = Field(
        0.2, ge=0, le=10, description="a model whose points scatter by less, and that expects less of an error, never stands out, m"
    )  # fmt: skip
    least_share: float = Field(
        0.2, ge=0, le=1, description="nor does one that leaves no more than this share of its points off its roof"
    )
    outlying: float = Field(
        3.0, ge=0, le=100, description="robust standard deviations above the median of the run from which a model stands out"
    )  # fmt: skip
    most_share: float = Field(0.05, ge=0, le=1, description="no more than this share of the models is listed")
    always: int = Field(5, ge=0, le=100000, description="though so many are, if so many stand out")


class ReportParameters(Parameters):
    """What the report shows."""

    pages: UnitPageParameters = UnitPageParameters()
    worth_a_look: WorthALookParameters = WorthALookParameters()
    listed: int = Field(10, ge=0, le=1000, description="buildings in the lists of the worst and of the slowest")
    models: int = Field(
        600, ge=1, le=100000, description="models in the picture of the whole; of more, those around the densest spot"
    )
    across_m: float = Field(130.0, ge=20, le=2000, description="ground across the views from four sides, m")

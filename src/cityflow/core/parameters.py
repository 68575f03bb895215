"""The one base of all parameter models: frozen, and strict about unknown keys."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Parameters(BaseModel):
    """Parameters of one algorithm; every field has a default, bounds, and its unit in name or description.

    Unknown keys are refused; the workflow reader names the nearest known one.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

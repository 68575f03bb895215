"""The ways to find the terrain, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from pydantic import Field

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface import dtm_classified, dtm_essential_points, dtm_windows

Method = Literal["classified", "essential_points", "windows"]

BEST_WITHOUT_CLASSES: Method = "windows"
"""The most accurate one against known terrain (docs/surface.md)."""

METHODS: dict[Method, Callable[[PointCloud, FloatArray, Grid, Any], FloatArray]] = {
    "classified": dtm_classified.estimate_dtm,
    "essential_points": dtm_essential_points.estimate_dtm,
    "windows": dtm_windows.estimate_dtm,
}


class DtmParameters(Parameters):
    """Which method finds the terrain, and each method's own parameters."""

    method: Literal["auto", Method] = Field(
        "auto", description="auto: classified where the cloud has ground points, else the best of the others"
    )
    classified: dtm_classified.ClassifiedParameters = dtm_classified.ClassifiedParameters()
    essential_points: dtm_essential_points.EssentialPointsParameters = dtm_essential_points.EssentialPointsParameters()
    windows: dtm_windows.WindowsParameters = dtm_windows.WindowsParameters()

    @property
    def halo_m(self) -> float:
        """Halo of the method chosen; of both that may be chosen where that is left open."""
        if self.method == "auto":
            return float(max(self.classified.halo_m, getattr(self, BEST_WITHOUT_CLASSES).halo_m))
        return float(getattr(self, self.method).halo_m)


def chosen_method(points: PointCloud, parameters: DtmParameters) -> Method:
    """The method that runs for this cloud."""
    if parameters.method != "auto":
        return parameters.method
    return "classified" if points.has_classes() else BEST_WITHOUT_CLASSES


def estimate_dtm(points: PointCloud, dsm: FloatArray, grid: Grid, parameters: DtmParameters) -> FloatArray:
    """(rows, cols) terrain height at cell centres, metres, by the method that the parameters name."""
    method = chosen_method(points, parameters)
    return METHODS[method](points, dsm, grid, getattr(parameters, method))

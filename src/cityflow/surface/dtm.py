"""Table of terrain methods.

A method is a file ``dtm_NAME.py`` with ``estimate_dtm`` and its parameters (with ``halo_m``), and its line in `METHODS`: the parameter
``surface.dtm.method`` may be it then, and its own parameters stand below ``surface.dtm.NAME``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, create_model

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.core.points import PointCloud
from cityflow.surface import dtm_classified, dtm_essential_points, dtm_morphological

BEST_WITHOUT_CLASSES = "morphological"
"""The most accurate one against known terrain (docs/surface.md)."""

Estimate = Callable[[PointCloud, FloatArray, Grid, Any], FloatArray]

METHODS: Mapping[str, tuple[Estimate, Parameters]] = {
    "classified": (dtm_classified.estimate_dtm, dtm_classified.ClassifiedParameters()),
    "essential_points": (dtm_essential_points.estimate_dtm, dtm_essential_points.EssentialPointsParameters()),
    "morphological": (dtm_morphological.estimate_dtm, dtm_morphological.MorphologicalParameters()),
}
"""Name → how the terrain is found, and with what."""

if TYPE_CHECKING:
    Method = str
else:
    Method = Literal["auto", *METHODS]


class _Choice(Parameters):
    """Which method finds the terrain."""

    method: Method = Field("auto", description="auto: classified where the cloud has ground points, else morphological")

    @property
    def halo_m(self) -> float:
        """Halo of the method chosen; of both that may be chosen where that is left open."""
        may_be = ("classified", BEST_WITHOUT_CLASSES) if self.method == "auto" else (self.method,)
        return float(max(getattr(self, name).halo_m for name in may_be))


if TYPE_CHECKING:

    class DtmParameters(_Choice):
        """Which method finds the terrain, and each method's own parameters."""

        morphological: dtm_morphological.MorphologicalParameters = dtm_morphological.MorphologicalParameters()

else:
    DtmParameters = create_model(
        "DtmParameters", __base__=_Choice, **{name: (type(own), own) for name, (_, own) in METHODS.items()}
    )
    DtmParameters.__doc__ = "Which method finds the terrain, and each method's own parameters."


def chosen_method(points: PointCloud, parameters: DtmParameters) -> str:
    """The method that runs for this cloud."""
    if parameters.method != "auto":
        return parameters.method
    return "classified" if points.has_classes() else BEST_WITHOUT_CLASSES


def estimate_dtm(points: PointCloud, dsm: FloatArray, grid: Grid, parameters: DtmParameters) -> FloatArray:
    """(rows, cols) terrain height at cell centres, metres, by the method that the parameters name."""
    method = chosen_method(points, parameters)
    return METHODS[method][0](points, dsm, grid, getattr(parameters, method))

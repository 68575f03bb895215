"""The rasters of a run, in the inputs of tasks."""

from __future__ import annotations

from dataclasses import dataclass

from cityflow.core.grid import Grid
from cityflow.flow.typed import TaskInputs


@dataclass(frozen=True, slots=True)
class Surfaces(TaskInputs):
    """The grids of all tiles that there can be.

    Attributes
    ----------
    working : that of terrain, classes and outlines
    group : the Zarr group whose layers stand on it
    fine : that of the DSM, DTM and ortho that are delivered, in the group ``surface.zarr`` itself
    """

    working: Grid
    group: str
    fine: Grid

    @property
    def factor(self) -> int:
        """Cells of `fine` along one cell of `working`."""
        return round(self.working.cell / self.fine.cell)

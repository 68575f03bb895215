"""What fusion knows of each cell beside its height: the height before it was averaged, its noise by the differences of images, how far it was averaged."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid, grown
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.handover.depth_reader import compared
from cityflow.stages.fuse import FuseInputs
from cityflow.surface.fuse import FuseParameters, fused_with_noise
from cityflow.surface.fused_tile import fine_grid
from cityflow.surface.steady import REACH_CELLS, steadied_and_taken

LAYERS = ("raw", "noise", "taken", "sigma", "count")
"""Height before averaging, its noise, number of windows taken (`steadied_and_taken`), expected precision (metres), and points of a cell."""
Layers = tuple[Grid, dict[str, FloatArray]]


def fused_layers(store: Store, task: Task) -> Layers:
    """Of the tile of a task of `fuse`, made again from the depth maps of its run; the same as the stage has made."""
    given, parameters = task.arguments_as(FuseInputs), task.parameters_as(FuseParameters)
    cell, factor = given.cell_m, given.factor
    reach = parameters.reach_m(cell) + 2 * cell * factor
    points = compared(store, given.depths, grown(given.bounds, reach)).points
    core = fine_grid(given.bounds, cell, factor)
    halo = int(np.ceil(parameters.reach_m(cell) / (cell * factor))) * factor
    wide = Grid(core.x_min - halo * cell, core.y_max + halo * cell, cell, core.rows + 2 * halo, core.cols + 2 * halo)
    found, noise = fused_with_noise(points, wide, parameters)
    around = np.s_[
        halo - REACH_CELLS : halo + core.rows + REACH_CELLS, halo - REACH_CELLS : halo + core.cols + REACH_CELLS
    ]
    taken = steadied_and_taken(found.dsm[around], noise[around], cell)[1][
        REACH_CELLS:-REACH_CELLS, REACH_CELLS:-REACH_CELLS
    ]
    part = np.s_[halo : halo + core.rows, halo : halo + core.cols]
    parts = (
        found.dsm[part],
        noise[part],
        np.where(np.isnan(found.dsm[part]), np.nan, taken),
        found.sigma[part],
        found.count[part],
    )
    return core, {name: np.asarray(a, np.float64) for name, a in zip(LAYERS, parts, strict=True)}


def layers_over(tiles: Sequence[Layers], grid: Grid) -> dict[str, FloatArray]:
    """The layers of tiles on the cells of a grid of the same lattice; NaN where no tile is."""
    found = {name: np.full(grid.shape, np.nan) for name in LAYERS}
    for own, layers in tiles:
        row, col = round((grid.y_max - own.y_max) / grid.cell), round((own.x_min - grid.x_min) / grid.cell)
        r_0, r_1, c_0, c_1 = max(row, 0), min(row + own.rows, grid.rows), max(col, 0), min(col + own.cols, grid.cols)
        if r_0 < r_1 and c_0 < c_1:
            for name, whole in found.items():
                whole[r_0:r_1, c_0:c_1] = layers[name][r_0 - row : r_1 - row, c_0 - col : c_1 - col]
    return found

"""The laser points that show the walls of found outlines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Outline
from cityflow.core.grid import Bounds, Grid, grown, tiles_over
from cityflow.flow.store import Store
from cityflow.handover.house_points import LOW_M, houses_of
from cityflow.outlines.under_eaves.facades_inside import NEAR_M, SeenHouses
from cityflow.surface.sample import sample
from cityflow.survey.surface_source import LIDAR
from cityflow.survey.survey import Survey


def reach_of_points(survey: Survey, name: str) -> Bounds | None:
    """Laser points that may show the walls of a tile's found outlines; None if not requested or no laser has seen them."""
    if survey.source.kind != LIDAR or survey.outlines_given or not survey.parameters.outline.walls_in.wanted:
        return None
    return survey.lattice.tiles[name].buffered(survey.parameters.outline.found.widest_m + NEAR_M)


def scanned_houses(
    store: Store,
    pieces: Sequence[str],
    index_cell_m: float,
    outlines: Sequence[Outline],
    grid: Grid,
    terrain: FloatArray,
) -> SeenHouses | None:
    """What a laser has seen around outlines, above the terrain; None without pieces or outlines.

    Parameters
    ----------
    pieces : of the index, with cells of `index_cell_m`; those that no outline is near are not read
    terrain : (rows, cols) heights on `grid`, NaN where unknown
    """
    near = [grown(o.polygon.bounds, NEAR_M) for o in outlines]
    cells = {t.name for bounds in near for t in tiles_over(bounds, index_cell_m)}
    read = [path for path in pieces if path.rsplit("/", 1)[-1].rsplit(".", 1)[0] in cells]
    if not read:
        return None
    low, high = (np.array(near)[:, k : k + 2] for k in (0, 2))
    xyz = houses_of(store, read, (*low.min(axis=0), *high.max(axis=0)))
    ground = sample(grid, terrain, xyz[:, 0], xyz[:, 1])
    return SeenHouses.of(xyz[~(xyz[:, 2] - ground <= LOW_M)], None)

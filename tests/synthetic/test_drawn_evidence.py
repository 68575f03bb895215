from __future__ import annotations

import numpy as np
import pytest
import shapely

from cityflow.core.grid import Grid
from scenes.drawn_evidence import split_evidence
from synthetic.drawn_scene import BOUNDS, drawn, town


def test_evidence_of_an_outline_holds_all_of_it_in_every_frame() -> None:
    frames = [d.rasters for d in drawn()]
    grid = Grid.covering(BOUNDS, 0.5)
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    outline = shapely.box(BOUNDS[0] + 8, BOUNDS[1] + 8, BOUNDS[2] - 8, BOUNDS[3] - 8)
    made = split_evidence("k1", outline, frames, (grid, town().dtm(x, y)))
    assert made.id == "k1"
    assert made.gsd_m == pytest.approx(0.1)
    assert [f.frame.name for f in made.frames] == [f.frame.name for f in frames]
    along = shapely.get_coordinates(shapely.segmentize(outline.exterior, 0.5))
    assert made.ground_height == pytest.approx(town().dtm(*along.T).min(), abs=0.1)
    corners = shapely.get_coordinates(outline.exterior)
    top = float(np.nanmax(made.frames[0].dsm))
    for rasters, whole in zip(made.frames, frames, strict=True):
        assert rasters.grid.rows < whole.grid.rows
        assert rasters.dsm.shape == rasters.grid.shape
        for height in (made.ground_height, top):
            place = rasters.frame.from_world(np.column_stack([corners, np.full(len(corners), height)]))
            row, col = rasters.grid.indices(place[:, 0], place[:, 1])
            assert (row >= 0).all() and (row < rasters.grid.rows).all()  # noqa: PT018
            assert (col >= 0).all() and (col < rasters.grid.cols).all()  # noqa: PT018
        part = whole.dsm[whole.grid.slices(rasters.grid)]
        assert np.array_equal(part, rasters.dsm, equal_nan=True)

"""Steps of a surface that a model lacks are found, wherever the model stands otherwise; those that it has, and a rim that falls, are none."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, affinity

from cityflow.core.building import Polyhedron
from cityflow.core.grid import Grid, grown
from cityflow.core.reconstruction import HeightRaster
from cityflow.reconstruction.choose import ReconstructParameters, choose
from cityflow.reconstruction.verdicts.lacked_steps import lacked_share
from roof_scenes import ORIGIN, OUTLINE, Height, gable, gable_with_dormer, scan, two_levels

CELL_M = 0.125


def surface(height: Height) -> HeightRaster:
    """A roof, and the ground around it."""
    outline = world_outline()
    grid = Grid.covering(grown(outline.bounds, 3.0), CELL_M)
    x, y = grid.centres()
    x, y = x - ORIGIN[0], y - ORIGIN[1]
    on = (x > 0) & (x < 12) & (y > 0) & (y < 8)
    dsm = np.where(on, height(x, y) + ORIGIN[2], ORIGIN[2])
    return HeightRaster(grid, dsm, np.full(grid.shape, ORIGIN[2]))


def world_outline() -> Polygon:
    return affinity.translate(OUTLINE, *ORIGIN[:2])


def model_of(height: Height) -> Polyhedron:
    solid = choose(scan(height, OUTLINE, 20.0, 0.01, 1), ReconstructParameters()).candidate.solid
    assert solid is not None
    return solid


@pytest.mark.parametrize("height", [gable, two_levels])
def test_a_model_that_has_all_lacks_nothing(height: Height) -> None:
    assert lacked_share(model_of(height), world_outline(), surface(height)) < 0.002


def test_flanks_of_a_dormer_that_the_model_lacks_count() -> None:
    """Two flanks of 1.6 m and a front of 1.8 m, each two cells wide: some 1.2 m² of 85 m², less where the dormer meets the slope."""
    heights, model = surface(gable_with_dormer), model_of(gable)
    lacked = lacked_share(model, world_outline(), heights)
    assert 0.006 < lacked < 0.02
    assert lacked_share(model_of(gable_with_dormer), world_outline(), heights) < 0.5 * lacked


def test_what_is_unknown_counts() -> None:
    heights = surface(gable)
    heights.dsm[heights.dsm.shape[0] // 2 - 8 : heights.dsm.shape[0] // 2 + 8, 50:70] = np.nan
    assert lacked_share(model_of(gable), world_outline(), heights) == pytest.approx(16 * 20 * CELL_M**2 / 85.0, rel=0.4)


def test_a_roof_that_is_all_rim_tells_nothing() -> None:
    narrow = affinity.translate(Polygon([(0, 0), (12, 0), (12, 0.6), (0, 0.6)]), *ORIGIN[:2])
    assert lacked_share(model_of(gable), narrow, surface(gable)) == 0.0

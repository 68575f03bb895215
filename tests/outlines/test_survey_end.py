"""Outlines at the end of what was surveyed: their edges there are no walls that anybody has seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import box

from cityflow.core.grid import Grid
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.from_heights.survey_end import ENDS

GRID = Grid.covering((85000.0, 447500.0, 85060.0, 447560.0), 0.5)
HOUSE = box(85020, 447520, 85044, 447532)


def surface(end_x: float) -> RegionSurface:
    """A house on level ground, surveyed as far east as `end_x`."""
    x, y = np.meshgrid(GRID.x_centres(), GRID.y_centres())
    west, south, east, north = HOUSE.bounds
    inside = (x > west) & (x < east) & (y > south) & (y < north)
    ndsm = np.where(x > end_x, np.nan, np.where(inside, 6.0, 0.0)).astype(np.float32)
    klass = np.where(np.isnan(ndsm), 0, np.where(inside, 6, 2)).astype(np.uint8)
    return RegionSurface(GRID, ndsm, klass, np.zeros(GRID.shape, bool), None, np.full(GRID.shape, 3, np.uint32))


def test_what_goes_on_beyond_the_survey_is_drawn_to_its_end_and_says_so() -> None:
    (found,) = find_outlines(surface(85036.0), FindParameters(spot_m=0.0))
    assert ENDS in found.remark
    assert found.polygon.bounds == pytest.approx((85020, 447520, 85036, 447532), abs=0.4)
    middle = [e.line.interpolate(0.5, normalized=True) for e in found.edges]
    at_end = [p.x > 85035 for p in middle]
    assert sum(at_end) == 1
    assert [np.isnan(e.sigma_m) for e in found.edges] == at_end


def test_a_house_amid_the_survey_or_at_the_edge_of_the_raster_is_not_marked() -> None:
    whole = surface(85060.0)
    (found,) = find_outlines(whole, FindParameters(spot_m=0.0))
    assert ENDS not in found.remark
    part = slice(None), slice(0, 72)
    small = Grid(GRID.x_min, GRID.y_max, GRID.cell, GRID.rows, 72)
    assert whole.count is not None
    cut = replace(
        whole, grid=small, ndsm=whole.ndsm[part], klass=whole.klass[part], holes=whole.holes[part], count=whole.count[part]
    )  # fmt: skip
    (found,) = find_outlines(cut, FindParameters(spot_m=0.0))
    assert ENDS not in found.remark

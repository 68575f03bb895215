"""Buildings at the edge of the survey, whose extent is unknown."""

from __future__ import annotations

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray
from cityflow.core.reconstruction import HeightRaster

AROUND_M, STEP_M = 1.0, 0.25
"""The survey has to go on so far beyond an outline; looked at every so many metres; set by hand, as are those below."""
LEAST_M = 2.0
"""Of the outline's border, beyond which the survey ends: less is a corner."""
ENDS = "the survey ends here: {:.0f} m of the {:.0f} m around the outline were not surveyed"


def survey_end(outline: Polygon, heights: HeightRaster | None) -> str:
    """What to say of an outline at the survey's edge; empty where the survey goes on around it, or where nothing is known of it.

    Surveyed is what has a terrain.
    """
    if heights is None:
        return ""
    border = shapely.get_coordinates(shapely.segmentize(shapely.buffer(outline, AROUND_M).exterior, STEP_M))[:-1]
    share = 1.0 - float(_surveyed(heights, border[:, 0], border[:, 1]).mean())
    length = outline.exterior.length
    return ENDS.format(share * length, length) if share * length >= LEAST_M else ""


def _surveyed(heights: HeightRaster, x: np.ndarray, y: np.ndarray) -> BoolArray:
    row, col = heights.grid.indices(x, y)
    rows, cols = heights.grid.shape
    inside = (row >= 0) & (col >= 0) & (row < rows) & (col < cols)
    z = heights.dtm[np.clip(row, 0, rows - 1), np.clip(col, 0, cols - 1)]
    return np.asarray(inside & np.isfinite(z))

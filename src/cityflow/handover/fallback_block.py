"""The block that stands in the city for a unit whose reconstruction failed: the same for every task that looks at it."""

from __future__ import annotations

import numpy as np
import shapely

from cityflow.core.building import Building, Lod, Outline, RoofPlane, Scalar, Status
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.verdicts import PROBABILITY_KEY, REASON_KEY, VERDICT_KEY, Verdict
from cityflow.flow.store import Store
from cityflow.geometry.validity import check_polyhedron
from cityflow.handover.cached_reads import read_surface
from cityflow.handover.surfaces import Surfaces
from cityflow.io.attributes import with_source
from cityflow.reconstruction.extruded import extrude

PERCENTILE = 70.0
"""Of the roof's heights, at which a block without a model ends; set by hand."""
MARGIN_CELLS = 4
"""Read around an outline, so that its rim has neighbours."""


def surface_over(store: Store, surfaces: Surfaces, bounds: Bounds) -> tuple[Grid, dict[str, np.ndarray]]:
    """DSM and DTM over `bounds`, with the margin that lets both tiles beside a border see the same profile."""
    city = surfaces.working
    return read_surface(store, surfaces.group, city, grown(bounds, MARGIN_CELLS * city.cell))


def failed_block(store: Store, surfaces: Surfaces, outline: Outline, reason: str) -> Building | None:
    """A block from the surface over the whole outline, the same in every tile that shows it; None where no height is known."""
    grid, layers = surface_over(store, surfaces, outline.polygon.bounds)
    x, y = grid.centres()
    inside = shapely.contains_xy(outline.polygon, x, y)
    roof, ground = (z[inside & np.isfinite(z)] for z in (layers["dsm"], layers["dtm"]))
    if not len(roof) or not len(ground):
        return None
    floor, top = float(np.floor(ground.min() * 100)) / 100, round(float(np.percentile(roof, PERCENTILE)), 4)
    solid = extrude(outline.polygon, floor, max(top, floor + 1.0))
    if check_polyhedron(solid):
        return None
    x_0, y_0 = (round(v, 4) for v in outline.polygon.bounds[:2])
    solids = dict.fromkeys((Lod.LOD12, Lod.LOD13, Lod.LOD22), solid)
    marks: dict[str, Scalar] = {
        "lod": "1.2", "method": "block from the DSM", "is_fallback": True,
        VERDICT_KEY: Verdict.POOR.value, PROBABILITY_KEY: 0.0, REASON_KEY: reason,
    }  # fmt: skip
    plane = RoofPlane(0.0, 0.0, top, (x_0, y_0), len(roof))
    attributes = with_source(outline.attributes, marks)
    return Building(outline.id, outline.polygon, floor, solids, (plane,), attributes, Status.FAILED, reason)

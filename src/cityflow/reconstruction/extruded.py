"""The simplest model: the outline as a block with one level top (LoD1.2), used when all other methods fail."""

from __future__ import annotations

import numpy as np
from pydantic import Field
from shapely import Polygon

from cityflow.core.building import Lod, Polyhedron, RoofPlane, Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.reconstruction.partition.partition_values import single_cell
from cityflow.reconstruction.solids.assemble import MIN_HEIGHT, assemble


class ExtrudedParameters(Parameters):
    """How high a block is, given the heights of its roof points."""

    percentile: float = Field(70.0, ge=0, le=100, description="percentile of the roof points' heights that is the top")
    min_points: int = Field(1, ge=1, le=1000, description="fewer points than this give no height")


def reconstruct(evidence: Evidence, parameters: ExtrudedParameters) -> Candidate:
    """A block over the outline; no solid where there are too few points."""
    z = evidence.points.xyz[:, 2]
    z = z[np.isfinite(z)]
    if len(z) < parameters.min_points:
        return Candidate(
            "extruded", None, status=Status.FAILED, reason=f"{len(z)} roof points are too few for a height"
        )
    top = max(float(np.percentile(z, parameters.percentile)), evidence.ground_height + MIN_HEIGHT)
    x0, y0 = evidence.outline.bounds[:2]
    plane = RoofPlane(0.0, 0.0, top, (x0, y0), len(z), float(np.sqrt(np.mean((z - top) ** 2))))
    solid = extrude(evidence.outline, evidence.ground_height, top)
    blocks = {Lod.LOD12: solid, Lod.LOD13: solid}
    return Candidate("extruded", solid, (plane,), blocks, Status.DEGRADED, "one block with a flat top")


def extrude(outline: Polygon, floor: float, top: float) -> Polyhedron:
    """A block between two world heights over an outline in world coordinates; its vertices stay bit for bit."""
    x0, y0 = (float(np.floor(v)) for v in outline.bounds[:2])
    coefficients = np.array([[0.0, 0.0, top]])
    return assemble(single_cell(moved(outline, -x0, -y0)), coefficients, floor, (x0, y0, 0.0), outline)


def moved(outline: Polygon, dx: float, dy: float) -> Polygon:
    """A polygon shifted in plan, vertices in the same order."""
    shell, *holes = (np.asarray(r.coords)[:, :2] + (dx, dy) for r in (outline.exterior, *outline.interiors))
    return Polygon(shell, holes)

"""From points of LiDAR: surface, outlines, borders between houses, and the model of a building."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from cityflow.core.building import OUTLINE_SIGMA_M, Building, Outline
from cityflow.core.grid import Bounds, grown
from cityflow.core.local_frame import LocalFrame
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence, HeightRaster
from cityflow.core.splitting import FrameRasters, SplitEvidence, Splitting
from cityflow.errors import RefusedUnit
from cityflow.geometry.outline_distances import distances_to_outline
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.reconstruction.measures import measure
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.verdicts.judge import attributes_of, judged_model
from cityflow.splitting.split import SplitParameters, split
from cityflow.stages.reconstruct import finished_building
from cityflow.stages.reconstruct.evidence import (
    AROUND_M,
    RASTER_MARGIN_M,
    floor_of,
    in_order,
    part_of_houses,
    roof_points,
)
from cityflow.surface.tile_surface import SurfaceParameters, TileSurface, surface_of_tile

NADIR = LocalFrame("nadir", np.eye(3), np.zeros(3))


def surface_from_points(
    points: PointCloud, bounds: Bounds | None = None, parameters: SurfaceParameters | None = None
) -> TileSurface:
    """DSM, terrain, heights above it, classes, counts and holes on cells of `parameters.cell_m` (0.5 m).

    Parameters
    ----------
    points : world metres; those up to `parameters.halo_m` (70 m) beyond `bounds` count, too
    bounds : x_min, y_min, x_max, y_max in world metres; None: those of the points
    """
    p = parameters or SurfaceParameters()
    if bounds is None:
        known = points.xyz[np.isfinite(points.xyz).all(axis=1)]
        bounds = (*known[:, :2].min(axis=0).tolist(), *known[:, :2].max(axis=0).tolist())
    return surface_of_tile(points, bounds, p.halo_m, p)


def outlines_from_points(
    points: PointCloud, bounds: Bounds | None = None, parameters: FindParameters | None = None
) -> list[Outline]:
    """Outlines of the buildings that points show, noded, in world metres; ids come from their positions.

    Parameters
    ----------
    points : world metres
    bounds : outlines are found of buildings within; None: within those of the points
    """
    surface = surface_from_points(points, bounds)
    return find_outlines(
        RegionSurface(
            surface.grid, surface.ndsm, surface.klass, surface.holes, count=surface.count.astype(np.uint32), dtm=surface.dtm
        ),
        parameters,
    )  # fmt: skip


def split_outline(outline: Outline, points: PointCloud, parameters: SplitParameters | None = None) -> Splitting:
    """Cut lines between the houses of an outline, with their confidence, and the units that they part; whatever its shape, there is a result.

    Parameters
    ----------
    outline : of a terrace or block, world metres
    points : over it and some metres around, world metres
    """
    outline = _turned(outline)
    near = grown(outline.polygon.bounds, AROUND_M)
    surface = surface_from_points(points, near)
    floor = floor_of(surface.grid, surface.dtm, outline.polygon)
    if not np.isfinite(floor):
        return Splitting((outline.polygon,), reason="no terrain along the outline")
    frame = FrameRasters(NADIR, surface.grid, surface.dsm)
    seen = SplitEvidence(
        outline.id, outline.polygon, (frame,), floor, in_order(points.within(near)), outline.inner_edges
    )
    return split(seen, parameters or SplitParameters())


def building_from_points(
    points: PointCloud, outline: Outline, parameters: ModelParameters | None = None, outline_sigma_m: float = OUTLINE_SIGMA_M
) -> Building:  # fmt: skip
    """The model of one building as a run makes it: closed solids at LoD 1.2, 1.3 and 2.2, roof planes, overhangs, measures and verdict.

    Parameters
    ----------
    points : of the building and of some tens of metres around it, world metres. If a class is `BUILDING` (6), only these points are roofs
    outline : of the building, world metres: ``Outline("my house", polygon)``
    parameters : methods and their settings; those of a run by default
    outline_sigma_m : standard deviation of the outline across its edges, metres

    Returns
    -------
    Building
        Vertices in world metres, multiples of 0.1 mm; `attributes` as in the products (docs/formats.md), among them ``verdict``
        (good, look, poor), ``good_probability`` and ``verdict_reason``.

    Raises
    ------
    RefusedUnit
        There is no terrain along the outline, or no method gave a valid solid.
    """
    outline = _turned(outline)
    evidence = evidence_from_points(points, outline)
    judged = judged_model(evidence, (parameters or ModelParameters()).of_outlines(outline_sigma_m))
    choice = judged.choice
    if choice.candidate.solid is None:
        raise RefusedUnit(choice.reason, where=outline.id)
    return finished_building(
        outline, evidence, choice, {**measure(choice, evidence, judged.fit), **attributes_of(judged)}
    )


def evidence_from_points(points: PointCloud, outline: Outline) -> Evidence:
    """What a reconstruction method looks at (`reconstruct(evidence, parameters)` of the files in `cityflow.reconstruction`).

    Raises
    ------
    RefusedUnit
        There is no terrain along the outline.
    """
    surface = surface_from_points(points, grown(outline.polygon.bounds, RASTER_MARGIN_M))
    floor = floor_of(surface.grid, surface.dtm, outline.polygon)
    near = in_order(points.within(grown(outline.polygon.bounds, AROUND_M)))
    inside = near.take(shapely.contains_xy(outline.polygon, near.xyz[:, 0], near.xyz[:, 1]))
    if not np.isfinite(floor):
        problem = f"no terrain height along the outline ({len(inside)} points inside)"
        raise RefusedUnit(problem, where=outline.id, remedy="give points of the ground around it, too")
    close = near.take(distances_to_outline(outline.polygon, near.xyz) <= AROUND_M)
    classified = bool(np.any(points.classification == BUILDING))
    uneven = 0.0 if classified else SurfaceParameters().vegetation.uneven
    layers: dict[str, NDArray[Any]] = {"dtm": surface.dtm, "class": surface.klass}
    heights = HeightRaster(surface.grid, surface.dsm.astype(np.float64), surface.dtm.astype(np.float64))
    return Evidence(
        outline.id, outline.polygon, roof_points(inside, surface.grid, layers, classified, uneven), floor,
        outline.aspects, outline.slopes, around=part_of_houses(close, surface.grid, surface.dtm), heights=heights,
        party=outline.party, edges=outline.edges, roof=outline.roof, rims=outline.rims,
    )  # fmt: skip


def _turned(outline: Outline) -> Outline:
    """The same with its exterior counter-clockwise."""
    return replace(outline, polygon=shapely.orient_polygons(outline.polygon))

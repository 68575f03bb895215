"""The monolithic method (Frommholz 2017, section 3): a building without discontinuities, from cells of a plan grid.

Façades become lines, lines a contour; roof cells become surfaces. Which surfaces meet is read from the grid alone (topology); where they
meet is computed from planes alone (geometry). Where the two contradict each other the roof has discontinuities, or too little
of it was seen: the method says so instead of giving a solid, and leaves the building to the volumetric one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely
from pydantic import Field
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, RoofPlane, Scalar, Semantic, Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import moved
from cityflow.reconstruction.monolithic_parts.cell_grid import CellGrid, CellPoints, spacing
from cityflow.reconstruction.monolithic_parts.contour_scan import Contour, scan_contour
from cityflow.reconstruction.monolithic_parts.facade_cells import find_facade_cells
from cityflow.reconstruction.monolithic_parts.facade_lines import (
    NEAR_M,
    FacadeContour,
    FacadeLineParameters,
    close_contour,
    facade_lines,
)
from cityflow.reconstruction.monolithic_parts.roof_cells import UNEVENNESS_M, RoofCellParameters, RoofCells, roof_cells
from cityflow.reconstruction.monolithic_parts.roof_faces import FaceParameters, check_faces, cut_in_faces
from cityflow.reconstruction.monolithic_parts.skeleton import build_skeleton
from cityflow.reconstruction.monolithic_parts.skeleton_values import Frame, Inconsistency, Skeleton
from cityflow.reconstruction.monolithic_parts.topology import SurfaceImage, find_topology, surface_image
from cityflow.reconstruction.noise.voxel_filter import VoxelFilterParameters, filter_noise
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.planes.roof_cloud import local_origin, thin, typical_density
from cityflow.reconstruction.solids.assemble import MIN_HEIGHT, assemble
from cityflow.reconstruction.solids.levels import block_levels

METHOD = "monolithic"
MOST_FACADE_POINTS = 60_000
"""More points around a unit than this are thinned, evenly in their order in space; set by hand, as is the next."""
LEAST_FACADE_POINTS = 100
"""With fewer points that are known to be on façades these are looked for among all points around the unit."""
INCONSISTENT = "inconsistent: "
"""Reasons of candidates that this method leaves to another one begin so."""
SLOPE_SIGMA = 0.08
"""2×2 cells are so large that their slope is known to this (rise over run); set by hand."""
CELL_POINTS = 6.0
"""Fewest points that 2×2 cells typically hold: twice those of a plane; set by hand."""
MOST_UNSEEN = 0.3
"""Degraded where more of the roof (share) was not seen; set by hand."""


class MonolithicParameters(Parameters):
    """Grid, roof cells, skeleton, and what the result must agree with."""

    noise: VoxelFilterParameters = VoxelFilterParameters()
    target_density_m2: float = Field(
        100.0, gt=0, le=1000, description="denser clouds are thinned to so many points per m²"
    )
    facades: FacadeLineParameters = FacadeLineParameters()
    cells: RoofCellParameters = RoofCellParameters()
    worse_again: float = Field(
        1.5, gt=1, le=5, description="`cells.worse` of the second attempt at an inconsistent roof"
    )
    faces: FaceParameters = FaceParameters()


@dataclass(frozen=True, slots=True)
class _Roof:
    """What was found of a roof."""

    skeleton: Skeleton
    partition: RoofPartition
    sums: FloatArray
    notes: dict[str, Scalar]


def reconstruct(evidence: Evidence, parameters: MonolithicParameters) -> Candidate:
    """The method. No solid, and a reason that begins with `INCONSISTENT`, where topology and geometry contradict each other."""
    notes: dict[str, Scalar] = {}
    try:
        return _reconstruct(evidence, parameters, notes)
    except Inconsistency as found:
        return Candidate(METHOD, None, status=Status.FAILED, reason=f"{INCONSISTENT}{found}", notes=notes)


def _reconstruct(evidence: Evidence, parameters: MonolithicParameters, notes: dict[str, Scalar]) -> Candidate:
    origin = local_origin(evidence)
    outline = moved(evidence.outline, -origin[0], -origin[1])
    cells, noise = _cells(evidence, outline, origin, parameters)
    notes |= {"cell_m": round(cells.grid.cell, 3), "noise": round(noise, 4)}
    notes |= _contour_notes(find_contour(evidence, outline, origin, parameters.facades), outline)
    roof = _first_consistent(cells, outline, noise, parameters, notes)
    planes = roof.skeleton.planes
    frame = evidence.ground_height, origin, evidence.outline
    solid = assemble(roof.partition, planes, *frame)
    faults = check_polyhedron(solid)
    if faults:
        raise Inconsistency(f"the solid is not valid ({faults[0].code} {faults[0].name})")
    _check_floor(solid, evidence.ground_height)
    blocks = block_levels(roof.partition, planes, *frame)
    unseen = float(notes["unseen"] or 0.0)
    status, reason = Status.DONE, ""
    if unseen > MOST_UNSEEN:
        status, reason = (
            Status.DEGRADED,
            f"{100 * unseen:.0f} % of the roof has no points: the surfaces around are extended over it",
        )
    return Candidate(METHOD, solid, _roof_planes(planes, roof.sums, origin), blocks, status, reason, notes)


def _check_floor(solid: Polyhedron, floor: float) -> None:
    """Roofs that would come down to the floor are laid level by `assemble`: then this is no roof."""
    roofs = solid.of_semantic(Semantic.ROOF)
    if (
        any(face.plane < 0 for face in roofs)
        or min(solid.ring(f.rings[0])[:, 2].min() for f in roofs) < floor + MIN_HEIGHT - 1e-3
    ):
        raise Inconsistency("the roof reaches the ground")


def find_contour(
    evidence: Evidence, outline: Polygon, origin: tuple[float, float, float], parameters: FacadeLineParameters
) -> FacadeContour:
    """The contour that façades tell, local frame; the model keeps the outline that it was given, so that neighbours fit.

    Parameters
    ----------
    outline : local;  origin : world
    """
    known = len(evidence.walls) >= LEAST_FACADE_POINTS
    xyz = (evidence.walls.xyz if known else evidence.around.xyz) - np.asarray(origin)
    xyz = xyz[np.all(np.isfinite(xyz), axis=1)]
    if len(xyz) > MOST_FACADE_POINTS:
        order = np.lexsort((xyz[:, 2], xyz[:, 1], xyz[:, 0]))
        xyz = xyz[order[:: math.ceil(len(xyz) / MOST_FACADE_POINTS)]]
    x_0, y_0, x_1, y_1 = outline.bounds
    reach = 2 * NEAR_M
    bounds = x_0 - reach, y_0 - reach, x_1 + reach, y_1 + reach
    found, _ = find_facade_cells(xyz, bounds, parameters.cells)
    lines = facade_lines(found, parameters)
    party = [LineString(np.asarray(line.coords)[:, :2] - origin[:2]) for line in evidence.party]
    return close_contour(lines, outline, party, parameters)


def _contour_notes(contour: FacadeContour, outline: Polygon) -> dict[str, Scalar]:
    """How far the contour is from the outline: mean and largest offset of façades (m), IoU, share of the walls seen."""
    offset = np.abs(contour.offset[np.isfinite(contour.offset)])
    found = Polygon(contour.ring)
    closed = bool(found.is_valid and found.area > 0)
    solid = Polygon(outline.exterior)
    iou = shapely.intersection(found, solid).area / shapely.union(found, solid).area if closed else 0.0
    return {
        "facades": len(offset),
        "facades_seen": round(contour.seen, 3),
        "facade_offset_m": round(float(offset.mean()), 3) if len(offset) else None,
        "facade_offset_largest_m": round(float(offset.max()), 3) if len(offset) else None,
        "facades_inside_m": round(contour.inner, 2),
        "contour_closed": closed,
        "contour_iou": round(float(iou), 4),
    }


def _cells(
    evidence: Evidence, outline: Polygon, origin: tuple[float, float, float], parameters: MonolithicParameters
) -> tuple[CellPoints, float]:
    """Roof points without noise, in cells; their noise (m)."""
    local = evidence.points.xyz - np.asarray(origin)
    local = local[np.all(np.isfinite(local), axis=1)]
    if typical_density(local) > parameters.target_density_m2:
        local = thin(local, 1 / math.sqrt(parameters.target_density_m2))
    # the filter looks at some points by their numbers: so these must not depend on the reader
    local = local[np.lexsort((local[:, 2], local[:, 1], local[:, 0]))]
    filtering = filter_noise(local, parameters.noise)
    local = local[filtering.keep]
    noise = filtering.noise_m
    if len(local) < 3 * CELL_POINTS or not np.isfinite(noise):
        raise Inconsistency(f"{len(local)} points are too few for a roof")
    cell = spacing(typical_density(local), noise, SLOPE_SIGMA, CELL_POINTS)
    return CellPoints.of(CellGrid.over(outline.bounds, cell / 2), local), noise


def _first_consistent(
    cells: CellPoints, outline: Polygon, noise: float, parameters: MonolithicParameters, notes: dict[str, Scalar]
) -> _Roof:
    """The roof; where it is inconsistent, that of surfaces that were merged more boldly, since one surface may have come in two parts."""
    try:
        return _roof(cells, outline, noise, parameters, notes)
    except Inconsistency:
        bolder = parameters.cells.model_copy(update={"worse": parameters.worse_again})
        again: dict[str, Scalar] = {}
        try:
            roof = _roof(cells, outline, noise, parameters.model_copy(update={"cells": bolder}), again)
        except Inconsistency:
            roof = None
        if roof is None:
            raise
        notes |= again | {"merged_again": True}
        return roof


def _roof(
    cells: CellPoints, outline: Polygon, noise: float, parameters: MonolithicParameters, notes: dict[str, Scalar]
) -> _Roof:
    """Cells, topology, geometry, faces."""
    shapely.prepare(outline)
    inside = shapely.contains_xy(outline, *cells.grid.centres())
    notes["unseen"] = round(float(np.mean(cells.counts()[inside.ravel()] == 0)), 3) if inside.any() else 1.0
    found = roof_cells(cells, inside, noise, parameters.cells)
    notes |= {"planes_found": len(found.planes), "smooth": round(found.smooth, 3), "grown": round(found.grown, 3)}
    if len(found.planes) == 0:
        raise Inconsistency("no smooth surface")
    sigma = math.hypot(noise, UNEVENNESS_M)
    image = surface_image(found, cells, sigma, parameters.cells.min_area_m2 / cells.grid.cell**2)
    sums = _plane_sums(cells, found, image)
    topology = find_topology(image)
    contour = Contour.of(outline)
    frame = Frame(cells.grid, outline, contour, scan_contour(contour, image.labels, cells.grid), sums, sigma)
    notes |= {"surfaces": len(image.plane_of), "nodes": len(topology.nodes), "arrises": len(frame.arrises)}
    skeleton = build_skeleton(topology, found.planes, frame)
    notes |= {"flips": skeleton.flips, "merged": skeleton.merged, "ties": skeleton.ties}
    partition = cut_in_faces(skeleton, frame)
    notes |= check_faces(partition, skeleton, cells, image.plane_labels(), frame, parameters.faces)
    return _Roof(skeleton, partition, sums, notes)


def _plane_sums(cells: CellPoints, roof: RoofCells, image: SurfaceImage) -> FloatArray:
    """(P, 10) sums over the cells that are on each plane."""
    sums = np.zeros((len(roof.planes), cells.sums.shape[1]))
    plane = image.plane_labels().ravel()
    np.add.at(sums, plane[plane >= 0], cells.sums[plane >= 0])
    return sums


def _roof_planes(planes: FloatArray, sums: FloatArray, origin: tuple[float, float, float]) -> tuple[RoofPlane, ...]:
    x0, y0, z0 = origin
    return tuple(
        RoofPlane(float(a), float(b), float(c) + z0, (x0, y0), int(row[0]), float("nan"))
        for (a, b, c), row in zip(planes, sums, strict=True)
    )

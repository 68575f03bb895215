"""The volumetric method (Frommholz 2017, section 3): buildings with set-backs, steps and parts that stand over a void.

Surfaces of any slope are found in cubes; nodes are where three of them meet near their own cubes, edges join nodes on the
same two surfaces. The hull is not put together from nodes and edges, where a node that lacks a surface spoils it, but from the
columns that the edges part: it is closed whatever surfaces were found.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import shapely
from shapely import Polygon

from cityflow.core.building import Polyhedron, Scalar, Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import moved
from cityflow.reconstruction.partition.cut_line import CutLine
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.roof_partition import partition_along
from cityflow.reconstruction.planes.plane_segments import PlaneSegments
from cityflow.reconstruction.planes.waves import without_waves
from cityflow.reconstruction.solids.assemble import assemble
from cityflow.reconstruction.solids.levels import block_levels
from cityflow.reconstruction.solids.roof_solid import ATTEMPTS, coarser
from cityflow.reconstruction.volumetric_parts.columns import ColumnParameters, TopEnergy
from cityflow.reconstruction.volumetric_parts.facades import (
    Facade,
    FacadeCloud,
    FacadeParameters,
    facade_cloud,
    find_facades,
)
from cityflow.reconstruction.volumetric_parts.hull import build_hull
from cityflow.reconstruction.volumetric_parts.hull_columns import standing_columns
from cityflow.reconstruction.volumetric_parts.hull_lines import cutting_lines, outline_walls
from cityflow.reconstruction.volumetric_parts.nodes import NodeParameters, find_nodes, through_nodes
from cityflow.reconstruction.volumetric_parts.roof_surfaces import SurfaceParameters, roof_surfaces
from cityflow.reconstruction.volumetric_parts.undersides import SeenFacades, UndersideParameters, find_voids

METHOD = "volumetric"


class VolumetricParameters(Parameters):
    """Surfaces, nodes between them, columns between edges, undersides."""

    surfaces: SurfaceParameters = SurfaceParameters()
    facades: FacadeParameters = FacadeParameters()
    nodes: NodeParameters = NodeParameters()
    columns: ColumnParameters = ColumnParameters()
    undersides: UndersideParameters = UndersideParameters()


def simpler(full: VolumetricParameters) -> Iterator[VolumetricParameters]:
    """Parameters for simpler hulls: larger surfaces only, fewer of them, no voids, edges that must be worth more."""
    for area, most, edge in ((2.0, 20, 2.0), (4.0, 8, 4.0)):
        surfaces = {
            "min_area_m2": min(full.surfaces.min_area_m2 * area, 100.0),
            "max_surfaces": min(full.surfaces.max_surfaces, most),
        }
        columns = {
            "edge_cost": min(full.columns.edge_cost * edge, 10.0),
            "min_width": min(full.columns.min_width * edge, 5.0),
        }
        yield full.model_copy(
            update={
                "surfaces": full.surfaces.model_copy(update=surfaces),
                "columns": full.columns.model_copy(update=columns),
                "undersides": full.undersides.model_copy(update={"search": False}),
            }
        )


def reconstruct(evidence: Evidence, parameters: VolumetricParameters) -> Candidate:
    """The method: surfaces, nodes, edges, closed hull. No solid where no surface is found."""
    segments, noisy = roof_surfaces(evidence, parameters.surfaces)
    if evidence.matched:
        segments = without_waves(segments)
    if len(segments) == 0:
        return Candidate(METHOD, None, status=Status.FAILED, reason=f"no roof surface in {len(evidence.points)} points")
    outline = moved(evidence.outline, -segments.origin[0], -segments.origin[1])
    cloud = facade_cloud(evidence, segments.origin)
    facades = find_facades(cloud, outline, parameters.facades)
    walls = [*outline_walls(outline), *(f.line for f in facades)]
    nodes = find_nodes(segments, walls, shapely.get_coordinates(outline), parameters.nodes)
    planes, tied = through_nodes(segments, nodes, parameters.nodes.tie)
    segments = segments.on_planes(planes)
    scene = _Scene(evidence, segments, outline, cloud, facades)
    lines = cutting_lines(outline, segments, facades, nodes, parameters.columns)
    hull = scene.hull(lines, parameters)
    if isinstance(hull, str):
        return Candidate(METHOD, None, status=Status.FAILED, reason=f"no valid hull in {ATTEMPTS} attempts: {hull}")
    notes: dict[str, Scalar] = {
        "surfaces": len(segments),
        "facades": len(facades),
        "triplets": nodes.triplets,
        "triplets_left_out": nodes.left_out,
        "vertices": nodes.vertices,
        "nodes": len(nodes),
        "nodes_tied": tied,
        "lines": len(lines),
        "columns": len(hull.partition.cells),
        "voids": hull.voids,
        "times_simplified": hull.simplified,
        "noise": round(segments.noise, 4),
        "share_noise": round(noisy, 4),
    }
    frame = evidence.ground_height, segments.origin, evidence.outline
    blocks = block_levels(hull.partition, segments.coefficients, *frame)
    status, reason = (Status.DEGRADED, hull.reason) if hull.reason else (Status.DONE, "")
    return Candidate(METHOD, hull.solid, segments.roof_planes(), blocks, status, reason, notes)


@dataclass(frozen=True, slots=True)
class _Hull:
    """A hull, its partition in plan, its number of columns over voids, how often it was simplified and why."""

    solid: Polyhedron
    partition: RoofPartition
    voids: int = 0
    simplified: int = 0
    reason: str = ""


@dataclass(frozen=True, slots=True)
class _Scene:
    """One unit's surfaces, outline and façades in the local frame."""

    evidence: Evidence
    segments: PlaneSegments
    outline: Polygon
    cloud: FacadeCloud
    facades: list[Facade]

    def hull(self, lines: list[CutLine], parameters: VolumetricParameters) -> _Hull | str:
        """Columns and the hull around them, or the fault that remains.

        Each further attempt asks more of every edge and of every polygon's width.
        """
        frame = self.evidence.ground_height, self.segments.origin, self.evidence.outline
        for attempt in range(ATTEMPTS):
            asked = coarser(parameters.columns, attempt)
            energy = TopEnergy(self.segments, asked, self.outline.area)
            partition = partition_along(self.outline, lines, energy, asked)
            solid = assemble(partition, self.segments.coefficients, *frame)
            faults = check_polyhedron(solid)
            if not faults:
                break
        if faults:
            return str(faults[0])
        reason = f"roof simplified {attempt} times until the solid was valid" if attempt else ""
        return self._with_voids(_Hull(solid, partition, 0, attempt, reason), parameters)

    def _with_voids(self, hull: _Hull, parameters: VolumetricParameters) -> _Hull:
        """The hull with what is open under it, where walls behind a void are seen."""
        division, surface = hull.partition.subdivision()
        floor = self.evidence.ground_height - self.segments.origin[2]
        seen = SeenFacades(self.cloud, self.facades, self.outline, floor)
        voids = find_voids(division, surface, self.segments, seen, parameters.undersides)
        if not voids.ceiling:
            return hull
        columns = standing_columns(division, voids.surface, voids.ceiling, self.segments.coefficients, floor)
        frame = self.evidence.ground_height, self.segments.origin, self.evidence.outline
        solid = build_hull(division, columns, *frame)
        if check_polyhedron(solid):
            return replace(hull, reason="the hull above a passage was not valid: it is closed down to the ground")
        return replace(hull, solid=solid, voids=sum(c.bottom is not None for c in columns.values()))

"""Roof overhang of a unit beyond each wall, from the rims in its surface model (Frommholz et al. 2017, section 4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import EdgeOverhang, Polyhedron
from cityflow.core.grid import grown
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.geometry.recent import remembered
from cityflow.geometry.straight_edges import WallEdge, wall_edges
from cityflow.reconstruction.overhangs.faces_at_edges import BESIDE_M, face_planes, faces_beside
from cityflow.reconstruction.overhangs.known_rims import with_known_rim
from cityflow.reconstruction.overhangs.outline_uncertainty import outline_sigma
from cityflow.reconstruction.overhangs.overhang_parameters import OverhangParameters
from cityflow.reconstruction.overhangs.picture_rims import Colours, colour_rim, colours_over
from cityflow.reconstruction.overhangs.point_rims import NOT_SEEN, point_rim, roofs_around
from cityflow.reconstruction.overhangs.rim_decision import RimOfEdge, decided, unseen
from cityflow.reconstruction.overhangs.standing_wall import standing_wall
from cityflow.reconstruction.overhangs.surface_rims import Profiles, RimLimits, SurfaceEdges, rims_along, surface_edges

INWARD_M = 0.4
"""A rim may lie so far inside an outline that stands too far out; set by hand, as are those below."""
APART_M, MOST_PROFILES = 0.08, 2000
"""Profiles along an edge are no nearer, and no more of them are made; bounds time."""
LEVEL_EAVE = 0.1
"""The roof rises along an eave by less than this; along a verge by more."""


def find_overhangs(
    evidence: Evidence, candidate: Candidate, parameters: OverhangParameters | None = None
) -> tuple[EdgeOverhang, ...]:
    """One overhang per straight edge of the outline, by the line of its wall; 0 where there is none, or none that can be told from none.

    The line of an overhang is the edge, or parallel to it where façades show that the wall stands elsewhere. Where neither is known nothing is
    stated: no reach, no standard deviation.

    Parameters
    ----------
    candidate : its solid tells where the roof's planes are
    """
    p = parameters or OverhangParameters()
    edges = wall_edges(evidence.outline, evidence.party)
    if candidate.solid is None:
        return tuple(EdgeOverhang(edge.line, 0.0) for edge in edges)
    scanned = evidence.heights is None or evidence.heights.grid.cell > p.coarsest_cell_m
    rims = (_rims_of_points if scanned else _rims_of_surface)(evidence, candidate, edges, p)
    rims = [with_known_rim(rim, evidence.rims, p) for rim in rims]
    lowest = _roof_along(edges, candidate)
    default_sigma_m = outline_sigma(rims, p)
    walls = [
        standing_wall(edge, evidence, z, p, default_sigma_m, scanned and not evidence.alike_m)
        for edge, z in zip(edges, lowest, strict=True)
    ]
    return decided(rims, walls, p)


def _rims_of_surface(
    evidence: Evidence, candidate: Candidate, edges: Sequence[WallEdge], p: OverhangParameters
) -> list[RimOfEdge]:
    """Rims that the surface model and the orthos show."""
    near = grown(evidence.outline.bounds, p.most_reach_m + 1.0)
    surface = surface_edges(evidence.heights, near, p.smoothing_cells) if evidence.heights is not None else None
    if surface is None:
        return [unseen(edge) for edge in edges]
    profiles, owner = _profiles(edges, candidate, surface)
    cell = surface.grid.cell
    limits = RimLimits(-INWARD_M, p.most_reach_m + p.widened_cells * cell, p.least_drop_m, p.on_roof_m)
    places = rims_along(profiles, surface, limits)
    rims = [_rim(edge, profiles, places, owner == k, cell, p) for k, edge in enumerate(edges)]
    colours = colours_over(evidence.pictures, near, cell) if p.picture_window_cells > 0 else None
    if colours is not None:
        rims = [_refined(rim, profiles.crossing[owner == k], colours, cell, p) for k, rim in enumerate(rims)]
    return rims


def _rims_of_points(
    evidence: Evidence, candidate: Candidate, edges: Sequence[WallEdge], p: OverhangParameters
) -> list[RimOfEdge]:
    """Rims by roof points beyond the walls."""
    xyz = roofs_around(evidence).xyz
    limits = p.most_reach_m, p.point_on_roof_m, p.point_sigma_m
    rims = []
    for edge in edges:
        found, eave = NOT_SEEN, False
        if not edge.party and len(xyz):
            along = np.clip((xyz[:, :2] - edge.start) @ edge.along, 0.0, edge.length)
            # what stands before or behind an edge has the crossing of its end
            along, of_crossing = np.unique(along, return_inverse=True)
            crossing = edge.start + along[:, None] * edge.along
            plane = _planes_over(crossing, np.broadcast_to(edge.outward, crossing.shape), candidate)
            crossing, plane = crossing[of_crossing], plane[of_crossing]
            beyond = (xyz[:, :2] - crossing) @ edge.outward
            found = point_rim(edge, plane[:, 0] + beyond * plane[:, 1], xyz, limits)
            eave = float(np.ptp(plane[:, 0])) < LEVEL_EAVE * edge.length
        rims.append(
            RimOfEdge(edge, found.reach_m, found.sigma_m, found.sigma_m, found.seen, eave, found.reach_m, False)
        )
    return rims


def _profiles(edges: Sequence[WallEdge], candidate: Candidate, surface: SurfaceEdges) -> tuple[Profiles, IntArray]:
    """Profiles about a cell apart along all edges that touch no neighbour, and the edge of each."""
    total = sum(edge.length for edge in edges if not edge.party)
    step = max(surface.grid.cell, APART_M, total / MOST_PROFILES)
    crossings, outward, owner = [np.empty((0, 2))], [np.empty((0, 2))], [np.empty(0, np.int64)]
    for number, edge in enumerate(edges):
        count = 0 if edge.party else int(edge.length / step)
        place = (np.arange(count) + 0.5) * (edge.length / max(count, 1))
        crossings.append(edge.start + place[:, None] * edge.along)
        outward.append(np.broadcast_to(edge.outward, (count, 2)))
        owner.append(np.full(count, number))
    crossing, out = np.concatenate(crossings), np.concatenate(outward)
    return Profiles(crossing, out, _planes_over(crossing, out, candidate)), np.concatenate(owner)


def _roof_along(edges: Sequence[WallEdge], candidate: Candidate) -> list[float]:
    """World height of the roof where it is lowest along each edge; NaN where there is none."""
    share = np.array([[0.1], [0.5], [0.9]])
    crossings = np.concatenate([edge.start + share * edge.length * edge.along for edge in edges])
    height = _planes_over(crossings, np.repeat([edge.outward for edge in edges], len(share), axis=0), candidate)[:, 0]
    return list(np.fmin.reduce(height.reshape(len(edges), -1), axis=1).tolist())


def _planes_over(crossing: FloatArray, outward: FloatArray, candidate: Candidate) -> FloatArray:
    """(N, 2) height of the roof's plane over each crossing, and its slope outwards."""
    solid = candidate.solid
    if solid is None or not len(crossing):
        return np.full((len(crossing), 2), np.nan)
    origin, polygons, planes = _faces_of(solid)
    local = crossing - origin[:2]
    face = faces_beside(polygons, local - BESIDE_M * outward)
    a, b, c = planes[face].T
    height = a * local[:, 0] + b * local[:, 1] + c + origin[2]
    return np.where((face >= 0)[:, None], np.column_stack([height, a * outward[:, 0] + b * outward[:, 1]]), np.nan)


@remembered
def _faces_of(solid: Polyhedron) -> tuple[FloatArray, list[Polygon], FloatArray]:
    """A local origin, and the roof's faces and planes in its frame: every edge asks for them."""
    origin = np.floor(solid.vertices.min(axis=0))
    polygons, planes = face_planes(solid, origin)
    shapely.prepare(polygons)
    return origin, polygons, planes


def _rim(
    edge: WallEdge, profiles: Profiles, places: FloatArray, own: np.ndarray, cell: float, p: OverhangParameters
) -> RimOfEdge:
    """The middle of what an edge's profiles say."""
    count = int(np.count_nonzero(own))
    found = places[own]
    found = found[np.isfinite(found)]
    height = profiles.plane[own, 0]
    rise = abs(float(height[-1] - height[0])) / edge.length if count > 1 else 0.0
    eave = bool(np.isfinite(rise) and rise < LEVEL_EAVE)
    if not len(found):
        return unseen(edge, eave=eave)
    middle = float(np.median(found))
    spread = max(1.4826 * float(np.median(np.abs(found - middle))), 0.15 * cell)
    patches = max(1.0, len(found) * edge.length / max(count, 1) / (p.patch_cells * cell))
    chance = 1.25 * spread / float(np.sqrt(patches))
    sigma = float(np.hypot(chance, p.widened_sigma_cells * cell))
    reach = middle - p.widened_cells * cell
    return RimOfEdge(edge, reach, sigma, chance, len(found) / count, eave, reach, False)


def _refined(rim: RimOfEdge, crossings: FloatArray, colours: Colours, cell: float, p: OverhangParameters) -> RimOfEdge:
    """The rim of the heights and that of the colours, each by its precision."""
    if not np.isfinite(rim.reach_m):
        return rim
    window = rim.reach_m, p.picture_inside_cells * cell, p.picture_window_cells * cell
    place = colour_rim(crossings, rim.edge.outward, window, colours)
    if not np.isfinite(place):
        return rim
    of_heights, of_colours = rim.sigma_m**-2, (p.picture_sigma_cells * colours.grid.cell) ** -2
    both = of_heights + of_colours
    reach = (of_heights * rim.reach_m + of_colours * place) / both
    # both err alike where pictures match badly, so that together they are no more exact than the better one
    spread = float(np.hypot(max(of_heights, of_colours) ** -0.5, (place - rim.reach_m) / 4.0))
    return replace(rim, reach_m=reach, sigma_m=spread, nearest_m=min(rim.reach_m, place), confirmed=True)

"""The roof polygons that a skeleton bounds, and whether they are what the cells say."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import shapely
from pydantic import Field
from shapely import LineString

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.reconstruction.monolithic_parts.cell_grid import CellPoints
from cityflow.reconstruction.monolithic_parts.cell_groups import NONE
from cityflow.reconstruction.monolithic_parts.skeleton_values import Frame, Inconsistency, Skeleton
from cityflow.reconstruction.partition.partition_values import RoofPartition
from cityflow.reconstruction.partition.subdivision import Subdivision
from cityflow.reconstruction.solids.corner_heights import SAME_HEIGHT
from cityflow.reconstruction.solids.ring_tracing import Edge, ring_edges

RIM_M = 0.5
"""Cells nearer to the outline are not judged: eaves and gutters, m; set by hand."""
MIN_AGREEMENT = 0.85
"""Share of the cells that lie in their own surface's face; set by hand, as is the next."""
INSTALLATION_M2 = 2.0
"""Larger patches of cells off the roof are no installation, m²."""

OFF_M = 0.15
"""Cells farther off the roof than this and 3 sigma are off it, metres; set by hand."""


class FaceParameters(Parameters):
    """What the finished roof must agree with."""

    min_explained: float = Field(0.85, ge=0, le=1, description="share of the cells that lie on the roof")


def cut_in_faces(skeleton: Skeleton, frame: Frame) -> RoofPartition:
    """The outline cut along the skeleton, one roof polygon for each surface; labels are numbers of planes.

    Raises
    ------
    Inconsistency
    """
    topology = skeleton.topology
    division = Subdivision.of_polygon(frame.outline)
    vertex = _vertices(division, skeleton, frame)
    chords: dict[Edge, int] = {}
    for edge in topology.edges:
        if not edge.inner():
            continue
        u, v = vertex[edge.start], vertex[edge.end]
        if u == v or (u, v) in chords or (u, v) in division.left or (v, u) in division.left:
            raise Inconsistency("a face without area")
        chords[u, v], chords[v, u] = edge.left, edge.right
    surfaces = sorted(
        {s for e in topology.edges for s in (e.left, e.right) if s >= 0}
        | {s for p in topology.loops for s in p if s >= 0}
    )
    _check_plane_graph(chords, division, frame)
    parts = division.split(0, [e for e in chords if e[0] < e[1]]) if chords else [0]
    if len(parts) != len(surfaces):
        raise Inconsistency(f"{len(parts)} faces for {len(surfaces)} surfaces")
    labels = {part: _surface_of(division, part, chords, surfaces) for part in parts}
    if len(set(labels.values())) != len(surfaces):
        raise Inconsistency("a surface with several faces")
    planes = {part: topology.plane_of[surface] for part, surface in labels.items()}
    _check_heights(division, planes, skeleton.planes)
    return RoofPartition.of_subdivision(division, planes)


def _vertices(division: Subdivision, skeleton: Skeleton, frame: Frame) -> dict[int, int]:
    """Vertex of the subdivision for each node; those on walls are put into the outline."""
    contour = frame.contour
    found = dict(skeleton.vertex)
    on_wall: dict[int, list[tuple[float, int]]] = {}
    for node, wall in sorted(skeleton.wall.items()):
        if node not in skeleton.vertex:
            start = contour.vertices[wall]
            along = contour.vertices[contour.following[wall]] - start
            t = float((skeleton.place[node] - start) @ along / (along @ along))
            on_wall.setdefault(wall, []).append((t, node))
    for wall, nodes in sorted(on_wall.items()):
        here, end = wall, int(contour.following[wall])
        for _, node in sorted(nodes):
            here = division.insert((here, end), *map(float, skeleton.place[node]))
            found[node] = here
    for node, xy in sorted(skeleton.place.items()):
        if node not in found:
            found[node] = len(division.xy)
            division.xy.append((float(xy[0]), float(xy[1])))
    return found


def _check_plane_graph(chords: dict[Edge, int], division: Subdivision, frame: Frame) -> None:
    """Edges stay within the outline and cross nowhere."""
    edges = [e for e in chords if e[0] < e[1]]
    if not edges:
        return
    lines = np.array([LineString([division.xy[u], division.xy[v]]) for u, v in edges])
    if not shapely.covers(shapely.buffer(frame.outline, 0.02), lines).all():
        raise Inconsistency("an edge that leaves the outline")
    tree = shapely.STRtree(lines)
    for predicate in ("crosses", "overlaps", "covers"):
        a, b = tree.query(lines, predicate=predicate)
        if np.any(a != b):
            raise Inconsistency("edges that cross")


def _surface_of(division: Subdivision, part: int, chords: dict[Edge, int], surfaces: list[int]) -> int:
    if not chords:
        return surfaces[0]
    sides = {chords[e] for ring in division.cells[part] for e in ring_edges(ring) if e in chords}
    if len(sides) != 1:
        raise Inconsistency("a face whose edges belong to several surfaces")
    ring = division.polygon(part)
    if not ring.is_valid or ring.area < 0.05:
        raise Inconsistency("a face is not a simple polygon")
    return sides.pop()


def _check_heights(division: Subdivision, planes: dict[int, int], coefficients: FloatArray) -> None:
    """All faces around a vertex inside or on a wall meet there in one height."""
    heights: dict[int, list[float]] = {}
    for part, plane in planes.items():
        a, b, c = coefficients[plane]
        for v in itertools.chain.from_iterable(division.cells[part]):
            heights.setdefault(v, []).append(a * division.xy[v][0] + b * division.xy[v][1] + c)
    for z in heights.values():
        if max(z) - min(z) > SAME_HEIGHT:
            raise Inconsistency(f"faces are {max(z) - min(z):.2f} m apart in a vertex")


def check_faces(
    partition: RoofPartition, skeleton: Skeleton, cells: CellPoints, labels: IntArray, frame: Frame,
    parameters: FaceParameters,
) -> dict[str, float]:  # fmt: skip
    """Shares of the cells that lie in their own face, and on the roof.

    Parameters
    ----------
    labels : (rows, cols) plane of each cell, negative outside

    Raises
    ------
    Inconsistency
    """
    x, y = (g.ravel() for g in cells.grid.centres())
    face = np.full(len(x), NONE)
    inside = np.flatnonzero(labels.ravel() >= 0)
    for cell in partition.cells:
        polygon = partition.polygon(cell)
        shapely.prepare(polygon)
        face[inside[shapely.contains_xy(polygon, x[inside], y[inside])]] = cell.plane
    used = inside[face[inside] >= 0]
    planes, own = skeleton.planes[face[used]], skeleton.planes[labels.ravel()[used]]
    gap = np.abs((planes - own)[:, 0] * x[used] + (planes - own)[:, 1] * y[used] + (planes - own)[:, 2])
    near = OFF_M + 3 * frame.sigma
    agreement = float(np.mean(gap <= near)) if len(used) else 0.0
    if agreement < MIN_AGREEMENT:
        raise Inconsistency(f"{100 * agreement:.0f} % of the cells lie in the face of their surface")
    return {"agreement": round(agreement, 3), **_explained(cells, used, planes, near, frame, parameters)}


def _explained(
    cells: CellPoints, used: IntArray, planes: FloatArray, near: float, frame: Frame, parameters: FaceParameters
) -> dict[str, float]:
    """Share of the cells within the rim that are near their face, and the largest patch that is not."""
    # along the contour cells see what stands beside, too
    edge = shapely.distance(shapely.points(*(g.ravel()[used] for g in cells.grid.centres())), frame.outline.boundary)
    used, planes = used[edge >= RIM_M], planes[edge >= RIM_M]
    sums = cells.sums[used]
    with np.errstate(invalid="ignore", divide="ignore"):
        n, mx, my, mz = sums[:, 0], *(sums[:, k] / sums[:, 0] for k in (1, 2, 3))
        off = np.abs(mz - planes[:, 0] * mx - planes[:, 1] * my - planes[:, 2])
    far = (n > 0) & (off > near)
    explained = float(1 - far.sum() / max(np.count_nonzero(n > 0), 1))
    image = np.zeros(cells.grid.rows * cells.grid.cols, np.uint8)
    image[used[far]] = 1
    _, _, stats, _ = cv2.connectedComponentsWithStats(image.reshape(cells.grid.shape), connectivity=8)
    patch = float(stats[1:, cv2.CC_STAT_AREA].max(initial=0)) * cells.grid.cell**2
    if explained < parameters.min_explained or patch > INSTALLATION_M2:
        raise Inconsistency(
            f"{100 * explained:.0f} % of the cells lie on the roof; the largest patch off it has {patch:.1f} m²"
        )
    return {"explained": round(explained, 3), "largest_off_m2": round(patch, 2)}

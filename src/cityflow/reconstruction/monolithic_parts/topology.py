"""The topology of a roof from its label image: a 2×2 window finds edges (two labels) and nodes (three or more).

Frommholz 2017, section 3. The outside of the outline is a label like the others, so that the window also finds where an edge
between two surfaces arrives at the contour. Edges are kept as chains between two nodes each, so that two surfaces may meet in
several edges; what a chain looks like is only used to tell what lies where, positions come from the planes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.reconstruction.monolithic_parts.cell_grid import CellPoints
from cityflow.reconstruction.monolithic_parts.cell_groups import NONE
from cityflow.reconstruction.monolithic_parts.roof_cells import OUTSIDE, RoofCells, closed_over

ROUNDS = 20
"""Of cleaning at most; set by hand."""


@dataclass(slots=True)
class TopologicalEdge:
    """Where two surfaces meet, from node `start` to node `end`.

    Attributes
    ----------
    left, right : surfaces on its sides, `OUTSIDE` beyond the outline
    chain : (K, 2) float64, row, col of lattice corners along it, ends included
    """

    start: int
    end: int
    left: int
    right: int
    chain: FloatArray

    def other(self, node: int) -> int:
        return self.end if node == self.start else self.start

    def pair(self) -> tuple[int, int]:
        return min(self.left, self.right), max(self.left, self.right)

    def inner(self) -> bool:
        """Between two surfaces, not on the contour."""
        return self.left >= 0 and self.right >= 0


@dataclass(slots=True)
class Topology:
    """Nodes and edges of one roof.

    Attributes
    ----------
    nodes : node → (row, col) of its lattice corner
    edges : all chains that have two ends
    loops : pairs of surfaces that meet in a closed chain, which has no end
    plane_of : plane of each surface
    """

    nodes: dict[int, tuple[int, int]]
    edges: list[TopologicalEdge]
    loops: list[tuple[int, int]]
    plane_of: list[int]
    at: dict[int, list[TopologicalEdge]] = field(default_factory=dict)

    def refresh(self) -> None:
        """Edges at each node anew."""
        self.at = {node: [] for node in self.nodes}
        for edge in self.edges:
            self.at[edge.start].append(edge)
            if edge.end != edge.start:
                self.at[edge.end].append(edge)

    def surfaces(self, node: int) -> list[int]:
        """Surfaces around a node, without the outside."""
        return sorted({s for e in self.at[node] for s in (e.left, e.right) if s >= 0})

    def on_contour(self, node: int) -> bool:
        return any(not e.inner() for e in self.at[node])

    def inner_edges(self, node: int) -> list[TopologicalEdge]:
        return [e for e in self.at[node] if e.inner()]


@dataclass(frozen=True, slots=True)
class SurfaceImage:
    """Connected surfaces of cells.

    Attributes
    ----------
    labels : (rows, cols) int64, number of the surface, `OUTSIDE`
    plane_of : plane of each surface
    """

    labels: IntArray
    plane_of: list[int]

    def plane_labels(self) -> IntArray:
        """(rows, cols) plane of each cell, `OUTSIDE` beyond the outline."""
        return np.where(self.labels >= 0, np.array([*self.plane_of, OUTSIDE])[np.maximum(self.labels, -1)], OUTSIDE)


def surface_image(roof: RoofCells, cells: CellPoints, sigma: float, least: float) -> SurfaceImage:
    """Surfaces connected by cells' sides, without specks and without cells that touch by their corners only."""
    labels = np.where(roof.labels == NONE, OUTSIDE, roof.labels)
    for _ in range(ROUNDS):
        labels = _without_corner_contacts(labels)
        specks = _specks(labels, least)
        if not specks.any():
            break
        labels = closed_over(cells, np.where(specks, NONE, labels), roof.planes, sigma)
        labels = np.where(labels == NONE, OUTSIDE, labels)
    surfaces = np.full(labels.shape, OUTSIDE)
    plane_of: list[int] = []
    for label in range(len(roof.planes)):
        count, parts = cv2.connectedComponents((labels == label).astype(np.uint8), connectivity=4)
        for part in range(1, count):
            surfaces[parts == part] = len(plane_of)
            plane_of.append(label)
    return SurfaceImage(surfaces, plane_of)


def _specks(labels: IntArray, least: float) -> np.ndarray:
    """Cells of parts that are too small; the largest part of all is none."""
    found, parts_seen = np.zeros(labels.shape, bool), []
    for label in range(int(labels.max()) + 1):
        _, parts, stats, _ = cv2.connectedComponentsWithStats((labels == label).astype(np.uint8), connectivity=4)
        for part in range(1, len(stats)):
            area = int(stats[part, cv2.CC_STAT_AREA])
            parts_seen.append((area, label, part))
            if area < least:
                found |= parts == part
    if parts_seen and max(parts_seen)[0] < least:
        return np.zeros(labels.shape, bool)
    return found


def _without_corner_contacts(labels: IntArray) -> IntArray:
    """The image after every 2×2 window of two labels crosswise has had one cell changed."""
    labels = labels.copy()
    for _ in range(ROUNDS):
        a, b, c, d = labels[:-1, :-1], labels[:-1, 1:], labels[1:, :-1], labels[1:, 1:]
        cross = np.argwhere((a == d) & (b == c) & (a != b) & (a >= 0) & (b >= 0))
        if len(cross) == 0:
            break
        for r, col in cross:
            window = labels[r : r + 2, col : col + 2]
            if window[0, 0] == window[1, 1] and window[0, 1] == window[1, 0] and window[0, 0] != window[0, 1]:
                labels[r, col + 1] = labels[r, col]
    return labels


def find_topology(image: SurfaceImage) -> Topology:
    """Nodes and edges of a label image by a 2×2 window shifted over it."""
    cracks = _cracks(image.labels)
    starts = _node_corners(image.labels)
    number = {corner: k for k, corner in enumerate(starts)}
    nodes = dict(enumerate(starts))
    edges: list[TopologicalEdge] = []
    used: set[tuple[tuple[int, int], tuple[int, int]]] = set()
    for corner in starts:
        for after in sorted(cracks[corner]):
            if (corner, after) not in used:
                edges.append(_chain(corner, after, cracks, number, used))
    loops = _loops(cracks, used)
    topology = Topology(nodes, edges, loops, list(image.plane_of))
    topology.refresh()
    return topology


Corner = tuple[int, int]
Cracks = dict[Corner, dict[Corner, tuple[int, int]]]


def _cracks(labels: IntArray) -> Cracks:
    """From each lattice corner to the next ones along sides between cells of different labels: labels left and right."""
    found: Cracks = {}
    # rows grow northwards and columns eastwards: going north the west cell is on the left, going east the north one
    for r, c in np.argwhere(labels[:, 1:] != labels[:, :-1]):
        west, east = int(labels[r, c]), int(labels[r, c + 1])
        low, high = (int(r), int(c) + 1), (int(r) + 1, int(c) + 1)
        found.setdefault(low, {})[high] = (west, east)
        found.setdefault(high, {})[low] = (east, west)
    for r, c in np.argwhere(labels[1:] != labels[:-1]):
        south, north = int(labels[r, c]), int(labels[r + 1, c])
        low, high = (int(r) + 1, int(c)), (int(r) + 1, int(c) + 1)
        found.setdefault(low, {})[high] = (north, south)
        found.setdefault(high, {})[low] = (south, north)
    return found


def _node_corners(labels: IntArray) -> list[Corner]:
    """Corners whose four cells have three labels or more, or two crosswise."""
    four = np.stack([labels[:-1, :-1], labels[:-1, 1:], labels[1:, 1:], labels[1:, :-1]], axis=-1)
    changes = np.count_nonzero(four != np.roll(four, 1, axis=-1), axis=-1)
    return [(int(r) + 1, int(c) + 1) for r, c in np.argwhere(changes > 2)]


def _chain(
    corner: Corner, after: Corner, cracks: Cracks, number: dict[Corner, int], used: set[tuple[Corner, Corner]]
) -> TopologicalEdge:
    """The chain of sides from a node to the next one."""
    left, right = cracks[corner][after]
    path, before, here = [corner], corner, after
    while True:
        used.add((before, here))
        used.add((here, before))
        path.append(here)
        if here in number:
            break
        before, here = here, next(c for c in sorted(cracks[here]) if c != before)
    return TopologicalEdge(number[corner], number[here], left, right, np.array(path, np.float64))


def _loops(cracks: Cracks, used: set[tuple[Corner, Corner]]) -> list[tuple[int, int]]:
    found = []
    for corner in sorted(cracks):
        for after in sorted(cracks[corner]):
            if (corner, after) in used:
                continue
            pair = cracks[corner][after]
            before, here = corner, after
            while (before, here) not in used:
                used.add((before, here))
                used.add((here, before))
                onward = [c for c in sorted(cracks[here]) if c != before]
                before, here = here, onward[0]
            found.append((min(pair), max(pair)))
    return found


def flipped(topology: Topology, edge: TopologicalEdge) -> bool:
    """Let the surfaces at the ends of an edge meet in it instead of those on its sides; False where that cannot be.

    Of two nodes that are nearer to each other than the cells are large the image may tell wrongly which surfaces meet.
    """
    n1, n2 = edge.start, edge.end
    here = [e for e in topology.at[n1] if e is not edge]
    there = [e for e in topology.at[n2] if e is not edge]
    if n1 == n2 or len(here) != 2 or len(there) != 2:
        return False
    behind = {s for e in here for s in (e.left, e.right)} - {edge.left, edge.right}
    ahead = {s for e in there for s in (e.left, e.right)} - {edge.left, edge.right}
    if len(behind) != 1 or len(ahead) != 1 or behind == ahead:
        return False
    on_left = [e for e in there if edge.left in (e.left, e.right)]
    on_right = [e for e in here if edge.right in (e.left, e.right)]
    if len(on_left) != 1 or len(on_right) != 1:
        return False
    _move_end(on_left[0], n2, n1)
    _move_end(on_right[0], n1, n2)
    edge.left, edge.right = ahead.pop(), behind.pop()
    topology.refresh()
    return True


def _move_end(edge: TopologicalEdge, old: int, new: int) -> None:
    if edge.start == old:
        edge.start = new
    else:
        edge.end = new


def contracted(topology: Topology, edge: TopologicalEdge) -> None:
    """Make one node of both ends of an edge."""
    keep, gone = edge.start, edge.end
    topology.edges.remove(edge)
    for other in topology.edges:
        if other.start == gone:
            other.start = keep
        if other.end == gone:
            other.end = keep
    del topology.nodes[gone]
    topology.refresh()


def copied(topology: Topology) -> Topology:
    """A copy whose edges can be changed."""
    result = Topology(
        dict(topology.nodes), [replace(e) for e in topology.edges], list(topology.loops), list(topology.plane_of)
    )
    result.refresh()
    return result

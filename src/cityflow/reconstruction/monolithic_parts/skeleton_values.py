"""What a roof's skeleton is, and the frame that it stands in."""

from __future__ import annotations

from dataclasses import dataclass, field

from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.monolithic_parts.cell_grid import CellGrid
from cityflow.reconstruction.monolithic_parts.contour_scan import Arris, Contour
from cityflow.reconstruction.monolithic_parts.topology import Topology


class Inconsistency(Exception):
    """Topology and intersections contradict each other; the message says how."""


REACH_CELLS = 3.0
"""A chain of cells is no farther from its line, cells; set by hand, as are those below."""
NODE_CELLS = 6.0
"""A node is no farther from where the cells have it, cells."""
LEVEL_M = 0.12
"""Planes that differ by less along a chain may meet anywhere, m."""
SAME_NODE_M = 0.25
"""Nodes nearer than this are one, and an edge that arrives so near a corner arrives in it, m."""
TIE_M = 0.15
"""Most that a plane moves at a node to pass through it, m."""
SPREAD_M = 0.5
"""Lines that meet in a node pass each other within this, m."""


@dataclass(slots=True)
class Skeleton:
    """Nodes in plan, edges between them, planes through them.

    Attributes
    ----------
    topology : as it is after corrections
    planes : (P, 3) float64, local
    place : node → (2,) position in plan, local metres
    wall : node → wall of the contour that it stands on, for nodes on a wall
    vertex : node → vertex of the contour that it coincides with
    flips, merged, ties : numbers of corrections
    """

    topology: Topology
    planes: FloatArray
    place: dict[int, FloatArray] = field(default_factory=dict)
    wall: dict[int, int] = field(default_factory=dict)
    vertex: dict[int, int] = field(default_factory=dict)
    flips: int = 0
    merged: int = 0
    ties: int = 0


@dataclass(frozen=True, slots=True)
class Frame:
    """What does not change while a skeleton is built.

    Attributes
    ----------
    grid, outline, contour : local
    arrises : changes of surface along the contour
    sums : (P, 10) sums over the points of each plane
    sigma : noise and unevenness, metres
    """

    grid: CellGrid
    outline: Polygon
    contour: Contour
    arrises: list[Arris]
    sums: FloatArray
    sigma: float

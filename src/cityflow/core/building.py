"""The building: outline, planes, closed polyhedra per level of detail, status."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.unit_status import Scalar as Scalar
from cityflow.core.unit_status import Status as Status

OUTLINE_SIGMA_M = 0.1
"""Standard deviation of outlines across their edges where nothing tells it, metres: cadastres state 3 to 30 cm."""
EAVE_SPREAD_M = 0.25
"""How much eaves of one building differ from each other (standard deviation), metres."""

VERTEX_DECIMALS = 4
"""Vertices are multiples of 0.1 mm: rounding to 1 mm alone has broken the validity of solids."""


class Semantic(StrEnum):
    """Semantic surface types, by the names that CityGML and CityJSON share."""

    GROUND = "GroundSurface"
    ROOF = "RoofSurface"
    WALL = "WallSurface"
    OUTER_CEILING = "OuterCeilingSurface"
    OUTER_FLOOR = "OuterFloorSurface"


class Lod(StrEnum):
    """Levels of detail after Biljecki's refined series."""

    LOD0 = "0"
    LOD12 = "1.2"
    LOD13 = "1.3"
    LOD22 = "2.2"


@dataclass(frozen=True, slots=True)
class Face:
    """A planar polygon of a polyhedron.

    Attributes
    ----------
    rings : exterior ring, then holes; vertex indices without the repeated last one. Seen from outside the solid the
        exterior runs counter-clockwise, the holes clockwise.
    semantic : Semantic
    plane : index into `Building.planes` for roof faces found as planes, -1 otherwise
    neighbour : id of the unit on the other side of a party wall, else None
    points : number of points that show it, 0 where it follows from others; None where they were not counted
    """

    rings: tuple[tuple[int, ...], ...]
    semantic: Semantic
    plane: int = -1
    neighbour: str | None = None
    points: int | None = None


@dataclass(frozen=True, slots=True)
class Polyhedron:
    """One closed shell: (V, 3) float64 vertices in the world frame (metres, multiples of 0.1 mm), and its faces."""

    vertices: FloatArray
    faces: tuple[Face, ...]

    def ring(self, indices: tuple[int, ...]) -> FloatArray:
        """(n, 3) vertices of a ring."""
        return self.vertices[list(indices)]

    def of_semantic(self, semantic: Semantic) -> tuple[Face, ...]:
        return tuple(f for f in self.faces if f.semantic is semantic)


@dataclass(frozen=True, slots=True)
class RoofPlane:
    """A plane z = slope_x·(x − x0) + slope_y·(y − y0) + height over the unit's local origin (x0, y0).

    Attributes
    ----------
    slope_x, slope_y : float, dimensionless
    height : float, world height (metres) at the origin
    origin : (x0, y0), world metres
    points : number of points that support the plane
    rmse : metres, of these points' vertical distances
    sigma_height : metres, standard deviation of the plane's height in the middle of its points, errors of neighbours taken as alike; NaN where unknown
    sigma_slope_deg : degrees, standard deviation of its slope along the steepest descent; NaN where unknown
    seen : share of its roof faces' area that points cover; what lies beyond is the plane, extended
    """

    slope_x: float
    slope_y: float
    height: float
    origin: tuple[float, float]
    points: int = 0
    rmse: float = float("nan")
    sigma_height: float = float("nan")
    sigma_slope_deg: float = float("nan")
    seen: float = 1.0

    def z(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """World heights of the plane at world x, y."""
        return np.asarray(self.slope_x * (x - self.origin[0]) + self.slope_y * (y - self.origin[1]) + self.height)

    @property
    def slope_deg(self) -> float:
        return float(np.degrees(np.arctan(np.hypot(self.slope_x, self.slope_y))))

    @property
    def aspect_deg(self) -> float:
        """Direction of steepest descent, clockwise from north, 0 to 360; NaN for a level plane."""
        if self.slope_x == 0 and self.slope_y == 0:
            return float("nan")
        return float(np.degrees(np.arctan2(-self.slope_x, -self.slope_y)) % 360)


@dataclass(frozen=True, slots=True)
class OutlineEdge:
    """A straight part of an outline, or a wall inside it, and how it is known.

    Attributes
    ----------
    line : LineString in plan, world metres
    source : ``wall`` (points on the façade), ``roof`` (edge of the roof region), ``given``
    sigma_m : standard deviation across the line; NaN where nothing tells
    seen : share of its length along which façade points stand, 0 to 1
    """

    line: LineString
    source: str
    sigma_m: float = float("nan")
    seen: float = 0.0


@dataclass(frozen=True, slots=True)
class Direction:
    """A principal aspect (degrees from east, counter-clockwise, 0 to 180, of lines in plan) or slope (0 to 90), with its precision.

    Attributes
    ----------
    degrees, sigma : degrees
    weight : share of the evidence that follows it, 0 to 1
    """

    degrees: float
    sigma: float
    weight: float


@dataclass(frozen=True, slots=True)
class Outline:
    """A building outline in plan.

    Attributes
    ----------
    id : stable under reruns; from the given data's id column, else from geometry
    polygon : shapely Polygon, world metres, exterior counter-clockwise, holes clockwise; neighbours are noded, so that
        both have every vertex of their common boundary, bit for bit
    attributes : everything the source said of it
    remark : what was repaired, or empty
    roof : outline of the roof where it is known apart from the walls; `polygon` is then that of the walls
    edges : of the polygon, and how each is known; empty if not requested
    inner_edges : walls that rise above a lower roof within the outline
    aspects, slopes : principal directions of what stands inside, where they were found
    party : the edges that it shares with other outlines
    rims : edges of the roof that the polygon had before its walls moved in
    """

    id: str
    polygon: Polygon
    attributes: Mapping[str, Scalar] = field(default_factory=dict)
    remark: str = ""
    roof: Polygon | None = None
    edges: tuple[OutlineEdge, ...] = ()
    inner_edges: tuple[OutlineEdge, ...] = ()
    aspects: tuple[Direction, ...] = ()
    slopes: tuple[Direction, ...] = ()
    party: tuple[LineString, ...] = ()
    rims: tuple[OutlineEdge, ...] = ()


@dataclass(frozen=True, slots=True)
class EdgeOverhang:
    """How far the roof stands out beyond one straight part of the outline.

    Attributes
    ----------
    line : the part, world, in the outline's direction (the outside is on its right)
    reach_m : metres, square to the line; 0 where the roof ends with the wall
    sigma_m : standard deviation; NaN where nothing was measured
    seen : share of the line where the rim of the roof was found, 0 to 1
    """

    line: LineString
    reach_m: float
    sigma_m: float = float("nan")
    seen: float = 0.0


@dataclass(frozen=True, slots=True)
class Installation:
    """Something fixed to a unit from outside.

    Attributes
    ----------
    kind : ``balcony``, no part of the unit's solid, or ``dormer``, whose faces are the solid's
    surfaces : an open polyhedron, its faces seen from outside; a side that nothing shows is missing
    points : number of points of its front, or of its roof
    """

    kind: str
    surfaces: Polyhedron
    points: int

    @property
    def is_of_solid(self) -> bool:
        """Whether the solid shows it already."""
        return self.kind == "dormer"


@dataclass(frozen=True, slots=True)
class Building:
    """A finished unit.

    Attributes
    ----------
    id : unit id
    footprint : LoD0 polygon in plan
    ground_height : metres, of LoD0 and of the floor of all solids
    solids : closed polyhedra by level of detail (LoD1.2, 1.3, 2.2)
    planes : roof planes of LoD2.2
    attributes : attributes of the source and measured ones
    overhangs : edges beyond which the roof stands out
    beyond : its surfaces there, an open polyhedron: roofs in the planes of LoD2.2, rims, outer ceilings; the solids end at the walls
    installations : what is fixed to its façades
    """

    id: str
    footprint: Polygon
    ground_height: float
    solids: Mapping[Lod, Polyhedron]
    planes: tuple[RoofPlane, ...] = ()
    attributes: Mapping[str, Scalar] = field(default_factory=dict)
    status: Status = Status.DONE
    reason: str = ""
    overhangs: tuple[EdgeOverhang, ...] = ()
    beyond: Polyhedron | None = None
    installations: tuple[Installation, ...] = ()

    def with_attributes(self, more: Mapping[str, Scalar]) -> Building:
        return replace(self, attributes={**self.attributes, **more})

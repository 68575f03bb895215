"""Input and output of reconstruction methods: evidence and candidate."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import (
    Direction,
    EdgeOverhang,
    Installation,
    Lod,
    OutlineEdge,
    Polyhedron,
    RoofPlane,
    Scalar,
    Status,
)
from cityflow.core.colour_image import ColourImage
from cityflow.core.facade_points import WallPoints, joined_walls
from cityflow.core.grid import Grid
from cityflow.core.points import PointCloud


@dataclass(frozen=True, slots=True)
class HeightRaster:
    """Surface and terrain over a unit and a few metres around it.

    Attributes
    ----------
    grid : world
    dsm : (rows, cols) float64, metres; NaN where nothing is known
    dtm : (rows, cols) float64, metres; NaN where nothing is known
    """

    grid: Grid
    dsm: FloatArray
    dtm: FloatArray


@dataclass(frozen=True, slots=True)
class Picture:
    """An orthophoto over a unit and a few metres around it.

    Attributes
    ----------
    grid : world; finer than that of the heights, or the same
    pixels : (bands, rows, cols) uint8 or uint16; the first three are red, green, blue, one alone is grey
    true : a true ortho (roofs stand over their walls), not a plain one
    name : of the epoch or file
    """

    grid: Grid
    pixels: NDArray[np.uint8] | NDArray[np.uint16]
    true: bool = True
    name: str = ""


@dataclass(frozen=True, slots=True)
class Evidence:
    """All that a reconstruction method may look at for one unit. Only the first four are always there.

    Attributes
    ----------
    id : unit id
    outline : Polygon, as in `Outline`: where the walls stand, as far as that is known
    points : roof points inside the outline, world frame (building class, or high and not vegetation)
    ground_height : metres, the floor of the solid: lowest DTM height along the outline
    aspects, slopes : principal directions found while the outline was split; a prior, and only that
    around : all points of the unit and of 2 m around it that are neither ground, vegetation nor noise: roofs, façades, what is between
    walls : points known to be on façades, within 2 m of the outline
    heights : DSM and DTM, or None where there are no rasters
    pictures : orthos, one for each epoch
    photographs : oriented images that have the unit in their frame
    party : the parts of the outline that another unit's outline touches
    edges : straight parts of the outline and how each is known; empty if not requested
    roof : outline of the roof where it is known apart from the walls
    rims : edges of the roof that walls have moved in from
    matched : points are of a surface that was matched or given, not a scanner's
    wanted_type : roof type that a person has set, or empty
    alike_m : errors of points this near to each other are alike (the cells of a given DSM), metres; 0: each point has its own
    covered : (M, 3) world metres, points of level surfaces under something higher: the ground of an arcade, the floor of a loggia
    """

    id: str
    outline: Polygon
    points: PointCloud
    ground_height: float
    aspects: tuple[Direction, ...] = ()
    slopes: tuple[Direction, ...] = ()
    around: PointCloud = field(default_factory=PointCloud.empty)
    walls: WallPoints = field(default_factory=lambda: joined_walls(()))
    heights: HeightRaster | None = None
    pictures: tuple[Picture, ...] = ()
    party: tuple[LineString, ...] = ()
    edges: tuple[OutlineEdge, ...] = ()
    roof: Polygon | None = None
    wanted_type: str = ""
    alike_m: float = 0.0
    rims: tuple[OutlineEdge, ...] = ()
    matched: bool = False
    covered: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    photographs: tuple[ColourImage, ...] = ()

    @property
    def observations(self) -> float:
        """How many independent points the unit's points are worth."""
        n = float(len(self.points))
        return min(n, self.outline.area / self.alike_m**2) if self.alike_m > 0 else n


@dataclass(frozen=True, slots=True)
class Candidate:
    """One method's answer for one unit.

    Attributes
    ----------
    method : name as in the workflow
    solid : closed LoD2.2 polyhedron, or None where the method found no answer
    planes : roof planes that the faces' `plane` refers to
    blocks : the same unit at lower levels of detail (LoD1.2, 1.3), where the method makes them
    status : DONE, or DEGRADED for a simpler roof than the points ask for
    reason : why degraded, or why there is no solid
    notes : figures worth recording (numbers of regions, iterations, …)
    overhangs : as far as they are known
    beyond : surfaces of the roof beyond the walls, an open polyhedron beside the solid, which ends at the walls
    roof_type : what the method itself found, by the names of `core.roof_type_names`; empty where it does not know
    numbers : how many numbers describe its roof; None: three for each face
    installations : what is fixed to its façades
    """

    method: str
    solid: Polyhedron | None
    planes: tuple[RoofPlane, ...] = ()
    blocks: Mapping[Lod, Polyhedron] = field(default_factory=dict)
    status: Status = Status.DONE
    reason: str = ""
    notes: Mapping[str, Scalar] = field(default_factory=dict)
    overhangs: tuple[EdgeOverhang, ...] = ()
    beyond: Polyhedron | None = None
    roof_type: str = ""
    numbers: int | None = None
    installations: tuple[Installation, ...] = ()

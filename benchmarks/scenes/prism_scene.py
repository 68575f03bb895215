"""Scenes of buildings of known shape on known ground, which the scanner of the town scans, too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.synthetic.known_terrain import Terrain
from cityflow.synthetic.mesh import Material, Part, TownMesh
from cityflow.synthetic.prisms import add_prism
from cityflow.synthetic.roofs import TruthFace
from cityflow.synthetic.town_green import LeafRule, Trees, add_trees
from cityflow.synthetic.town_ground import Ground
from cityflow.synthetic.town_layout import Axis, StreetNet
from cityflow.synthetic.town_soup import FaceSoup, Look

BESIDE_SHARE = 0.2
IN_GROUND_M, AROUND_M = 20.0, 60.0
LEAVES = LeafRule(0.4, 3.0, 0)


@dataclass(frozen=True, slots=True)
class TruthBuilding:
    """A building as it was made.

    Attributes
    ----------
    id : str
    shape : name of the roof shape
    outline : Polygon, world metres, noded with its neighbours
    faces : visible roof faces, without overlap; together they cover the outline
    prisms : the faces before the hidden parts were cut away, for casting rays
    floor : lowest terrain height along the outline, metres
    """

    id: str
    shape: str
    outline: Polygon
    faces: tuple[TruthFace, ...]
    prisms: tuple[TruthFace, ...]
    floor: float

    def z(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Roof height (metres) at world x, y; NaN outside the outline."""
        height = np.full(np.shape(x), -np.inf)
        for face in self.prisms:
            inside = shapely.intersects_xy(face.polygon, x, y)
            height = np.where(inside, np.maximum(height, face.plane.z(x, y)), height)
        return np.where(np.isfinite(height), height, np.nan)


@dataclass(frozen=True)
class PrismScene:
    """Buildings on a terrain without streets.

    Attributes
    ----------
    bounds : world metres
    buildings : their places are the units of a scan
    """

    bounds: Bounds
    terrain: Terrain
    buildings: tuple[TruthBuilding, ...]
    trees: Trees | None = None

    @cached_property
    def ground(self) -> Ground:
        """The TIN that the mesh shows."""
        x_0, y_0, x_1, y_1 = self.bounds
        u, v = (np.array([(high - low) / 2 + AROUND_M]) for low, high in ((x_0, x_1), (y_0, y_1)))
        net = StreetNet(((x_0 + x_1) / 2, (y_0 + y_1) / 2), 0.0, Axis(-u, u), Axis(-v, v))
        return Ground.of(self.terrain, net, ())

    def dtm(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """True ground height, also under buildings; metres."""
        return self.ground.z(x, y)

    def mesh(self, bounds: Bounds | None = None) -> TownMesh:
        """Everything that meets `bounds` (world metres), whole."""
        within, soup = bounds or self.bounds, FaceSoup()
        self.ground.add_faces(soup, within)
        near = shapely.STRtree([b.outline for b in self.buildings]).query(shapely.box(*within))
        for number in sorted(near.tolist()):
            top = Look(Part.ROOF, Material.ROOF_TILE, (160, 76, 52), number)
            side = Look(Part.WALL, Material.PLASTER, (226, 216, 196), number)
            for face in self.buildings[number].prisms:
                add_prism(soup, face, self.buildings[number].floor - IN_GROUND_M, top, side)
        if self.trees is not None:
            add_trees(soup, self.trees, within, LEAVES)
        return soup.mesh()


def trees_beside(rng: np.random.Generator, terrain: Terrain, buildings: Sequence[TruthBuilding]) -> Trees:
    """One building in five has a tree whose crown touches its wall or overhangs its roof."""
    rows = []
    for building in buildings:
        if rng.random() < BESIDE_SHARE:
            radius, ring = rng.uniform(2.2, 4.5), building.outline.exterior
            shell = building.outline.buffer(rng.choice([0.35, 1.0]) * radius).exterior
            at = shell.interpolate(shell.project(ring.interpolate(rng.uniform(0, ring.length))))
            rows.append((at.x, at.y, radius, rng.uniform(1.5, 3.0) + 2 * radius * rng.uniform(0.9, 1.5)))
    x, y, radii, heights = np.array(rows).reshape(-1, 4).T
    return Trees(x, y, terrain.z(x, y), radii, heights, np.arange(len(x), dtype=np.float64))

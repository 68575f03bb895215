"""Scenes of buildings of known shape on known ground, which the scanner of the town scans, too."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.synthetic.mesh import Material, Part, TownMesh
from cityflow.synthetic.prisms import add_prism
from cityflow.synthetic.roofs import TruthBuilding
from cityflow.synthetic.terrain import Terrain
from cityflow.synthetic.town_green import LeafRule, Trees, add_trees
from cityflow.synthetic.town_ground import Ground
from cityflow.synthetic.town_layout import Axis, StreetNet
from cityflow.synthetic.town_soup import FaceSoup, Look

IN_GROUND_M, AROUND_M = 20.0, 60.0
LEAVES = LeafRule(0.4, 3.0, 0)


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

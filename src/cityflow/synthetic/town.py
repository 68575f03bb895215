"""A synthetic town with everything known: terraces, houses, large buildings, windows, trees, cars, streets, terrain."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from pydantic import Field

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.grid import Bounds
from cityflow.core.parameters import Parameters
from cityflow.synthetic.known_terrain import Terrain, make_terrain, terraced, unbroken
from cityflow.synthetic.mesh import TownMesh
from cityflow.synthetic.prisms import add_bridge, bridge_over
from cityflow.synthetic.roofs import TruthFace
from cityflow.synthetic.town_cars import Cars, add_cars, park_cars
from cityflow.synthetic.town_facades import DOOR, Wall, plan_walls
from cityflow.synthetic.town_green import LeafRule, Trees, add_trees, plant_trees
from cityflow.synthetic.town_ground import Ground
from cityflow.synthetic.town_layout import StreetNet, fill_blocks, make_net
from cityflow.synthetic.town_levels import MOST_LEVEL
from cityflow.synthetic.town_mesh import add_unit, opening_corners
from cityflow.synthetic.town_soup import FaceSoup
from cityflow.synthetic.town_terraces import RowGaps
from cityflow.synthetic.town_units import Gap, Unit, build_units


class TownParameters(Parameters):
    """What the synthetic town looks like."""

    origin_x: float = Field(85000.0, description="west edge, world metres")
    origin_y: float = Field(447000.0, description="south edge, world metres")
    width_m: float = Field(250.0, ge=100, le=5000, description="extent eastwards, metres")
    height_m: float = Field(250.0, ge=100, le=5000, description="extent northwards, metres")
    relief: float = Field(0.4, ge=0, le=1, description="scale of tilt, waves and hills; 0 is a polder, 1 a hilly town")
    landscape: Literal["plain", "river", "tracks", "closed", "hillside"] = Field(
        "plain",
        description="river: with a river and its bridge, a dike and a scarp; tracks, closed: these, and hills in terraces of 1 to 4 m, "
        "with tracks up that have no wall or with none; hillside: one side of a valley, in terraces",
    )
    level: int = Field(
        0, ge=0, le=MOST_LEVEL,
        description="discontinuities of buildings (set-backs, arcades, passages, towers on slabs): 0: none but heights; 1: few and large; "
        "2: with courts, stilts, bay windows, loggias, balconies, canopies; 3: shallow ones too, turned, trees against the walls",
    )  # fmt: skip
    eaves: float = Field(
        0.0, ge=0, le=1,
        description="of buildings whose highest floors stand back, the share whose roof stands out over the terrace; with a level from 1",
    )  # fmt: skip
    park_share: float = Field(0.06, ge=0, le=1, description="share of street blocks that are parks")
    street_tree_share: float = Field(0.4, ge=0, le=1, description="share of pavements with a row of trees")
    car_share: float = Field(0.3, ge=0, le=1, description="share of parking places at the kerbs that are taken")
    leaf_m: float = Field(0.4, ge=0.1, le=2, description="edge of a leaf triangle, metres")
    leaf_area_index: float = Field(3.0, ge=0.2, le=10, description="leaf area per ground area of a crown, both m²")
    row_gaps: RowGaps | None = Field(
        None, description="gaps between houses of a row; null: one after every eighth, half of them with a tree"
    )

    @property
    def bounds(self) -> Bounds:
        """World metres."""
        return self.origin_x, self.origin_y, self.origin_x + self.width_m, self.origin_y + self.height_m


@dataclass(frozen=True, slots=True)
class Windows:
    """Windows and doors: unit (W,), corners of the pane (W, 4, 3) world metres counter-clockwise seen from outside,
    is_door (W,)."""

    unit: IntArray
    corners: FloatArray
    is_door: BoolArray


@dataclass(frozen=True)
class Town:
    """A town of one seed.

    Attributes
    ----------
    seed, parameters : what it was made from
    bounds : world metres; nothing but leaves stands beyond
    units : single units, in the order of street blocks
    walls : of all units, in their order
    gaps : between units of one row
    terrain : smooth terrain;  ground : the TIN of it that the mesh shows, and that truth heights follow
    net : frame of the streets
    trees, cars : what else stands on the ground;  bridge : its deck over the river, if there is one
    """

    seed: int
    parameters: TownParameters
    bounds: Bounds
    units: tuple[Unit, ...]
    walls: tuple[Wall, ...]
    gaps: tuple[Gap, ...]
    terrain: Terrain
    ground: Ground
    net: StreetNet
    trees: Trees
    cars: Cars
    bridge: TruthFace | None = None

    @cached_property
    def _boxes(self) -> FloatArray:
        """(U, 4) bounds of the units with their drain pipes."""
        boxes = np.array([u.roof_outline.bounds for u in self.units]).reshape(-1, 4)
        return np.asarray(boxes + np.array([-0.2, -0.2, 0.2, 0.2]))

    @cached_property
    def _first_wall(self) -> IntArray:
        return np.searchsorted([w.unit for w in self.walls], np.arange(len(self.units) + 1))

    @property
    def windows(self) -> Windows:
        """All windows and doors."""
        cut = [w for w in self.walls if len(w.openings)]
        corners = [opening_corners(w, self.units[w.unit].style.recess_m) for w in cut]
        counts = [len(c) for c in corners]
        return Windows(
            np.repeat(np.array([w.unit for w in cut], np.int64), counts),
            np.concatenate([np.empty((0, 4, 3)), *corners]),
            np.concatenate([np.empty(0, bool), *(w.openings[:, 4] == DOOR for w in cut)]),
        )

    def dtm(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """True ground height at world x, y, also under buildings; metres."""
        return self.ground.z(x, y)

    def mesh(self, bounds: Bounds | None = None) -> TownMesh:
        """Everything that meets `bounds` (world metres), whole; an object is the same whatever the bounds."""
        within = bounds or self.bounds
        soup = FaceSoup()
        self.ground.add_faces(soup, within)
        boxes, start = self._boxes, self._first_wall
        meets = (
            (boxes[:, 0] < within[2])
            & (boxes[:, 2] > within[0])
            & (boxes[:, 1] < within[3])
            & (boxes[:, 3] > within[1])
        )
        for k in np.flatnonzero(meets):
            add_unit(soup, self.units[k], self.walls[start[k] : start[k + 1]])
        p = self.parameters
        add_trees(soup, self.trees, within, LeafRule(p.leaf_m, p.leaf_area_index, self.seed))
        add_cars(soup, self.cars, within)
        if self.bridge is not None:
            add_bridge(soup, self.bridge)
        return soup.mesh()


def make_town(seed: int, parameters: TownParameters | None = None) -> Town:
    """A town from one seed: the same seed and parameters give the same town."""
    p = parameters or TownParameters()
    bounds, terrain = p.bounds, town_terrain(seed, p)
    net = make_net(np.random.default_rng([seed, 2]), bounds)
    blocks = fill_blocks(seed, net, bounds, p.park_share, p.row_gaps, p.level, p.eaves)
    units, gaps = build_units(blocks, net, terrain, bounds)
    ground = Ground.of(terrain, net, blocks)
    trees = plant_trees(seed, blocks, units, net, terrain, bounds, p.street_tree_share)
    cars = park_cars(seed, blocks, net, ground, bounds, p.car_share)
    walls = plan_walls(units, terrain)
    bridge = bridge_over(terrain, bounds) if p.landscape not in ("plain", "hillside") else None
    return Town(seed, p, bounds, units, walls, gaps, terrain, ground, net, trees, cars, bridge)


def town_terrain(seed: int, p: TownParameters) -> Terrain:
    """Tilt, waves and hills, and what the landscape adds to them."""
    made = make_terrain(np.random.default_rng([seed, 1]), p.bounds, p.relief)
    if p.landscape == "plain":
        return unbroken(made)
    return made if p.landscape == "river" else terraced(np.random.default_rng([seed, 3]), made, p.bounds, p.landscape)

"""A synthetic town and its scan, side by side with the truth that most tests and benchmarks of LiDAR methods ask for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.core.points import PointCloud
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_lidar import TownLidar, TownLidarParameters, town_lidar


@dataclass(frozen=True)
class ScannedTown:
    """A town and what a scanner delivers of it."""

    town: Town
    scan: TownLidar

    @property
    def points(self) -> PointCloud:
        return self.scan.points

    @property
    def bounds(self) -> Bounds:
        return self.town.bounds

    @cached_property
    def outlines(self) -> dict[str, Polygon]:
        """Where the walls of each unit stand."""
        return {u.id: u.wall_outline for u in self.town.units}

    @property
    def roof_outlines(self) -> list[Polygon]:
        """Where roofs end: what is found in heights."""
        return [u.roof_outline for u in self.town.units]

    def dtm(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """True terrain height (water level on water), metres."""
        return self.town.dtm(x, y)

    def roof(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Height of the highest roof; NaN where there is none."""
        heights = np.full(np.shape(x), np.nan)
        for unit in self.town.units:
            heights = np.fmax(heights, unit.z(x, y))
        return heights


def scanned_town(seed: int, town: TownParameters | None = None, scan: TownLidarParameters | None = None) -> ScannedTown:
    made = make_town(seed, town)
    return ScannedTown(made, town_lidar(made, seed, scan))

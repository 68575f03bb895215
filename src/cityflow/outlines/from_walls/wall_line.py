"""A wall in plan, as the points on its façade give it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from shapely import LineString

from cityflow.core.arrays import FloatArray

Heights = Callable[[FloatArray, FloatArray], FloatArray]
"""World x, y (any shape) → heights, metres; NaN where nothing is known."""

LINE, CURVE = "line", "curve"


@dataclass(frozen=True, slots=True)
class WallLine:
    """A straight or gently bent wall, from one end of what was seen of it to the other.

    Attributes
    ----------
    line : LineString in plan, world metres; two vertices for a straight wall, a polyline for a second-order curve.
        Whoever walks it from its first to its last vertex has the outside on the right
    normal : (2,) unit vector outwards, to the side that the wall is seen from; of a curve, at its middle
    sigma_m : standard deviation of the line's position across it, metres
    seen : share of its length along which façade points stand, 0 to 1
    z_low, z_high : heights between which they stand, world metres
    points : number of points that the line was fitted to
    kind : ``line`` or ``curve``
    ground_z : height of the terrain at the middle of the line, metres; NaN where it is not known
    """

    line: LineString
    normal: FloatArray
    sigma_m: float
    seen: float
    z_low: float
    z_high: float
    points: int
    kind: str = LINE
    ground_z: float = float("nan")

    @property
    def base_m(self) -> float:
        """How high above the terrain the lowest points stand: of a wall that rises above a lower roof, that roof's height."""
        return self.z_low - self.ground_z

    @property
    def direction(self) -> FloatArray:
        """(2,) unit vector from the first to the last vertex."""
        first, last = np.asarray(self.line.coords[0]), np.asarray(self.line.coords[-1])
        chord = np.asarray((last - first)[:2], np.float64)
        return np.asarray(chord / max(float(np.hypot(chord[0], chord[1])), 1e-12))

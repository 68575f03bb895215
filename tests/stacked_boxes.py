"""Hulls of boxes that stand upon each other, for measures that cut hulls by level planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

LEVELS = np.array([[1.6, 1.6], [4.8, 1.6], [8.0, 1.6], [10.6, 0.5]])
"""Three storeys of 3.2 m, and above the roof."""
Part = tuple[tuple[float, float, float, float], tuple[float, float]]


@dataclass(frozen=True)
class Boxes:
    """Boxes over plan rectangles (x_0, y_0, x_1, y_1) between two heights."""

    parts: tuple[Part, ...]

    def section(self, z: float) -> BaseGeometry:
        return shapely.union_all([shapely.box(*plan) for plan, (low, high) in self.parts if low <= z < high])


def arcade_and_set_back(arcade: float = 3.0, set_back: float = 2.0, soffit: float = 3.2, terrace: float = 6.4) -> Boxes:
    """20 x 12 m: an arcade along y = 0, the top floor set back from y = 12."""
    return Boxes((
        ((0, arcade, 20, 12), (0, soffit)),
        ((0, 0, 20, 12), (soffit, terrace)),
        ((0, 0, 20, 12 - set_back), (terrace, 9.6)),
    ))  # fmt: skip


PLAIN = Boxes((((0, 0, 20, 12), (0, 9.6)),))

"""Windows and doors that the texture of a façade shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from cityflow.core.arrays import FloatArray
from cityflow.core.texture import FaceKey

OpeningKind = Literal["window", "door"]

TOO_LITTLE = "too little of the wall is seen for a window-to-wall ratio"


@dataclass(frozen=True, slots=True, eq=False)
class Opening:
    """A window or a door: a rectangle in the plane of its wall, its sides level and upright.

    Attributes
    ----------
    face : the wall that it is in
    ring : (4, 3) world metres, counter-clockwise seen from outside, from the lower left corner
    bounds : s and t of the lower left corner, then of the upper right one, metres in the frame of the face
    kind : window, or door where it reaches down to the wall base
    confidence : 0 to 1
    support : other openings of its size in its row and column
    completed : whether it was searched for only because of a gap in its row or column
    """

    face: FaceKey
    ring: FloatArray
    bounds: tuple[float, float, float, float]
    kind: OpeningKind
    confidence: float
    support: int = 0
    completed: bool = False

    @property
    def area(self) -> float:
        """Square metres."""
        s_0, t_0, s_1, t_1 = self.bounds
        return (s_1 - s_0) * (t_1 - t_0)


@dataclass(frozen=True, slots=True, eq=False)
class FaceOpenings:
    """Openings of a wall.

    Attributes
    ----------
    openings : row by row from below, from left to right
    storeys : rows of windows, with those between that show none; 0 where there are too few windows
    area_m2 : of the wall;  seen_m2 : of it, with true texture (not interpolated)
    window_to_wall : area of the windows by `seen_m2`; None where too little of the wall is seen to say
    reason : why the wall has no result; else empty
    """

    key: FaceKey
    openings: tuple[Opening, ...]
    storeys: int
    area_m2: float
    seen_m2: float
    window_to_wall: float | None
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class UnitOpenings:
    """Openings of all walls of a unit.

    Attributes
    ----------
    faces : walls that have a texture, in their order
    storeys : rows of windows over all walls by their heights; None where there are too few windows
    window_to_wall_ratio : area of windows by area of walls, both where the texture is true; None where too little is seen, 0 where walls have none
    seen_share : of the area of all walls, what was looked at: true texture that is fine enough
    """

    faces: tuple[FaceOpenings, ...]
    storeys: int | None
    window_to_wall_ratio: float | None
    seen_share: float = 0.0

    @property
    def openings(self) -> tuple[Opening, ...]:
        return tuple(o for face in self.faces for o in face.openings)

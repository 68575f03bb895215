"""One tile of the city as the input of every export format."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building
from cityflow.core.coarse import Coarse
from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.core.texture import Drape, TextureSet
from cityflow.io.city_models.cityjson_sequence import Bounds3, extent_of
from cityflow.io.city_models.exported_openings import NO_OPENINGS, Openings

Files = Iterator[tuple[str, bytes]]
"""RUN-relative path, contents."""

Surface = tuple[FloatArray, IntArray]
"""(V, 3) vertices, world metres; (T, 3) triangles."""


@dataclass(frozen=True, slots=True)
class CityTile:
    """What is exported of one tile: buildings with their party walls cut, the terrain, and what the files say of themselves.

    Attributes
    ----------
    terrain : as a whole;  terrain_parts : the same in pieces that each hang together, for formats whose surfaces are in one piece
    city : bounds of all tiles
    coarse : what it looks like from far away
    raw, rectified : textures in the geometry of photographs, and straight from the front; None where there are none
    """

    name: str
    bounds: Bounds
    buildings: tuple[Building, ...]
    terrain: Surface
    terrain_parts: Sequence[Surface]
    reference: Reference
    title: str
    date: str
    attribution: str = ""
    city: Bounds | None = None
    raw: TextureSet | None = None
    rectified: TextureSet | None = None
    drape: Drape | None = None
    coarse: Coarse | None = None
    openings: Openings = field(default_factory=lambda: NO_OPENINGS)

    @property
    def extent(self) -> Bounds3 | None:
        """Box around buildings and terrain."""
        return extent_of(self.buildings, [self.terrain[0]])

    @property
    def relief(self) -> list[tuple[str, FloatArray, IntArray]]:
        """Parts of the terrain with their names, the first with the plain one."""
        plain = f"terrain-{self.name}"
        return [(plain + (f"-{n}" if n else ""), *part) for n, part in enumerate(self.terrain_parts)]

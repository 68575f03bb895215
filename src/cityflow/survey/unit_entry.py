"""One unit as the driver sees it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from sys import intern
from typing import Any

from cityflow.core.grid import Bounds
from cityflow.handover.outline_lines import OutlineAt


@dataclass(frozen=True, slots=True)
class UnitEntry:
    """One unit as the driver sees it: where it stands, and where its outline is written.

    Attributes
    ----------
    tile : name of the tile that owns it
    digest : of the outline's line in `path`, which starts at byte `start` and is `length` bytes long
    neighbours : units whose outlines share an edge, and the tiles that own these
    """

    id: str
    tile: str
    path: str
    start: int
    length: int
    digest: str
    bounds: Bounds
    point: tuple[float, float]
    neighbours: tuple[str, ...]
    neighbour_tiles: tuple[str, ...]

    @property
    def at(self) -> OutlineAt:
        """Where its outline is written."""
        return OutlineAt(self.path, self.start, self.length)

    @classmethod
    def of(cls, tile: str, entry: Mapping[str, Any]) -> UnitEntry:
        """From a record's entry; a name or path that stands in many entries is held once."""
        x_min, y_min, x_max, y_max = entry["bounds"]
        x, y = entry["point"]
        return cls(
            intern(entry["id"]), intern(tile), intern(entry["path"]), entry["start"], entry["length"], entry["digest"],
            (x_min, y_min, x_max, y_max), (x, y), tuple(map(intern, entry["neighbours"])), tuple(map(intern, entry["neighbour_tiles"])),
        )  # fmt: skip

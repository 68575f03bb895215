"""Tiles of local reference frames."""

from __future__ import annotations

from dataclasses import dataclass

from cityflow.core.grid import Tile
from cityflow.core.local_frame import LocalFrame


@dataclass(frozen=True, slots=True)
class FrameTile:
    """One tile of a local reference frame, on the frame's own lattice, and the ground tiles whose points may stand in it."""

    frame: LocalFrame
    tile: Tile
    ground_tiles: tuple[str, ...]


def frame_unit(frame: LocalFrame, tile: Tile) -> str:
    return f"{frame.name}.{tile.name}"

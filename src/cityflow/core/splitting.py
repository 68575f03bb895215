"""Input and output of splitting: rasters of every look direction, 3D line segments, cut lines, single units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import LineString, Polygon

from cityflow.core.arrays import BoolArray, ByteArray, Float32Array, FloatArray, IntArray
from cityflow.core.building import Direction, OutlineEdge
from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.points import PointCloud

ORTHO, SURFACE = 0, 1
"""Where a segment was found: in the ortho, in the surface model."""
CUT = "cut"
"""Kind of a border between units that touch."""


@dataclass(frozen=True, slots=True)
class FrameRasters:
    """Surface model and true ortho of one look direction over an outline (Dahlke 2017 §1.2).

    Attributes
    ----------
    frame : how the local frame is turned against the world; the nadir one has the identity
    grid : over local frame coordinates x, y; metres
    dsm : (rows, cols) float32, heights in the local frame (towards the cameras), metres; NaN where nothing is known
    ortho : (bands, rows, cols) uint8 or uint16, or None where there are no pictures
    seen : (rows, cols) bool, cells that the ortho shows; None with it
    """

    frame: LocalFrame
    grid: Grid
    dsm: Float32Array
    ortho: NDArray[np.uint8] | NDArray[np.uint16] | None = None
    seen: BoolArray | None = None


@dataclass(frozen=True, slots=True)
class SplitEvidence:
    """All that splitting may look at for one outline.

    Attributes
    ----------
    id : of the outline
    outline : Polygon, world metres
    frames : rasters of every look direction; the nadir first. With LiDAR that alone, without an ortho
    ground_height : metres, lowest terrain along the outline
    points : LiDAR points over the outline, or None where the survey has none
    inner_edges : walls that rise above a lower roof within the outline
    """

    id: str
    outline: Polygon
    frames: tuple[FrameRasters, ...]
    ground_height: float
    points: PointCloud | None = None
    inner_edges: tuple[OutlineEdge, ...] = ()

    @property
    def gsd_m(self) -> float:
        """Cell of the nadir rasters, metres."""
        return self.frames[0].grid.cell


@dataclass(frozen=True, slots=True)
class Segments:
    """Straight line segments in space.

    Attributes
    ----------
    start, end : (N, 3) float64, world metres
    frame : (N,) int64, index into `frames`
    layer : (N,) uint8, `ORTHO` or `SURFACE`
    frames : names of the look directions
    """

    start: FloatArray
    end: FloatArray
    frame: IntArray
    layer: ByteArray
    frames: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.start)

    def take(self, chosen: BoolArray | IntArray) -> Segments:
        return Segments(
            self.start[chosen], self.end[chosen], self.frame[chosen], self.layer[chosen], self.frames
        )  # fmt: skip

    @property
    def length(self) -> FloatArray:
        """(N,) metres in space."""
        return np.asarray(np.linalg.norm(self.end - self.start, axis=1))

    @property
    def aspect_deg(self) -> FloatArray:
        """(N,) direction in plan, degrees from east, counter-clockwise, 0 ≤ aspect < 180; of no meaning for upright ones."""
        d = self.end - self.start
        aspect = np.degrees(np.arctan2(d[:, 1], d[:, 0])) % 180.0
        return np.where(aspect < 180.0, aspect, 0.0)  # the rest of what is hardly below 0 is rounded to 180

    @property
    def slope_deg(self) -> FloatArray:
        """(N,) angle to the horizontal, 0 to 90 degrees."""
        d = self.end - self.start
        return np.asarray(np.degrees(np.arctan2(np.abs(d[:, 2]), np.hypot(d[:, 0], d[:, 1]))))


def joined_segments(parts: Sequence[Segments], frames: tuple[str, ...]) -> Segments:
    """All segments, in the order given; their `frame` counts in `frames` already."""
    if not parts:
        return Segments(
            np.empty((0, 3)), np.empty((0, 3)), np.empty(0, np.int64), np.empty(0, np.uint8), frames
        )  # fmt: skip
    return Segments(
        np.concatenate([p.start for p in parts]), np.concatenate([p.end for p in parts]), np.concatenate([p.frame for p in parts]),
        np.concatenate([p.layer for p in parts]), frames,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class CutLine:
    """A border between two units, or one side of a gap between them.

    Attributes
    ----------
    line : straight, in plan, from one border of the outline to another; world metres
    kind : ``cut`` between units that touch, ``gap`` for each of the two sides of a gap, ``edit`` where a person drew it
    vertical : share of the visible façade height at the line's ends along which upright segments stand, 0 to 1
    sloped : share of the line's length along which segments lie on the roof that are not upright, 0 to 1
    height_step_m : how much the roofs differ across it, metres
    gap_m : width of the gap that it borders, metres; 0 for a cut
    confidence : 0 to 1
    angle_sigma_deg : standard deviation of its direction, degrees
    """

    line: LineString
    kind: str
    vertical: float = 0.0
    sloped: float = 0.0
    height_step_m: float = 0.0
    gap_m: float = 0.0
    confidence: float = 1.0
    angle_sigma_deg: float = float("nan")


@dataclass(frozen=True, slots=True)
class Splitting:
    """How an outline was split.

    Attributes
    ----------
    units : polygons that cover the outline but for its gaps; of neighbours each has the vertices of the common boundary.
        The outline itself where it stays whole
    cut_lines : the accepted ones
    rejected : candidates below the threshold, so that a user can set it
    aspects, slopes : principal directions, strongest first
    reason : why nothing was split, or what was wrong; empty where all is well
    notes : figures worth recording
    """

    units: tuple[Polygon, ...]
    cut_lines: tuple[CutLine, ...] = ()
    rejected: tuple[CutLine, ...] = ()
    aspects: tuple[Direction, ...] = ()
    slopes: tuple[Direction, ...] = ()
    reason: str = ""
    notes: tuple[tuple[str, float], ...] = ()

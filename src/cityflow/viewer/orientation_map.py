"""Map of an orientation: tie points by density, with cameras, their look directions and known points over them."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.viewer.orientation_rows import Station

WIDTH, HEIGHT = 1100.0, 720.0
"""Most units of the drawing."""
FEWEST_CELLS, MOST_CELLS = 20, 150
"""Of the density along the longer side: a few tie points in each, set by hand."""
MARGIN = 0.04
"""Of the longer side, around cameras and points."""
ARROW = 34.0
"""Of an image that looks level, units; one that looks straight down has none."""
OUTER = 0.01
"""Share of tie points on each side that do not make the map larger: single ones lie anywhere."""
MOST_SHARE = 0.98
"""Of the cells with tie points; fuller ones have the last colour."""
RAMP = ((224, 238, 241), (190, 219, 222), (154, 200, 203), (120, 180, 184), (92, 157, 166), (68, 132, 147))
"""From one tie point in a cell to many."""


@dataclass(frozen=True, slots=True)
class DrawnCamera:
    """A camera: its place, the end of its look direction, what it says."""

    name: str
    start: tuple[float, float]
    end: tuple[float, float]
    weak: bool


@dataclass(frozen=True, slots=True)
class DrawnPoint:
    """A known point with what it says."""

    name: str
    role: str
    place: tuple[float, float]


@dataclass(frozen=True, slots=True)
class OrientationMap:
    """Ready to be drawn.

    Attributes
    ----------
    width, height : of the drawing;  density : data URL of a picture that fills it
    key : (tie points in a cell, colour);  cell_m : its edge
    bar : length in the drawing, and what it measures
    track : of the carrier of a sequence; none where there is no sequence
    """

    width: float
    height: float
    density: str
    key: tuple[tuple[str, str], ...]
    cell_m: float
    cameras: tuple[DrawnCamera, ...]
    points: tuple[DrawnPoint, ...]
    bar_px: float
    bar_text: str
    track: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class _Frame:
    """Lower left corner in world metres, and units a metre."""

    x_min: float
    y_min: float
    height: float
    scale: float

    def drawn(self, xy: FloatArray) -> FloatArray:
        """(N, 2) places in the drawing, rounded to a tenth."""
        right, down = (xy[:, 0] - self.x_min) * self.scale, self.height - (xy[:, 1] - self.y_min) * self.scale
        return np.asarray(np.round(np.column_stack([right, down]), 1), np.float64)


def orientation_map(
    stations: Sequence[Station],
    xyz: FloatArray,
    points: Sequence[tuple[str, str]],
    places: FloatArray,
    track: FloatArray | None = None,
) -> OrientationMap:
    """The map.

    Parameters
    ----------
    stations : one at least;  xyz : (P, 3) tie points, world metres
    points : name and role of known points;  places : (K, 3) of these
    track : (T, 3) places of the carrier, one after another; None where the images are no sequence
    """
    centres = np.array([s.centre for s in stations])
    low, high = _extent(np.concatenate([centres[:, :2], places[:, :2]]), xyz[:, :2])
    cell = float((high - low).max()) / float(np.clip(np.sqrt(len(xyz) / 2), FEWEST_CELLS, MOST_CELLS))
    size = np.ceil((high - low) / cell - 1e-6) * cell
    scale = float(min(WIDTH / size[0], HEIGHT / size[1]))
    width, height = (size * scale).round(1).tolist()
    frame = _Frame(float(low[0]), float(low[1]), height, scale)
    starts = frame.drawn(centres[:, :2])
    ends = np.round(starts + np.array([s.axis[:2] for s in stations]) * (ARROW, -ARROW), 1)
    cameras = tuple(
        DrawnCamera(s.name, (float(a[0]), float(a[1])), (float(b[0]), float(b[1])), s.weak)
        for s, a, b in zip(stations, starts, ends, strict=True)
    )
    marked = tuple(
        DrawnPoint(name, role, (float(p[0]), float(p[1])))
        for (name, role), p in zip(points, frame.drawn(places[:, :2]), strict=True)
    )
    counts = _counts(xyz[:, :2], low, size, cell)
    filled = counts[counts > 0]
    steps = _steps(float(np.quantile(filled, MOST_SHARE)) if len(filled) else 0.0)
    metres = _nice(150.0 / scale)
    way = () if track is None else tuple((float(x), float(y)) for x, y in frame.drawn(track[:, :2]))
    return OrientationMap(
        width, height, _picture(counts, steps), _key(steps), cell, cameras, marked, round(metres * scale, 1), f"{metres:g} m", way,
    )  # fmt: skip


def _extent(places: FloatArray, ties: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(2,) lowest and highest corner, world metres; never less than a metre wide."""
    ends = np.quantile(ties, [OUTER, 1 - OUTER], axis=0) if len(ties) else np.empty((0, 2))
    every = np.concatenate([places, ends])
    low, high = every.min(axis=0), every.max(axis=0)
    # a strip is not drawn as a line
    longest = max(float((high - low).max()), 1.0)
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, longest / 8) + MARGIN * longest
    return middle - half, middle + half


def _counts(ties: FloatArray, low: FloatArray, size: FloatArray, cell: float) -> IntArray:
    """(rows, cols) tie points, north up."""
    cols, rows = np.rint(size / cell).astype(int).tolist()
    place = np.floor((ties - low) / cell).astype(int)
    inside = ((place >= 0) & (place < (cols, rows))).all(axis=1)
    flat = np.bincount(place[inside, 1] * cols + place[inside, 0], minlength=rows * cols)
    return np.asarray(flat.reshape(rows, cols)[::-1], np.int64)


def _steps(most: float) -> list[int]:
    """The least count of each colour, ascending, each once.

    >>> _steps(100), _steps(3), _steps(0)
    ([1, 3, 6, 16, 40, 100], [1, 2, 3], [1])
    """
    return sorted({int(v) for v in np.round(np.geomspace(1, max(most, 1), len(RAMP)))})


def _picture(counts: IntArray, steps: Sequence[int]) -> str:
    """PNG as data URL, transparent where there is none."""
    colours = np.zeros((len(steps) + 1, 4), np.uint8)
    colours[1:, :3], colours[1:, 3] = _colours(len(steps)), 255
    pixels = colours[np.searchsorted(steps, counts, side="right")]
    data = io.BytesIO()
    Image.fromarray(pixels).save(data, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(data.getvalue()).decode()


def _colours(count: int) -> list[tuple[int, int, int]]:
    return [RAMP[round(k * (len(RAMP) - 1) / max(count - 1, 1))] for k in range(count)]


def _key(steps: Sequence[int]) -> tuple[tuple[str, str], ...]:
    """Counts in words with their colours."""
    texts = [
        f"{first}" if last == first else f"{first} to {last}"
        for first, last in zip(steps, [n - 1 for n in steps[1:]], strict=False)
    ]
    texts.append(f"{steps[-1]} or more" if len(steps) > 1 else "1 or more")
    return tuple((t, "#{:02x}{:02x}{:02x}".format(*c)) for t, c in zip(texts, _colours(len(steps)), strict=True))


def _nice(metres: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not longer.

    >>> _nice(37.0), _nice(1.2)
    (20.0, 1.0)
    """
    power = 10.0 ** np.floor(np.log10(max(metres, 1e-6)))
    return float(max(f for f in (1, 2, 5) if f * power <= metres * (1 + 1e-9)) * power)

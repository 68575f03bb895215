"""The map of units: outlines as SVG paths in decimetres, and the class of each unit in every colour scale."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.core.grid import Bounds
from cityflow.core.verdicts import Verdict
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.unit_figures import quantile

UNITS_PER_METRE = 10
STATUS_ORDER = (Status.REFUSED, Status.DONE, Status.DEGRADED, Status.FAILED)
"""Drawn in this order, so that what needs attention lies on top, and a refused duplicate below the building that it repeats."""

VERDICT_ORDER = ("", *Verdict)
NOBODY: Mapping[str, Sequence[FloatArray]] = {}
AROUND = 0.1
"""Refused outlines farther away than this share of the town's extent are not drawn: one of them would make the town a dot."""

NMAD_BREAKS_M = (0.02, 0.04, 0.06, 0.10, 0.20)
PLANE_BREAKS = (2.0, 3.0, 5.0, 9.0, 17.0)
STEPS = [m * 10.0**e for e in range(-3, 7) for m in (1, 2, 5)]


@dataclass(frozen=True, slots=True)
class Scale:
    """A colour scale: key and title, text of each class, and how the text begins for classes without a value."""

    key: str
    title: str
    breaks: tuple[float, ...]
    labels: tuple[str, ...]

    def index(self, value: float | None) -> str:
        """Number of the class of a value; ``x`` where there is none."""
        return "x" if value is None or value != value else str(bisect_right(self.breaks, value))


@dataclass(frozen=True, slots=True)
class UnitShape:
    """One unit on the map: position in the list of units, SVG path, CSS classes, centre."""

    row: int
    path: str
    classes: str
    centre: tuple[int, int]


@dataclass(frozen=True, slots=True)
class UnitMap:
    """Shapes in drawing order, the size of the drawing in its own units, and the colour scales.

    Attributes
    ----------
    waiting : paths of outlines that are not processed yet
    under : (x, y, width, height) in the drawing's units of what lies below the outlines; None where there is nothing
    """

    shapes: tuple[UnitShape, ...]
    width: int
    height: int
    scales: tuple[Scale, ...]
    waiting: tuple[str, ...] = ()
    under: tuple[int, int, int, int] | None = None


def draw_map(
    units: Sequence[UnitRow], waiting: Mapping[str, Sequence[FloatArray]] = NOBODY, under: Bounds | None = None
) -> UnitMap:
    """The map of units, in the order given; units without outline and refused ones far off are left out.

    Parameters
    ----------
    waiting : rings of outlines without a task, by id
    under : bounds of a picture that lies below the outlines, world metres
    """
    drawn = _near([(i, u) for i, u in enumerate(units) if any(len(r) for r in u.rings)])
    scales = colour_scales(units)
    others = [rings for _, rings in sorted(waiting.items()) if any(len(r) for r in rings)]
    if not drawn and not others:
        return UnitMap((), 0, 0, scales)
    low, high = _extent([*(u.rings for _, u in drawn), *others])
    margin = max(0.02 * float((high - low).max()), 2.0)
    origin = np.array([low[0] - margin, high[1] + margin])
    drawn.sort(key=lambda entry: (STATUS_ORDER.index(entry[1].status), VERDICT_ORDER.index(entry[1].verdict), entry[0]))
    shapes = tuple(_shape(i, u, origin, scales) for i, u in drawn)
    width, height = ((high - low + 2 * margin) * UNITS_PER_METRE).round().astype(int)
    paths = tuple(
        "".join(_path(_to_drawing(np.asarray(r, np.float64)[:, :2], origin)) for r in rings if len(r))
        for rings in others
    )
    return UnitMap(shapes, int(width), int(height), scales, paths, None if under is None else _box(under, origin))


def _box(bounds: Bounds, origin: FloatArray) -> tuple[int, int, int, int]:
    (x, y), (right, bottom) = _to_drawing(np.array([[bounds[0], bounds[3]], [bounds[2], bounds[1]]]), origin).tolist()
    return x, y, right - x, bottom - y


def _near(drawn: list[tuple[int, UnitRow]]) -> list[tuple[int, UnitRow]]:
    """Without refused outlines that reach beyond the town."""
    town = [u for _, u in drawn if u.status is not Status.REFUSED]
    if not town:
        return drawn
    low, high = _extent([u.rings for u in town])
    margin = AROUND * float((high - low).max())
    return [(i, u) for i, u in drawn if u.status is not Status.REFUSED or _within(u, low - margin, high + margin)]


def _within(unit: UnitRow, low: FloatArray, high: FloatArray) -> bool:
    least, most = _extent([unit.rings])
    return bool((least >= low).all() and (most <= high).all())


def _extent(outlines: Sequence[Sequence[FloatArray]]) -> tuple[FloatArray, FloatArray]:
    """(2,) lowest and (2,) highest x, y of all outlines' rings."""
    corners = np.concatenate([np.asarray(r, np.float64)[:, :2] for rings in outlines for r in rings if len(r)])
    return corners.min(axis=0), corners.max(axis=0)


def colour_scales(units: Sequence[UnitRow]) -> tuple[Scale, ...]:
    """Scales with fixed classes, so that maps of different runs can be compared; time follows its median."""
    median = quantile([u.seconds for u in units], 0.5) or 0.05
    start = min(max(bisect_right(STEPS, median * 1.0001) - 1, 0), len(STEPS) - 5)
    seconds = tuple(STEPS[start : start + 5])
    return (
        Scale("nmad", "NMAD", NMAD_BREAKS_M, _labels([f"{100 * b:g}" for b in NMAD_BREAKS_M], "cm")),
        Scale("planes", "Roof planes", PLANE_BREAKS, ("1", "2", "3–4", "5–8", "9–16", "17 or more")),
        Scale("seconds", "Time", seconds, _labels([f"{b:g}" for b in seconds], "s")),
    )


def _labels(breaks: Sequence[str], unit: str) -> tuple[str, ...]:
    inner = [f"{a}–{b} {unit}" for a, b in pairwise(breaks)]
    return (f"below {breaks[0]} {unit}", *inner, f"{breaks[-1]} {unit} or more")


def _shape(row: int, unit: UnitRow, origin: FloatArray, scales: tuple[Scale, ...]) -> UnitShape:
    planes = float(unit.planes) if unit.planes > 0 else None
    values = {"nmad": unit.nmad, "planes": planes, "seconds": unit.seconds}
    classes = " ".join(f"{s.key[0]}{s.index(values[s.key])}" for s in scales)
    rings = [_to_drawing(np.asarray(r, np.float64)[:, :2], origin) for r in unit.rings if len(r)]
    middle = (rings[0].min(axis=0) + rings[0].max(axis=0)) // 2
    centre = int(middle[0]), int(middle[1])
    return UnitShape(
        row,
        "".join(_path(r) for r in rings),
        " ".join(filter(None, (unit.status.value, unit.verdict, classes))),
        centre,
    )


def _to_drawing(ring: FloatArray, origin: FloatArray) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    flipped = (ring - origin) * np.array([UNITS_PER_METRE, -UNITS_PER_METRE])
    whole: np.ndarray[tuple[int, int], np.dtype[np.int64]] = np.rint(flipped).astype(np.int64)
    return whole


def _path(ring: np.ndarray[tuple[int, int], np.dtype[np.int64]]) -> str:
    """Absolute first point, then steps: half the size of absolute coordinates."""
    steps = np.diff(ring, axis=0)
    steps = steps[np.any(steps != 0, axis=1)]
    inner = "".join(f"{x} {y}" if i == 0 else f" {x} {y}" for i, (x, y) in enumerate(steps.tolist()))
    return f"M{ring[0, 0]} {ring[0, 1]}l{inner or '0 0'}z"

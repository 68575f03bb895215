"""Axis strips of an outline: straight strips along which chords run from one façade to the one opposite (Dahlke 2017 §2.2).

The skeleton that slices stand perpendicular to is made of chords: for each main direction lines across are swept over the outline; where
successive chords overlap, and over a length as great as theirs most of both ends meet edges along that direction, they make a strip.
Rows give one strip, L- and T-shapes one for each wing, rings one for each side, curved rows a chain of short ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from scipy import ndimage
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray

SIMPLIFY_M = 0.3
"""Vertices nearer than this to the line between their neighbours say nothing of where façades run."""
TURN_TOLERANCE_DEG = 12.0
"""How far the edges at a chord's ends may be turned from the strip."""
SAME_STRIP = 0.62
"""Overlap of successive chords (of the longer one) that belong together."""
BRIDGED_M = 2.5
"""A strip goes on across a slanting bit of façade no longer than this."""
LEAST_SHARE = 0.02
"""Of an outline's length so much runs along each of its directions, at least."""
CROSSWISE = 1.6
"""A chord is no cut where it is this many times longer than its strip: it runs lengthwise."""
ORIGIN_M = 128.0
"""Chords, and cells along a strip, lie where they lie whatever the outline's extremes: its origin is a multiple of this."""
DIRECTIONS = 16
"""Of an outline at most so many directions are looked at; a circle has them all."""
ROUND = 0.88
"""4π·area / perimeter² beyond which an outline is round (a square has 0.79)."""


@dataclass(frozen=True, slots=True)
class AxisStrip:
    """A strip of an outline with chords across it; u counts along it, v to its left.

    Attributes
    ----------
    origin : (2,) world metres, where u = v = 0
    along : (2,) unit vector of u
    stations : (S,) u of the chords, equally spaced, metres
    low, high : (S,) v of both ends of each chord, metres
    chain_m : length of the strips that follow one another round a curve; its own where it is straight, metres
    """

    origin: FloatArray
    along: FloatArray
    stations: FloatArray
    low: FloatArray
    high: FloatArray
    chain_m: float

    @property
    def across(self) -> FloatArray:
        """(2,) unit vector of v."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def length(self) -> float:
        return float(self.stations[-1] - self.stations[0])

    @property
    def depth(self) -> float:
        """Usual length of the chords, metres."""
        return float(np.median(self.high - self.low))

    @property
    def aspect_deg(self) -> float:
        return float(np.degrees(np.arctan2(self.along[1], self.along[0])) % 180.0)

    def to_uv(self, xy: FloatArray) -> FloatArray:
        """(…, 2) world → (…, 2) u, v."""
        return np.asarray((xy - self.origin) @ np.column_stack([self.along, self.across]))

    def to_world(self, uv: FloatArray) -> FloatArray:
        """(…, 2) u, v → (…, 2) world."""
        return np.asarray(uv @ np.stack([self.along, self.across]) + self.origin)

    def area(self) -> Polygon:
        """What its chords cover, in the world."""
        uv = np.concatenate(
            [np.column_stack([self.stations, self.low]), np.column_stack([self.stations, self.high])[::-1]]
        )
        return Polygon(self.to_world(uv))

    def ends_at(self, u: float) -> tuple[float, float]:
        """v of both ends of the chord nearest to u."""
        k = int(np.argmin(np.abs(self.stations - u)))
        return float(self.low[k]), float(self.high[k])


def is_round(outline: Polygon) -> bool:
    """True for circles and polygons close to one."""
    return bool(4 * np.pi * outline.area / outline.length**2 > ROUND)


def axis_strips(
    outline: Polygon, aspects_deg: Sequence[float], step_m: float, shortest_m: float
) -> tuple[AxisStrip, ...]:
    """Strips of an outline, longest first.

    Parameters
    ----------
    aspects_deg : directions known from elsewhere; those of the outline's edges count only where no strip runs along any of these
    step_m : distance between chords, metres
    shortest_m : shorter chains of strips are not returned, metres
    """
    if is_round(outline):
        return ()
    plain = _plain(outline)
    origin = ORIGIN_M * np.floor(np.array(plain.bounds[:2]) / ORIGIN_M)
    edges = _edges(plain, origin)
    known = np.unique(np.round(np.asarray(aspects_deg, np.float64) % 180.0, 6))
    found = _strips_along(edges, known, origin, step_m, shortest_m)
    return found or _strips_along(edges, edge_directions(edges), origin, step_m, shortest_m)


def _strips_along(
    edges: FloatArray, directions: FloatArray, origin: FloatArray, step: float, shortest: float
) -> tuple[AxisStrip, ...]:
    runs = [s for angle in directions.tolist() for s in _chord_runs(edges, angle, directions, step)]
    kept = [
        AxisStrip(origin, s.along, s.stations, s.low, s.high, c)
        for s, c in zip(runs, _chain_lengths(runs), strict=True)
        if c >= shortest and len(s.stations) > 2 and np.median(s.high - s.low) <= CROSSWISE * c
    ]
    return tuple(sorted(kept, key=lambda p: -len(p.stations)))


@dataclass(frozen=True, slots=True)
class _ChordRun:
    along: FloatArray
    stations: FloatArray
    low: FloatArray
    high: FloatArray


def _plain(outline: Polygon) -> Polygon:
    """Without spikes, tiny holes and vertices that mean nothing."""
    rough = shapely.simplify(outline, SIMPLIFY_M)
    opened = shapely.buffer(shapely.buffer(rough, -SIMPLIFY_M, join_style="mitre"), SIMPLIFY_M, join_style="mitre")
    parts = [p for p in shapely.get_parts(opened) if p.geom_type == "Polygon"]
    largest = max(parts, key=lambda p: p.area, default=outline)
    solid = largest if largest.area > 0.9 * outline.area else outline
    holes = [r for r in solid.interiors if Polygon(r).area > 4.0]
    simple = shapely.simplify(Polygon(solid.exterior, holes), SIMPLIFY_M)
    return simple if simple.geom_type == "Polygon" and not simple.is_empty else outline


def _edges(outline: Polygon, origin: FloatArray) -> FloatArray:
    """(E, 2, 2) x, y of both ends of every edge, less the origin."""
    rings = [shapely.get_coordinates(r)[:, :2] - origin for r in (outline.exterior, *outline.interiors)]
    return np.concatenate([np.stack([r[:-1], r[1:]], axis=1) for r in rings])


def _angles(edges: FloatArray) -> FloatArray:
    """(E,) degrees from east, 0 to 180."""
    x, y = (edges[:, 1] - edges[:, 0]).T
    return np.asarray(np.degrees(np.arctan2(y, x)) % 180.0)


def edge_directions(edges: FloatArray) -> FloatArray:
    """Directions of edges, degrees from east, 0 to 180: clusters by length."""
    length, angle = np.hypot(*(edges[:, 1] - edges[:, 0]).T), _angles(edges)
    found: list[float] = []
    left = length > 0.4
    while left.any() and len(found) < DIRECTIONS:
        votes = [float(length[left & (_turn(angle, a) < TURN_TOLERANCE_DEG / 2)].sum()) for a in angle[left]]
        near = left & (_turn(angle, float(angle[left][int(np.argmax(votes))])) < TURN_TOLERANCE_DEG / 2)
        mean = _mean_angle(angle[near], length[near])
        if float(length[near].sum()) > LEAST_SHARE * float(length.sum()):
            found.append(mean)
        left &= ~near & (_turn(angle, mean) >= TURN_TOLERANCE_DEG / 2)
    return np.unique(np.round(found, 6))


def _turn(angle: FloatArray, other: float | FloatArray) -> FloatArray:
    """Difference of directions of lines, degrees, 0 to 90."""
    return np.abs((angle - other + 90.0) % 180.0 - 90.0)


def _mean_angle(angle: FloatArray, weight: FloatArray) -> float:
    double = np.radians(2 * angle)
    return float(np.degrees(np.arctan2((weight * np.sin(double)).sum(), (weight * np.cos(double)).sum())) / 2 % 180.0)


def _chord_runs(edges: FloatArray, angle: float, directions: FloatArray, step: float) -> list[_ChordRun]:
    """Runs of chords across `angle` whose ends meet edges for which it is the nearest of the directions."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    along = np.array([c, s])
    turned = edges @ np.array([[c, -s], [s, c]])
    u = turned[..., 0]
    first = np.floor(u.min() / step)
    count = int(np.ceil(u.max() / step) - first) + 1
    stations = (first + 0.5 + np.arange(count)) * step
    at, low, high, ends = chords(turned, stations)
    turn = (_angles(edges)[ends] - angle + 90.0) % 180.0 - 90.0
    runs = []
    for run in _runs(at, low, high):
        width = round(float(np.median(high[run] - low[run])) / step)
        usual = ndimage.median_filter(turn[run], (width | 1, 1), mode="mirror")
        runs += _fitting(run, _fits(usual + angle, angle, directions), round(BRIDGED_M / step))
    return [_ChordRun(along, stations[at[r]], low[r], high[r]) for r in runs]


def _fitting(run: IntArray, fits: BoolArray, bridged: int) -> list[IntArray]:
    """Parts of a run that begin and end with chords that fit; slanting bits of the outline in between do not part it."""
    good = np.flatnonzero(fits)
    if not len(good):
        return []
    breaks = np.flatnonzero(np.diff(good) > bridged + 1)
    starts, ends = np.r_[good[0], good[breaks + 1]], np.r_[good[breaks], good[-1]]
    return [run[a : b + 1] for a, b in zip(starts, ends, strict=True)]


def _fits(ends_deg: FloatArray, angle: float, directions: FloatArray) -> BoolArray:
    """True for chords whose (n, 2) end edges run along `angle`, both roughly, on average closely and as nearly as along any other."""
    turn = (ends_deg[:, None, :] - directions[None, :, None] + 90.0) % 180.0 - 90.0
    rough = np.abs(turn).max(axis=2) < 2 * TURN_TOLERANCE_DEG
    mean = np.where(rough, np.abs(turn.mean(axis=2)), 90.0)
    own = mean[:, int(np.argmin(np.abs(directions - angle)))]
    return np.asarray((own < TURN_TOLERANCE_DEG) & (own <= mean.min(axis=1) + 2.0))


def chords(edges: FloatArray, stations: FloatArray) -> tuple[IntArray, FloatArray, FloatArray, IntArray]:
    """Where upright lines at u = stations run inside: station's index, lower v, upper v, (n, 2) edges hit; ordered."""
    u, v = edges[..., 0], edges[..., 1]
    first, after = np.searchsorted(stations, u.min(axis=1)), np.searchsorted(stations, u.max(axis=1))
    count = after - first
    edge = np.repeat(np.arange(len(edges)), count)
    at = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count) + first[edge]
    (u_0, u_1), (v_0, v_1) = u[edge].T, v[edge].T
    v = v_0 + (stations[at] - u_0) / (u_1 - u_0) * (v_1 - v_0)
    order = np.lexsort((v, at))
    at, v, edge = at[order], v[order], edge[order]
    return at[::2], v[::2], v[1::2], np.column_stack([edge[::2], edge[1::2]])


def _runs(at: IntArray, low: FloatArray, high: FloatArray) -> list[IntArray]:
    """Chords of successive stations that overlap, as lists of their numbers."""
    open_runs: list[list[int]] = []
    done: list[list[int]] = []
    for k in range(len(at)):
        for run in open_runs:
            j = run[-1]
            common = min(high[k], high[j]) - max(low[k], low[j])
            if at[k] == at[j] + 1 and common > SAME_STRIP * max(high[k] - low[k], high[j] - low[j]):
                run.append(k)
                break
        else:
            open_runs.append([k])
        done += [r for r in open_runs if at[r[-1]] < at[k] - 1]
        open_runs = [r for r in open_runs if at[r[-1]] >= at[k] - 1]
    return [np.array(r, np.int64) for r in (*done, *open_runs)]


def _chain_lengths(runs: Sequence[_ChordRun]) -> list[float]:
    """Of each strip the length of all that follow one another with a small turn."""
    length = np.array([s.stations[-1] - s.stations[0] for s in runs])
    label = np.arange(len(runs))
    for i, a in enumerate(runs):
        for j in range(i):
            if label[i] != label[j] and _follow(a, runs[j]):
                label[label == label[i]] = label[j]
    return [float(length[label == label[i]].sum()) for i in range(len(runs))]


def _follow(a: _ChordRun, b: _ChordRun) -> bool:
    turn = abs(a.along[0] * b.along[1] - a.along[1] * b.along[0])
    if turn > np.sin(np.radians(30.0)):
        return False
    depth = min(float(np.median(a.high - a.low)), float(np.median(b.high - b.low)))
    gaps = np.linalg.norm(_ends(a)[:, None] - _ends(b)[None], axis=2)
    return bool(gaps.min() < 0.4 * depth)


def _ends(run: _ChordRun) -> FloatArray:
    """(2, 2) middle of the first and of the last chord."""
    v = (run.low + run.high)[[0, -1]] / 2
    return np.outer(run.stations[[0, -1]], run.along) + np.outer(v, [-run.along[1], run.along[0]])

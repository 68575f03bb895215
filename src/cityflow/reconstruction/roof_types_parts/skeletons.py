"""Roof shapes over four sides: one family for all roofs with a ridge, and what is not of that family.

A shape is a height t between 0 (eave) and 1 (ridge) at every place, given distances to four sides; the roof is
z = eave + rise · t. So eave and rise are linear in the heights, and only the plan of the skeleton has to be searched.

The family: t = f(min(d0/D0, d1/D1, s2 + (1 − s2)·d2/R2, s3 + (1 − s3)·d3/R3)). D0 and D1 place the ridge, R the run of a
hipped end, s the share of the height at which it begins: 1 is a gable, 0 a hip, in between a half-hip. Runs that meet make a
pyramid, a bend in f a mansard, a negative rise a butterfly (Hron 2020, section 3, whose ridge lies in the middle or at the rim).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.kernels import njit
from cityflow.core.roof_type_names import RoofType

D0, D1, R2, R3, S2, S3, BEND, BEND_T = range(8)
"""Places of a shape's numbers: ridge distances (m), runs of the ends (m), their starts (share), bend of f (at share, to share)."""
FRONT, BACK, LEFT = range(3)
"""Sides of a part, and columns of the distances to them; the right one comes after the left."""
NX, NY, C = range(3)
"""Columns of a side: its normal, and the distance of the origin."""

DOME_RINGS = 3
"""Rings of planes that a dome becomes; set by hand."""


@njit(cache=True, nogil=True)
def _meet(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """Where two lines nx·x + ny·y = c meet."""
    det = a[NX] * b[NY] - a[NY] * b[NX]
    if abs(det) < 1e-9:
        return np.nan, np.nan
    return (a[C] * b[NY] - a[NY] * b[C]) / det, (a[NX] * b[C] - a[C] * b[NX]) / det


@dataclass(frozen=True)
class Quad:
    """Four sides of a part of an outline; the ridge runs from side 2 to side 3.

    Attributes
    ----------
    sides : (4, 3) float64, nx, ny, c of each side: nx·x + ny·y − c is the distance inwards, metres; front, back, left, right
    """

    sides: FloatArray

    def distances(self, xy: FloatArray) -> FloatArray:
        """(N, 4) distances inwards from every side."""
        return np.ascontiguousarray(xy @ self.sides[:, :C].T - self.sides[:, C])

    def ring(self) -> FloatArray:
        """(4, 2) corners, counter-clockwise."""
        ring = np.array([_meet(self.sides[i], self.sides[k]) for i, k in ((0, 2), (0, 3), (1, 3), (1, 2))])
        x, y = ring.T
        return ring if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0 else ring[::-1]

    @cached_property
    def middle(self) -> FloatArray:
        return np.asarray(self.ring().mean(axis=0))

    @cached_property
    def width(self) -> float:
        """Metres across the ridge, in the middle."""
        return float(self.distances(self.middle[None])[0, :2].sum())

    @cached_property
    def length(self) -> float:
        """Metres along the ridge, in the middle."""
        return float(self.distances(self.middle[None])[0, 2:].sum())

    @cached_property
    def direction(self) -> FloatArray:
        """Unit vector of the ridge: the average of front and back, from left to right."""
        n = self.sides[0, :2] - self.sides[1, :2]
        along = np.array([-n[1], n[0]]) / np.hypot(*n)
        return along if along @ self.sides[2, :2] > 0 else -along

    def turned(self) -> Quad:
        """The same with its ridge across."""
        return Quad(self.sides[[2, 3, 0, 1]])


@dataclass(frozen=True, slots=True)
class Skeleton:
    """A shape over a quad with its heights.

    Attributes
    ----------
    type : roof type
    quad : the part it stands on
    shape : (8,) float64 numbers of the family; of no meaning for flat roofs, sheds, sawtooth and round ones
    eave, rise : metres (local); z = eave + rise·t
    teeth : number of sheds of a sawtooth
    rim : (K, 3) float64, sides of a round outline, nx, ny, c each, divided by the distance of the top: t of a cone is the lowest
    """

    type: RoofType
    quad: Quad
    shape: FloatArray
    eave: float
    rise: float
    teeth: int = 0
    rim: FloatArray = field(default_factory=lambda: np.empty((0, 3)))

    def with_heights(self, eave: float, rise: float) -> Skeleton:
        return replace(self, eave=eave, rise=rise)


def ridge_shape(quad: Quad, at: float = 0.5) -> FloatArray:
    """A gable whose ridge lies at a share of the width."""
    width = quad.width
    return np.array([at * width, (1 - at) * width, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])


@njit(cache=True, nogil=True)
def ridge_heights(shape: FloatArray, d: FloatArray) -> FloatArray:
    """(S,) t of the family at places with (S, 4) distances to the sides."""
    t = np.empty(len(d))
    for i in range(len(d)):
        low = min(d[i, FRONT] / shape[D0], d[i, BACK] / shape[D1])
        for end in range(2):
            s = shape[S2 + end]
            if s < 1.0:
                low = min(low, s + (1.0 - s) * d[i, LEFT + end] / shape[R2 + end])
        q, g = shape[BEND], shape[BEND_T]
        if q < 1.0:
            low = min(low * g / q, g + (low - q) * (1.0 - g) / (1.0 - q))
        t[i] = low
    return t


def tooth_heights(d: FloatArray, length: float, teeth: int) -> FloatArray:
    """(S,) t of sheds side by side from left to right, each rising from 0 to 1."""
    pitch = length / teeth
    at = np.clip(d[:, LEFT] / pitch, 0, teeth - 1e-9)
    return np.asarray(at - np.floor(at))


def round_heights(xy: FloatArray, rim: FloatArray, dome: bool) -> FloatArray:
    """(N,) t of a cone or of half an ellipsoid over a round outline."""
    t = (xy @ rim[:, :C].T - rim[:, C]).min(axis=1)
    return np.asarray(np.sqrt(np.maximum(1 - (1 - np.maximum(t, 0)) ** 2, 0)) if dome else t)


def shape_heights(skeleton: Skeleton, xy: FloatArray) -> FloatArray:
    """(N,) t of any skeleton at local places."""
    d = skeleton.quad.distances(xy)
    kind = skeleton.type
    if kind is RoofType.FLAT:
        return np.zeros(len(xy))
    if kind is RoofType.SHED:
        return np.asarray(d[:, FRONT] / skeleton.quad.width)
    if kind is RoofType.SAWTOOTH:
        return tooth_heights(d, skeleton.quad.length, skeleton.teeth)
    if kind in (RoofType.CONE, RoofType.DOME):
        return round_heights(xy, skeleton.rim, kind is RoofType.DOME)
    return np.asarray(ridge_heights(skeleton.shape, d))


@njit(cache=True, nogil=True)
def skeleton_edges(shape: FloatArray, sides: FloatArray) -> FloatArray:
    """(E, 4) x, y of start and end of the skeleton's edges: ridge, hips, bends."""
    edges = np.full((9, 4), np.nan)
    ridge = sides[FRONT] / shape[D0] - sides[BACK] / shape[D1]
    count = 1
    for end in range(2):
        s, side = shape[S2 + end], sides[LEFT + end]
        top = side.copy()
        if s < 1.0:
            top = sides[FRONT] / shape[D0] - (1.0 - s) / shape[R2 + end] * side
            top[C] += s
        x, y = _meet(ridge, top)
        edges[0, 2 * end], edges[0, 2 * end + 1] = x, y
        if s < 1.0:
            for k in range(2):
                start = sides[k].copy()
                start[C] += s * shape[D0 + k]
                edges[count, 0], edges[count, 1] = x, y
                edges[count, 2], edges[count, 3] = _meet(start, side)
                count += 1
    if shape[BEND] < 1.0:
        for k in range(2):
            bend = sides[k].copy()
            bend[C] += shape[BEND] * shape[D0 + k]
            for end in range(2):
                stop = sides[LEFT + end].copy()
                s = shape[S2 + end]
                if s < 1.0:
                    stop[C] += max(shape[BEND] - s, 0.0) / (1.0 - s) * shape[R2 + end]
                edges[count, 2 * end], edges[count, 2 * end + 1] = _meet(bend, stop)
            count += 1
    return edges[:count]


def plane_groups(skeleton: Skeleton) -> list[tuple[FloatArray, FloatArray | None, bool]]:
    """The skeleton as (P, 3) planes z = a·x + b·y + c over a convex region, lowest (or, True, highest) of each group.

    The region is None for all of the part; groups stand side by side (teeth of a sawtooth).
    """
    quad, kind = skeleton.quad, skeleton.type
    if kind is RoofType.FLAT:
        return [(np.array([[0.0, 0.0, skeleton.eave]]), None, False)]
    if kind is RoofType.SHED:
        return [(_raised(quad.sides[:1] / quad.width, skeleton), None, False)]
    if kind is RoofType.SAWTOOTH:
        return _teeth(skeleton)
    if kind in (RoofType.CONE, RoofType.DOME):
        return [(_round_planes(skeleton), None, False)]
    return [(_raised(_family_planes(skeleton.shape, quad.sides), skeleton), None, skeleton.rise < 0)]


def _raised(t: FloatArray, skeleton: Skeleton) -> FloatArray:
    """Planes a, b, c of heights from rows nx, ny, c of t = nx·x + ny·y − c."""
    planes = skeleton.rise * t * np.array([1.0, 1.0, -1.0])
    planes[:, C] += skeleton.eave
    return planes


def _family_planes(shape: FloatArray, sides: FloatArray) -> FloatArray:
    """(P, 3) rows nx, ny, c of t = nx·x + ny·y − c; t is the lowest."""
    rows = [sides[FRONT] / shape[D0], sides[BACK] / shape[D1]]
    for end in range(2):
        s = shape[S2 + end]
        if s < 1.0:
            rows.append((1 - s) / shape[R2 + end] * sides[LEFT + end] - np.array([0, 0, s]))
    t = np.array(rows)
    q, g = shape[BEND], shape[BEND_T]
    if q >= 1.0:
        return t
    steep, gentle = t * (g / q), t * ((1 - g) / (1 - q))
    gentle[:, C] -= g - q * (1 - g) / (1 - q)
    return np.concatenate([steep, gentle])


def _teeth(skeleton: Skeleton) -> list[tuple[FloatArray, FloatArray | None, bool]]:
    quad, pitch = skeleton.quad, skeleton.quad.length / skeleton.teeth
    groups: list[tuple[FloatArray, FloatArray | None, bool]] = []
    for k in range(skeleton.teeth):
        row = quad.sides[LEFT] / pitch + np.array([0, 0, k])
        low, high = (
            quad.sides[LEFT] + np.array([0, 0, k * pitch]),
            -quad.sides[LEFT] - np.array([0, 0, (k + 1) * pitch]),
        )
        reach = [low] if k else []
        reach += [high] if k < skeleton.teeth - 1 else []
        groups.append((_raised(row[None], skeleton), np.array(reach), False))
    return groups


def _round_planes(skeleton: Skeleton) -> FloatArray:
    """A plane from every side to the top; of a dome several, which touch it in rings."""
    if skeleton.type is RoofType.CONE:
        return _raised(skeleton.rim.copy(), skeleton)
    rows = []
    for rho in (np.arange(DOME_RINGS) + 0.5) / DOME_RINGS:
        t = np.sqrt(1 - rho**2)
        slope = rho / t
        rows.append(slope * skeleton.rim + np.array([0, 0, slope * (1 - rho) - t]))
    return _raised(np.concatenate(rows), skeleton)

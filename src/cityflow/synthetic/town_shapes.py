"""Volumes: walls over a ring with a roof that may stand out beyond them. A building is one or several that overlap.

All shapes are given in a plan frame of their own (u, v; metres) with heights above the building's base. A volume is a
closed solid, so what lies inside another one is simply never seen and no solids need to be united.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.synthetic import roofs
from cityflow.synthetic.roofs import MAIN, LocalFace

Ring = tuple[tuple[float, float], ...]
CHIMNEY_M = 0.6
SLAB_M = 0.16
"""Thickness of a roof that stands out beyond its walls."""


@dataclass(frozen=True, slots=True)
class Overhang:
    """How far a roof stands out beyond the wall at u = 0, u = length, v = 0 and v = depth; metres."""

    left: float = 0.0
    right: float = 0.0
    front: float = 0.0
    back: float = 0.0

    @classmethod
    def all_round(cls, reach: float) -> Overhang:
        return cls(reach, reach, reach, reach)

    @property
    def any(self) -> bool:
        return max(self.left, self.right, self.front, self.back) > 0


@dataclass(frozen=True, slots=True)
class Volume:
    """A closed solid between the ground (or `bottom`) and its roof.

    Attributes
    ----------
    ring : wall line, counter-clockwise
    faces : roof faces, each convex and counter-clockwise; without overlap they cover the ring and the overhang
    slab_m : thickness of the roof at its edges; 0 where the roof ends with the walls
    bottom : height where the walls begin; None: in the ground
    kind : main, dormer, chimney, or one of the others in `roofs`
    windows : False for walls without any
    carried : it stands on other volumes or hangs from them, begins exactly at `bottom`, and its underside may be seen; its ring is convex
    """

    ring: Ring
    faces: tuple[LocalFace, ...]
    slab_m: float = 0.0
    bottom: float | None = None
    kind: str = MAIN
    windows: bool = True
    carried: bool = False

    @property
    def of_outline(self) -> bool:
        """Whether the outline of the building reaches as far: main bodies in the ground, or carried over it."""
        return (self.kind == MAIN and self.carried) or (self.bottom is None and self.kind != roofs.POST)


def moved(volume: Volume, angle: float, u: float, v: float) -> Volume:
    """Turned about (0, 0) by `angle` (radians), then shifted; corners are whole micrometres, so neighbours tie."""
    c, s = quarter_exact(angle)

    def ring_of(ring: Ring) -> Ring:
        return tuple((round(c * a - s * b + u, 6), round(s * a + c * b + v, 6)) for a, b in ring)

    def face_of(f: LocalFace) -> LocalFace:
        slope_u, slope_v = c * f.slope_u - s * f.slope_v, s * f.slope_u + c * f.slope_v
        return LocalFace(ring_of(f.ring), slope_u, slope_v, f.height - slope_u * u - slope_v * v, f.kind)

    return replace(volume, ring=ring_of(volume.ring), faces=tuple(face_of(f) for f in volume.faces))


def quarter_exact(angle: float) -> tuple[float, float]:
    """Cosine and sine without rounding noise at quarter turns, so that neighbours keep common corners bit for bit."""
    c, s = float(np.cos(angle)), float(np.sin(angle))
    return (round(c), round(s)) if min(abs(c), abs(s)) < 1e-12 else (c, s)


def raised(volume: Volume, by: float) -> Volume:
    """The same volume `by` metres higher."""
    faces = tuple(replace(f, height=f.height + by) for f in volume.faces)
    return replace(volume, faces=faces, bottom=None if volume.bottom is None else volume.bottom + by)


def _slab(over: Overhang) -> float:
    return SLAB_M if over.any else 0.0


def flat_roof(ring: Ring, height: float, over: float = 0.0) -> Volume:
    """A level roof; `over` only for rectangles that begin at (0, 0)."""
    shape = ring
    if over:
        (u_1, v_1) = np.max(ring, axis=0)
        shape = roofs.rectangle(-over, -over, float(u_1) + over, float(v_1) + over)
    return Volume(ring, (LocalFace(shape, 0, 0, height),), SLAB_M if over else 0.0)


def shed_roof(length: float, depth: float, eave: float, slope: float, over: Overhang) -> Volume:
    ring = roofs.rectangle(-over.left, -over.front, length + over.right, depth + over.back)
    return Volume(roofs.rectangle(0, 0, length, depth), (LocalFace(ring, 0, slope, eave),), _slab(over))


def gable_roof(length: float, depth: float, eave: float, slope: float, over: Overhang, ridge_at: float = 0.5) -> Volume:
    """Ridge along u at the share `ridge_at` of the depth; `slope` is that of a symmetric roof of the same ridge."""
    middle, rise = depth * ridge_at, slope * depth / 2
    front, back = rise / middle, rise / (depth - middle)
    u_0, u_1 = -over.left, length + over.right
    faces = (
        LocalFace(roofs.rectangle(u_0, -over.front, u_1, middle), 0, front, eave),
        LocalFace(roofs.rectangle(u_0, middle, u_1, depth + over.back), 0, -back, eave + back * depth),
    )
    return Volume(roofs.rectangle(0, 0, length, depth), faces, _slab(over))


def hip_roof(length: float, depth: float, eave: float, slope: float, over: float) -> Volume:
    """Four faces of one slope; a pyramid where length equals depth. Needs length >= depth."""
    own = Volume((), tuple(roofs.hip(length + 2 * over, depth + 2 * over, eave - slope * over, slope)))
    faces = moved(own, 0.0, -over, -over).faces
    return Volume(roofs.rectangle(0, 0, length, depth), faces, SLAB_M if over else 0.0)


def half_hip_roof(length: float, depth: float, eave: float, slope: float, over: float, share: float) -> Volume:
    """A gable whose ends are hipped above `share` of the height between eave and ridge."""
    long, deep, low = length + 2 * over, depth + 2 * over, eave - slope * over
    half, start = deep / 2, share * deep / 2
    run = (half - start) * 0.9
    end = slope * (half - start) / run
    top = low + slope * start
    faces = (
        LocalFace(((0, 0), (long, 0), (long, start), (long - run, half), (run, half), (0, start)), 0, slope, low),
        LocalFace(
            ((long, deep), (0, deep), (0, deep - start), (run, half), (long - run, half), (long, deep - start)),
            0, -slope, low + slope * deep,
        ),
        LocalFace(((0, deep - start), (0, start), (run, half)), end, 0, top),
        LocalFace(((long, start), (long, deep - start), (long - run, half)), -end, 0, top + end * long),
    )  # fmt: skip
    own = moved(Volume((), faces), 0.0, -over, -over)
    return Volume(roofs.rectangle(0, 0, length, depth), own.faces, SLAB_M if over else 0.0)


def cone_roof(ring: FloatArray, centre: tuple[float, float], eave: float, slope: float, over: float) -> Volume:
    """One triangle per side of a regular ring, rising to `centre`."""
    spokes = ring - np.asarray(centre)
    reach = float(np.linalg.norm((spokes[0] + spokes[1]) / 2))
    outer = np.asarray(centre) + spokes * (1 + over / reach)
    faces = []
    for a, b in zip(outer, np.roll(outer, -1, axis=0), strict=True):
        inward = np.asarray(centre) - (a + b) / 2
        g = inward / np.linalg.norm(inward) * slope
        low = eave - slope * over
        tip = (float(centre[0]), float(centre[1]))
        corners = ((float(a[0]), float(a[1])), (float(b[0]), float(b[1])), tip)
        faces.append(LocalFace(corners, float(g[0]), float(g[1]), float(low - g @ a)))
    return Volume(tuple((float(u), float(v)) for u, v in ring), tuple(faces), SLAB_M if over else 0.0)


def dormer(u: float, v: tuple[float, float], width: float, height: float, bottom: float) -> Volume:
    """A box that stands out of a roof, windows in its front (v = v[0])."""
    ring = roofs.rectangle(u, v[0], u + width, v[1])
    return Volume(ring, (LocalFace(ring, 0, 0, height, roofs.DORMER),), 0.0, bottom, roofs.DORMER)


def chimney(u: float, v: float, height: float, bottom: float) -> Volume:
    ring = roofs.rectangle(u, v, u + CHIMNEY_M, v + CHIMNEY_M)
    return Volume(ring, (LocalFace(ring, 0, 0, height, roofs.CHIMNEY),), 0.0, bottom, roofs.CHIMNEY, windows=False)


@dataclass(frozen=True, slots=True)
class RoofLines:
    """Faces of a roof as half planes: inward unit normals (S, 2) and offsets (S,) of all sides, where the sides of each
    face begin (F,), and slope_u, slope_v, height of each face (F, 3)."""

    normal: FloatArray
    offset: FloatArray
    first: IntArray
    planes: FloatArray

    @classmethod
    def of(cls, faces: tuple[LocalFace, ...]) -> RoofLines:
        rings = [np.asarray(f.ring) for f in faces]
        counts = np.array([len(r) for r in rings])
        first = np.cumsum(counts) - counts
        corner = np.concatenate(rings)
        following = np.arange(1, len(corner) + 1)
        following[first + counts - 1] = first
        edge = corner[following] - corner
        normal = np.column_stack([-edge[:, 1], edge[:, 0]]) / np.hypot(edge[:, 0], edge[:, 1])[:, None]
        planes = np.array([(f.slope_u, f.slope_v, f.height) for f in faces])
        return cls(normal, -np.sum(normal * corner, axis=1), first, planes)


def wall_profile(a: tuple[float, float], b: tuple[float, float], roof: RoofLines) -> FloatArray:
    """Roof height along the wall from a to b.

    Returns
    -------
    (K, 4) pieces: share of the length where each begins and ends, and the heights there; metres
    """
    start, step = np.asarray(a), np.subtract(b, a)
    rate, gap = roof.normal @ step, roof.normal @ start + roof.offset
    crossing = np.abs(rate) > 1e-9
    t = -gap[crossing] / rate[crossing]
    t = np.unique(np.round(np.concatenate([[0.0, 1.0], t[(t > 0) & (t < 1)]]), 9))
    middle = (t[:-1] + t[1:]) / 2
    inward = gap[:, None] + rate[:, None] * middle
    inside = np.minimum.reduceat(inward, roof.first, axis=0)
    # under no face, by some rounding of its edge: the nearest one's
    owner = np.argmax(np.where(inside >= -1e-6, 0.0, inside), axis=0)
    first = np.flatnonzero(np.concatenate([[True], owner[1:] != owner[:-1]]))
    ends = t[np.append(first, len(t) - 1)]
    at = start + ends[:, None] * step
    plane = roof.planes[owner[first]]
    z_0 = np.sum(at[:-1] * plane[:, :2], axis=1) + plane[:, 2]
    z_1 = np.sum(at[1:] * plane[:, :2], axis=1) + plane[:, 2]
    return np.column_stack([ends[:-1], ends[1:], z_0, z_1])

"""Bodies with walls and roofs of their own that touch, as points with colours: what `drawn_farms.py` makes its groups of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from cityflow.core.arrays import BoolArray, FloatArray
from split_unbroken import lattice

GROUND = (96.0, 112.0, 84.0)
SHADE = 0.65
"""Brightness of a roof's side that lies away from the sun."""


@dataclass(frozen=True)
class Body:
    """A part of a building, or one.

    Attributes
    ----------
    ring : u_0, v_0, u_1, v_1 of its walls, metres
    along_u : whether its ridge runs along u
    eaves, slope : metres, tangent; 0 is a level roof
    hip : whether its ends slope, too
    shed : whether the roof rises along u over its whole length instead
    into : how far its roof goes on over its neighbour's where it is higher: at u_0, v_0, u_1, v_1, metres
    """

    ring: tuple[float, float, float, float]
    along_u: bool
    eaves: float
    slope: float
    roof: FloatArray
    wall: FloatArray
    hip: bool = False
    into: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    shed: bool = False

    def reach(self) -> tuple[float, float, float, float]:
        (a, b, c, d), (p, q, r, s) = self.ring, self.into
        return a - p, b - q, c + r, d + s

    def top(self, uv: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N,) height of its roof, −inf outside; signed distance across from its ridge."""
        u_0, v_0, u_1, v_1 = self.ring
        half = (v_1 - v_0) / 2 if self.along_u else (u_1 - u_0) / 2
        across = uv[:, 1] - (v_0 + v_1) / 2 if self.along_u else uv[:, 0] - (u_0 + u_1) / 2
        inwards = half - np.abs(across)
        if self.hip:
            ends = (uv[:, 0] - u_0, u_1 - uv[:, 0]) if self.along_u else (uv[:, 1] - v_0, v_1 - uv[:, 1])
            inwards = np.minimum(inwards, np.minimum(*ends))
        inside = within(self.reach(), uv)
        if self.shed:
            rise = self.slope * (uv[:, 0] - (u_0 if self.slope > 0 else u_1))
            return np.where(inside, self.eaves + rise, -np.inf), -np.ones(len(uv))
        return np.where(inside, self.eaves + self.slope * np.maximum(inwards, 0.0), -np.inf), across


@dataclass(frozen=True)
class Group:
    """Bodies that touch, and the borders among them: pairs of (u, v)."""

    bodies: tuple[Body, ...]
    borders: tuple[tuple[tuple[float, float], tuple[float, float]], ...] = ()


def within(ring: tuple[float, float, float, float], uv: FloatArray) -> BoolArray:
    return np.asarray((uv[:, 0] >= ring[0]) & (uv[:, 0] <= ring[2]) & (uv[:, 1] >= ring[1]) & (uv[:, 1] <= ring[3]))


def points_of(group: Group, rng: np.random.Generator) -> FloatArray:
    """(N, 6) u, v, z, colours of ground, roofs and walls."""
    rings = np.array([b.ring for b in group.bodies])
    low, high = rings[:, :2].min(axis=0) - 8.0, rings[:, 2:].max(axis=0) + 8.0
    uv = lattice((float(low[0]), float(high[0])), (float(low[1]), float(high[1])))
    inside = np.any([within(b.ring, uv) for b in group.bodies], axis=0)
    tops, across = (np.array(a) for a in zip(*(b.top(uv) for b in group.bodies), strict=True))
    owner, each = tops.argmax(axis=0), np.arange(len(uv))
    z = np.where(inside, tops[owner, each], 0.0)
    colour = np.array([b.roof for b in group.bodies])[owner]
    sloped = np.array([b.slope for b in group.bodies])[owner] > 0
    colour[(across[owner, each] > 0) & sloped] *= SHADE
    colour[~inside] = GROUND
    points = np.concatenate([np.column_stack([uv, z, colour]), *(_walls(b, group) for b in group.bodies)])
    texture = gaussian_filter(rng.normal(0, 1, (600, 600)), 4.0)
    i, j = (np.abs(points[:, :2] * 5).astype(np.int64) % 600).T
    points[:, 3:] *= 1 + 0.05 * (texture / texture.std())[i, j][:, None]
    return points


def _walls(body: Body, group: Group) -> FloatArray:
    """What of a body's walls stands above the ground and above the others' roofs."""
    u_0, v_0, u_1, v_1 = body.ring
    found = []
    for a, b in (
        ((u_0, v_0), (u_1, v_0)),
        ((u_1, v_0), (u_1, v_1)),
        ((u_1, v_1), (u_0, v_1)),
        ((u_0, v_1), (u_0, v_0)),
    ):
        length = float(np.hypot(b[0] - a[0], b[1] - a[1]))
        sz = lattice((0.0, length), (0.0, body.eaves + body.slope * 10.0))
        uv = np.array(a) + sz[:, :1] / length * (np.array(b) - np.array(a))
        below = (
            np.max([o.top(uv)[0] for o in group.bodies if o is not body], axis=0, initial=0.0)
            if len(group.bodies) > 1
            else np.zeros(len(uv))
        )
        kept = (sz[:, 1] < body.top(uv)[0]) & (sz[:, 1] > below)
        wall = np.tile(body.wall, (len(uv), 1))
        glass = (np.abs(sz[:, 0] % 3.0 - 1.5) < 0.6) & (sz[:, 1] % 2.8 > 0.9) & (sz[:, 1] % 2.8 < 2.2)
        wall[glass] = (50.0, 55.0, 62.0)
        found.append(np.column_stack([uv, sz[:, 1], wall])[kept])
    return np.concatenate(found)

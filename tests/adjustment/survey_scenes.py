"""A village as points: what a scan and photographs would measure of houses with gabled roofs on gently sloping ground."""

from __future__ import annotations

import numpy as np
import shapely

from cityflow.adjustment.block import rotation_of
from cityflow.geometry.similarity import Similarity

EXTENT = (140.0, 110.0)
PLACE = np.array([85000.0, 447000.0, 12.0])


def houses(seed: int, count: int = 14) -> np.ndarray:
    """(N, 6) middle x and y, half length, half width, direction, height of the eaves; they do not touch."""
    rng = np.random.default_rng(seed)
    found: list[tuple[float, ...]] = []
    while len(found) < count:
        x, y = rng.uniform(10, EXTENT[0] - 10), rng.uniform(10, EXTENT[1] - 10)
        if all(np.hypot(x - h[0], y - h[1]) > 19 for h in found):
            found.append((x, y, rng.uniform(5, 8), rng.uniform(3.5, 5), rng.uniform(0, np.pi), rng.uniform(3, 6.5)))
    return np.array(found)


def surface(town: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """(N,) height of the highest thing at (N, 2) places."""
    z = 0.02 * xy[:, 0] + 0.8 * np.sin(xy[:, 1] / 25)
    for house in town:
        along, across = _own(house, xy)
        inside = (np.abs(along) < house[2]) & (np.abs(across) < house[3])
        z[inside] = (
            (0.02 * house[0] + 0.8 * np.sin(house[1] / 25)) + house[5] + 0.8 * (house[3] - np.abs(across[inside]))
        )
    return z


def _own(house: np.ndarray, xy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    off, c, s = xy - house[:2], np.cos(house[4]), np.sin(house[4])
    return off[:, 0] * c + off[:, 1] * s, off[:, 1] * c - off[:, 0] * s


def measured(town: np.ndarray, seed: int, count: int, noise_m: float, walls: float, wrong: float = 0.0) -> np.ndarray:
    """(N, 3) points on ground and roofs, and on walls, in the world.

    Parameters
    ----------
    walls : share of the points that lie on walls;  wrong : share that lies anywhere within metres
    """
    rng = np.random.default_rng(seed)
    xy = rng.uniform((0, 0), EXTENT, (count, 2))
    xyz = np.column_stack([xy, surface(town, xy)])
    upright = []
    for house in town[rng.integers(len(town), size=int(count * walls))] if len(town) else ():
        side, at = rng.integers(4), rng.uniform(-1, 1)
        along, across = (
            (at * house[2], (-1) ** side * house[3]) if side < 2 else ((-1) ** side * house[2], at * house[3])
        )
        c, s = np.cos(house[4]), np.sin(house[4])
        low = 0.02 * house[0] + 0.8 * np.sin(house[1] / 25)
        upright.append(
            (house[0] + along * c - across * s, house[1] + along * s + across * c, low + rng.uniform(0, house[5]))
        )
    xyz = np.concatenate([xyz, np.array(upright).reshape(-1, 3)])
    xyz += rng.normal(0, noise_m, xyz.shape)
    off = rng.random(len(xyz)) < wrong
    xyz[off] += rng.normal(0, 3, (int(off.sum()), 3))
    return np.asarray(xyz + PLACE)


def moved_away(
    xyz: np.ndarray, shift: tuple[float, float, float], turn_deg: tuple[float, float, float], scale: float
) -> tuple[np.ndarray, Similarity]:
    """Points that are off as a whole, and what they are off by."""
    turn = rotation_of(np.radians([turn_deg]))[0]
    by = Similarity.about(np.asarray(xyz.mean(axis=0)), scale, turn, np.array(shift))
    return by.moved(xyz), by


def outline(house: np.ndarray) -> shapely.Polygon:
    """Its walls in plan, metres from `PLACE`."""
    c, s = np.cos(house[4]), np.sin(house[4])
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * house[2:4]
    return shapely.Polygon(corners @ np.array([[c, s], [-s, c]]) + house[:2])

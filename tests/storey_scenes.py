"""Small buildings with walls, seen from all sides: a block, a set-back, an arcade, a passage, a loggia, a bay window, a balcony."""

from __future__ import annotations

import numpy as np
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.facade_points import WallPoints
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence

ORIGIN = np.array([84_900.0, 447_500.0, 2.0])
HEIGHT, DENSITY = 9.0, 30.0
UPPER, VOID, LOGGIA = 3.2, 3.0, 2.7
"""Height of the storey that is set back, of the void, and of the loggia; metres."""
Plan = tuple[float, float]
Wall = tuple[Plan, Plan, float, float]
"""From, to (the outside is on the right), low, high."""

SHELL: tuple[Wall, ...] = (((12, 0), (12, 8), 0, HEIGHT), ((12, 8), (0, 8), 0, HEIGHT), ((0, 8), (0, 0), 0, HEIGHT))
FRONT: Wall = ((0, 0), (12, 0), 0, HEIGHT)
WALLS: dict[str, tuple[Wall, ...]] = {
    "block": (*SHELL, FRONT),
    "set-back": (*SHELL, ((0, 0), (12, 0), 0, HEIGHT - UPPER), ((0, 3), (12, 3), HEIGHT - UPPER, HEIGHT)),
    "arcade": (
        ((12, 8), (0, 8), 0, HEIGHT),
        ((0, 0), (12, 0), VOID, HEIGHT), ((0, 2.5), (12, 2.5), 0, VOID - 0.1),
        ((0, 8), (0, 0), VOID, HEIGHT), ((0, 8), (0, 2.5), 0, VOID),
        ((12, 0), (12, 8), VOID, HEIGHT), ((12, 2.5), (12, 8), 0, VOID),
    ),
    "passage": (
        ((0, 8), (0, 0), 0, HEIGHT), ((12, 0), (12, 8), 0, HEIGHT),
        ((0, 0), (12, 0), VOID, HEIGHT), ((0, 0), (4, 0), 0, VOID), ((7, 0), (12, 0), 0, VOID),
        ((12, 8), (0, 8), VOID, HEIGHT), ((12, 8), (7, 8), 0, VOID), ((4, 8), (0, 8), 0, VOID),
        ((4, 0), (4, 8), 0, VOID - 0.2), ((7, 8), (7, 0), 0, VOID - 0.2),
    ),
    "loggia": (
        *SHELL, ((0, 0), (12, 0), 0, VOID), ((0, 0), (12, 0), VOID + LOGGIA, HEIGHT),
        ((0, 0), (4, 0), VOID, VOID + LOGGIA), ((7.5, 0), (12, 0), VOID, VOID + LOGGIA),
        ((4, 1.6), (7.5, 1.6), VOID, VOID + LOGGIA - 0.4),
    ),
    "bay": (
        *SHELL, ((0, 0), (12, 0), 0, VOID), ((0, 0), (4, 0), VOID, HEIGHT), ((7.5, 0), (12, 0), VOID, HEIGHT),
        ((4, -1.2), (7.5, -1.2), VOID, HEIGHT), ((4, 0), (4, -1.2), VOID, HEIGHT), ((7.5, -1.2), (7.5, 0), VOID, HEIGHT),
    ),
    "balcony": (
        *SHELL, FRONT, ((4, -1.4), (7.5, -1.4), VOID - 0.2, VOID + 1.0),
        ((4, 0), (4, -1.4), VOID - 0.2, VOID + 1.0), ((7.5, -1.4), (7.5, 0), VOID - 0.2, VOID + 1.0),
    ),
}  # fmt: skip
VOLUME_M3 = {
    "block": 96 * HEIGHT,
    "set-back": 96 * HEIGHT - 36 * UPPER,
    "arcade": 96 * HEIGHT - 12 * 2.5 * VOID,
    "passage": 96 * HEIGHT - 3 * 8 * VOID,
    "loggia": 96 * HEIGHT - 3.5 * 1.6 * LOGGIA,
    "bay": 96 * HEIGHT + 3.5 * 1.2 * (HEIGHT - VOID),
    "balcony": 96 * HEIGHT,
}


def storeys(kind: str, noise: float, seed: int, turn: float = 0.3, walls: bool = True) -> Evidence:
    """Evidence of one building of 12 by 8 m, turned by `turn` (radians); `walls`: its façades are seen."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 12, 1920), rng.uniform(0, 8, 1920)
    z = HEIGHT - np.where((kind == "set-back") & (y < 3), UPPER, 0.0) + rng.normal(0, noise, 1920)
    parts = [_seen(rng, wall, noise) for wall in WALLS[kind]]
    xyz, normal = (np.concatenate(column) for column in zip(*parts, strict=True))
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    roof = np.column_stack([np.column_stack([x, y]) @ rotation, z]) + ORIGIN
    xyz[:, :2] = xyz[:, :2] @ rotation
    ring = np.array([(0, 0), (12, 0), (12, 8), (0, 8)]) @ rotation + ORIGIN[:2]
    count = len(xyz) if walls else 0
    seen = WallPoints(
        (xyz + ORIGIN)[:count], (normal @ rotation).astype(np.float32)[:count],
        np.full(count, noise, np.float32), np.full(count, 3, np.uint8),
    )  # fmt: skip
    return Evidence("unit", Polygon(ring), PointCloud.of(roof, BUILDING), float(ORIGIN[2]), walls=seen)


def _seen(rng: np.random.Generator, wall: Wall, noise: float) -> tuple[FloatArray, FloatArray]:
    """Points on a wall, and their normals."""
    (start, end, low, high) = wall
    step = np.subtract(end, start)
    length = float(np.hypot(*step))
    normal = np.array([step[1], -step[0]]) / length
    count = int(DENSITY * length * (high - low))
    xy = np.asarray(start) + rng.uniform(0, 1, (count, 1)) * step + normal * rng.normal(0, noise, (count, 1))
    return np.column_stack([xy, rng.uniform(low, high, count)]), np.tile(normal, (count, 1))

"""A row of houses whose borders are known, seen from above and from both sides: points with colours drawn into each frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely import Polygon, affinity, box

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import FrameRasters, SplitEvidence

SPACING_M = 0.06
DEPTH_M, SLOPE = 9.0, 0.7
GROUND = (96, 132, 74)
WINDOW = (50, 55, 62)
ORIGIN = np.array([85000.0, 447000.0, 0.0])
HALF = np.sqrt(0.5)
LOOKS = {
    "nadir": np.eye(3),
    "south": np.array([[1.0, 0.0, 0.0], [0.0, HALF, HALF], [0.0, -HALF, HALF]]),
    "north": np.array([[-1.0, 0.0, 0.0], [0.0, -HALF, HALF], [0.0, HALF, HALF]]),
}


@dataclass(frozen=True)
class House:
    """A house: width and height of its eaves (m), colours of roof and façade; `dormer` on its front."""

    width: float = 6.0
    eave: float = 6.0
    roof: tuple[int, int, int] = (150, 80, 60)
    facade: tuple[int, int, int] = (205, 190, 160)
    dormer: bool = False


def row_evidence(
    houses: Sequence[House],
    turn_deg: float = 17.0,
    tree_gap: tuple[int, float] | None = None,
    shadow: float | None = None,
    bend: tuple[int, float] | None = None,
) -> tuple[SplitEvidence, FloatArray]:
    """Evidence over a row, and (n, 2, 2) true borders in the world.

    Parameters
    ----------
    tree_gap : after which house a gap of how many metres is filled by a tree
    shadow : where along the row the shadow of something high begins, on roofs and ground; metres
    bend : after which house the row turns, by how many degrees
    """
    starts = np.cumsum([0.0, *(h.width for h in houses)])
    if tree_gap is not None:
        starts[tree_gap[0] + 1 :] += tree_gap[1]
    ends = np.array([s + h.width for s, h in zip(starts[:-1], houses, strict=True)])
    if tree_gap is not None:
        starts = np.r_[starts[: tree_gap[0] + 1], ends[tree_gap[0]] + tree_gap[1], starts[tree_gap[0] + 2 :]]
    rng = np.random.default_rng(5)
    parts = [_ground(float(ends[-1]))]
    parts += [_house(h, float(s)) for h, s in zip(houses, starts[:-1], strict=True)]
    if tree_gap is not None:
        parts.append(_tree(rng, float(ends[tree_gap[0]]), tree_gap[1]))
    points = np.concatenate(parts)
    if shadow is not None:
        points[points[:, 0] > shadow, 3:] *= 0.5
    hinge, angle = (float(ends[bend[0]]), bend[1]) if bend is not None else (np.inf, 0.0)
    points[:, :2] = _bent(points[:, :2], hinge, angle)
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    points[:, :2] = points[:, :2] @ np.array([[c, s], [-s, c]]) + ORIGIN[:2] + 30.0
    frames = tuple(_frame(name, points, rng) for name in LOOKS)
    outline = _placed(_row(float(ends[-1]), hinge, angle), turn_deg)
    inner = [e for e, n in zip(ends[:-1], starts[1:-1], strict=True) if abs(e - n) < 1e-6]
    lines = np.array([[[u, 0.0], [u, DEPTH_M]] for u in inner]).reshape(-1, 2, 2)
    # a border at the hinge belongs to both parts; that of the first is taken
    lines = np.array([_bent(line, hinge + 1e-9, angle) for line in lines]).reshape(-1, 2, 2)
    true = lines @ np.array([[c, s], [-s, c]]) + ORIGIN[:2] + 30.0
    return SplitEvidence("row", outline, frames, 0.0), true


def _bent(uv: FloatArray, hinge: float, angle_deg: float) -> FloatArray:
    """(n, 2) places along and across the row, those beyond the hinge turned about its middle."""
    if not np.isfinite(hinge):
        return uv
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    middle = np.array([hinge, DEPTH_M / 2])
    return np.where(uv[:, :1] > hinge, (uv - middle) @ np.array([[c, s], [-s, c]]) + middle, uv)


def _row(length: float, hinge: float, angle_deg: float) -> Polygon:
    """Outline of the row; what opens at the hinge is closed."""
    if not np.isfinite(hinge):
        return box(0, 0, length, DEPTH_M)
    second = affinity.rotate(box(hinge, 0, length, DEPTH_M), angle_deg, origin=(hinge, DEPTH_M / 2))
    both = box(0, 0, hinge, DEPTH_M).union(second)
    closed = both.buffer(0.4, join_style="mitre").buffer(-0.4, join_style="mitre")
    assert isinstance(closed, Polygon)
    return closed


def _placed(polygon: Polygon, turn_deg: float) -> Polygon:
    turned = affinity.rotate(polygon, turn_deg, origin=(0, 0))
    return affinity.translate(turned, ORIGIN[0] + 30.0, ORIGIN[1] + 30.0)


def _grid(a: tuple[float, float], b: tuple[float, float]) -> FloatArray:
    first, second = (np.arange(lo + SPACING_M / 2, hi, SPACING_M) for lo, hi in (a, b))
    return np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)


def _coloured(xyz: FloatArray, colour: tuple[int, int, int]) -> FloatArray:
    return np.hstack([xyz, np.broadcast_to(np.array(colour, np.float64), (len(xyz), 3))])


def _ground(length: float) -> FloatArray:
    uv = _grid((-8.0, length + 8.0), (-12.0, DEPTH_M + 12.0))
    beside = (uv[:, 0] < 0) | (uv[:, 0] > length) | (uv[:, 1] < 0) | (uv[:, 1] > DEPTH_M)
    return _coloured(np.column_stack([uv[beside], np.zeros(beside.sum())]), GROUND)


def _house(house: House, u_0: float) -> FloatArray:
    uv = _grid((u_0, u_0 + house.width), (0.0, DEPTH_M))
    z = house.eave + SLOPE * (DEPTH_M / 2 - np.abs(uv[:, 1] - DEPTH_M / 2))
    if house.dormer:
        middle = u_0 + house.width / 2
        z = np.where((np.abs(uv[:, 0] - middle) < 1.2) & (uv[:, 1] > 1.0) & (uv[:, 1] < 3.2), house.eave + 2.4, z)
    roof = _coloured(np.column_stack([uv, z]), house.roof)
    # the side turned away from the sun is darker
    roof[uv[:, 1] > DEPTH_M / 2, 3:] *= 0.6
    walls = [roof]
    for v in (0.0, DEPTH_M):
        uz = _grid((u_0, u_0 + house.width), (0.0, house.eave))
        wall = _coloured(np.column_stack([uz[:, 0], np.full(len(uz), v), uz[:, 1]]), house.facade)
        at, height = (uz[:, 0] - u_0) % (house.width / 2), uz[:, 1] % 2.8
        glass = (np.abs(at - house.width / 4) < 0.6) & (height > 0.9) & (height < 2.2)
        wall[glass, 3:] = WINDOW
        walls.append(wall)
    return np.concatenate(walls)


def _tree(rng: np.random.Generator, u_0: float, width: float) -> FloatArray:
    uv = _grid((u_0, u_0 + width), (0.0, DEPTH_M))
    leaves = _coloured(np.column_stack([uv, rng.uniform(4.0, 8.0, len(uv))]), (60, 90, 40))
    leaves[:, 3:] *= rng.uniform(0.5, 1.3, (len(uv), 1))
    return leaves


def _frame(name: str, points: FloatArray, rng: np.random.Generator) -> FrameRasters:
    """The nearest point to the camera in each cell; single holes take a neighbour's."""
    frame = LocalFrame(name, LOOKS[name], ORIGIN)
    xyz = frame.from_world(points[:, :3])
    cell = 0.08 if name == "nadir" else 0.1
    low, high = xyz.min(axis=0), xyz.max(axis=0)
    grid = Grid.covering((float(low[0]), float(low[1]), float(high[0]), float(high[1])), cell)
    row, col = grid.indices(xyz[:, 0], xyz[:, 1])
    inside = (row >= 0) & (col >= 0) & (row < grid.rows) & (col < grid.cols)
    order = np.flatnonzero(inside)[np.argsort(xyz[inside, 2], kind="stable")]
    dsm = np.full(grid.shape, np.nan, np.float32)
    ortho = np.zeros((3, *grid.shape), np.float32)
    dsm[row[order], col[order]] = xyz[order, 2]
    ortho[:, row[order], col[order]] = points[order, 3:].T
    dsm += rng.normal(0, 0.02, grid.shape).astype(np.float32)
    ortho += rng.normal(0, 4.0, ortho.shape).astype(np.float32)
    return FrameRasters(frame, grid, dsm, np.clip(ortho, 0, 255).astype(np.uint8), np.isfinite(dsm))

"""Façades that mislead: windows among balconies, bays, cornices, shops and hard shadows, and walls that only look as if they had windows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from scenes.drawn_facades import DrawnFacade, Layout, pictured_facade, wall_surface
from scenes.facade_canvas import Canvas, grid_of_windows
from scenes.facade_errors import FINE_M, ImageErrors
from scenes.hard_walls import WINDOWLESS, blank, letters, throw_shadows


def draw_hard_facade(style: str, errors: ImageErrors, rng: np.random.Generator) -> DrawnFacade:
    """One façade of `HARD` (with windows) or `WINDOWLESS`."""
    canvas = {**HARD, **WINDOWLESS}[style](rng)
    openings = np.array(canvas.openings, np.float64).reshape(-1, 5)
    layout = Layout(canvas.size_m, openings, canvas.storeys, np.array(canvas.whole, np.float64))
    return pictured_facade(layout, np.clip(canvas.image, 0, 255).astype(np.float32), errors, rng)


def _balconies(rng: np.random.Generator) -> Canvas:
    """Tall doors behind parapets in some columns; slabs throw shade."""
    canvas, wanted = grid_of_windows(rng)
    columns = sorted({round(o[0], 2) for o in wanted})
    chosen = [c for c in columns if rng.random() < 0.5]
    parapet, high = rng.uniform(60, 235), rng.uniform(0.7, 1.1)
    for o in wanted:
        if round(o[0], 2) not in chosen:
            canvas.glaze(o, rng)
            continue
        sill = max(o[2] - 0.85, 0.05)
        canvas.glaze([o[0], o[1], sill, o[3]], rng, whole=(o[3] - sill - high) / (o[3] - sill))
        wide = min(0.5, o[0] - 0.05)
        canvas.paint(o[0] - wide, o[1] + wide, max(sill - 0.9, 0), sill - 0.2, 0, 0.4)
        canvas.paint(o[0] - wide, o[1] + wide, max(sill - 0.2, 0), sill + high, parapet)
    return canvas


def _arches(rng: np.random.Generator) -> Canvas:
    """Windows with round heads."""
    canvas, wanted = grid_of_windows(rng)
    for o in wanted:
        before = canvas.image.copy()
        canvas.glaze(o, rng)
        y, x = np.mgrid[: len(canvas.image), : canvas.image.shape[1]] * FINE_M
        radius = (o[1] - o[0]) / 2
        depth = min(radius, 0.35 * (o[3] - o[2]))
        above = canvas.size_m[1] - y - (o[3] - depth)
        beyond = (above > 0) & (((x - (o[0] + o[1]) / 2) / radius) ** 2 + (above / depth) ** 2 > 1)
        canvas.image[beyond] = before[beyond]
    return canvas


def _reflecting(rng: np.random.Generator) -> Canvas:
    """Panes that mirror the sky, brighter than the wall, some of them dark."""
    canvas, wanted = grid_of_windows(rng)
    canvas.image *= 120 / canvas.image.mean()
    tone = rng.uniform(180, 240)
    for o in wanted:
        canvas.glaze(o, rng, frame=bool(rng.random() < 0.5))
        if rng.random() < 0.75:
            canvas.paint(o[0] + 0.06, o[1] - 0.06, o[2] + 0.06, o[3] - 0.06, tone * rng.uniform(0.9, 1.05))
    return canvas


def _irregular(rng: np.random.Generator) -> Canvas:
    """Windows of any size anywhere."""
    canvas = blank(rng)
    taken: list[list[float]] = []
    for _ in range(60):
        wide, high = rng.uniform(0.6, 2.2), rng.uniform(0.6, 2.2)
        left, low = rng.uniform(0.4, canvas.size_m[0] - 2.8), rng.uniform(0.6, canvas.size_m[1] - 2.6)
        box = [left, left + wide, low, low + high]
        apart = all(
            box[0] > t[1] + 0.5 or box[1] < t[0] - 0.5 or box[2] > t[3] + 0.5 or box[3] < t[2] - 0.5 for t in taken
        )
        if apart and len(taken) < 9:
            taken.append(box)
            canvas.glaze(box, rng)
    canvas.storeys = -1
    return canvas


def _staircase(rng: np.random.Generator) -> Canvas:
    """A column of tall windows over two storeys among usual ones."""
    canvas, wanted = grid_of_windows(rng, storeys=3)
    columns = sorted({round(o[0], 2) for o in wanted})
    tall = columns[len(columns) // 2]
    top = max(o[3] for o in wanted)
    canvas.glaze([tall, tall + 1.0, max(top - 3.8, 0.5), top], rng)
    for o in wanted:
        if o[1] < tall - 0.2 or o[0] > tall + 1.2:
            canvas.glaze(o, rng)
    return canvas


def _dormer(rng: np.random.Generator) -> Canvas:
    """The front of a dormer: one window that fills most of it."""
    size = (round(rng.uniform(1.8, 3.0), 2), round(rng.uniform(1.6, 2.2), 2))
    image = wall_surface(round(size[1] / FINE_M), round(size[0] / FINE_M), "plain", rng)
    canvas = Canvas(image, size, [], [], 1)
    side = rng.uniform(0.25, 0.5)
    canvas.glaze([side, size[0] - side, rng.uniform(0.3, 0.5), size[1] - rng.uniform(0.25, 0.4)], rng)
    return canvas


def _bay(rng: np.random.Generator) -> Canvas:
    """An upright strip that stands out: its sides lighter and darker, shade beneath it."""
    canvas, wanted = grid_of_windows(rng)
    columns = sorted({(round(o[0], 2), round(o[1], 2)) for o in wanted})
    a, b = columns[int(rng.integers(len(columns)))]
    lowest = min(o[2] for o in wanted)
    canvas.paint(a - 0.35, b + 0.35, max(lowest - 0.6, 0), canvas.size_m[1], canvas.image.mean() * rng.uniform(0.8, 1.1), 0.8)  # fmt: skip
    canvas.paint(a - 0.35, a - 0.2, max(lowest - 0.6, 0), canvas.size_m[1], 0, 0.35)
    canvas.paint(b + 0.2, b + 0.6, max(lowest - 1.0, 0), canvas.size_m[1], 0, 0.35)
    for o in wanted:
        canvas.glaze(o, rng)
    return canvas


def _cornices(rng: np.random.Generator) -> Canvas:
    """Bands between storeys, quoins, pilasters, and broad surrounds of windows."""
    canvas, wanted = grid_of_windows(rng)
    stone = min(canvas.image.mean() * rng.uniform(1.25, 1.6), 240)
    for sill in sorted({round(o[2], 2) for o in wanted}):
        canvas.paint(0, canvas.size_m[0], max(sill - 0.75, 0), max(sill - 0.45, 0.1), stone)
    for y in np.arange(0, canvas.size_m[1], 0.8):
        canvas.paint(0, 0.5, y, y + 0.4, stone)
        canvas.paint(canvas.size_m[0] - 0.5, canvas.size_m[0], y, y + 0.4, stone)
    for o in wanted:
        canvas.paint(o[0] - 0.16, o[1] + 0.16, o[2] - 0.12, o[3] + 0.22, stone)
        canvas.glaze(o, rng)
    return canvas


def _slabs(rng: np.random.Generator) -> Canvas:
    """Concrete slabs with dark joints and a window in most."""
    canvas, wanted = grid_of_windows(rng)
    columns, rows = sorted({round(o[0], 2) for o in wanted}), sorted({round(o[2], 2) for o in wanted})
    for at in [(a + b) / 2 + 0.5 for a, b in pairwise(columns)]:
        canvas.paint(at - 0.02, at + 0.04, 0, canvas.size_m[1], 70)
    for at in rows:
        canvas.paint(0, canvas.size_m[0], max(at - 0.9, 0), max(at - 0.84, 0.06), 70)
    for o in wanted:
        canvas.glaze(o, rng)
    return canvas


def _half_blinds(rng: np.random.Generator) -> Canvas:
    """Roller blinds drawn to different heights."""
    canvas, wanted = grid_of_windows(rng)
    tone = rng.uniform(120, 225)
    for o in wanted:
        canvas.glaze(o, rng)
        drawn = rng.choice([0, 0, 0.3, 0.5, 0.8, 1.0])
        canvas.paint(o[0], o[1], o[3] - drawn * (o[3] - o[2]), o[3], tone)
    return canvas


def _shops(rng: np.random.Generator) -> Canvas:
    """A ground floor of large panes under a board with letters, usual windows above; panes are not asked for."""
    canvas, wanted = grid_of_windows(rng, storeys=2)
    level = min(o[2] for o in wanted) + 1.6
    x = 0.5
    while x + 2.0 < canvas.size_m[0]:
        wide = rng.uniform(1.4, 2.8)
        canvas.glaze([x, min(x + wide, canvas.size_m[0] - 0.3), 0.3, level - 0.3], rng, whole=0.0)
        x += wide + 0.3
    board = rng.choice([[200, 30, 30], [30, 60, 160], [240, 240, 240], [40, 120, 60]])
    canvas.paint(0.3, canvas.size_m[0] - 0.3, level - 0.2, level + 0.5, board)
    letters(canvas, 0.6, level - 0.1, 0.4, 255.0 - np.asarray(board, float), rng)
    for o in wanted:
        if o[2] > level + 0.5:
            canvas.glaze(o, rng)
    canvas.storeys = -1
    return canvas


def _hard_shadows(rng: np.random.Generator) -> Canvas:
    """Windows on a wall with the shadows of a neighbour, of chimneys and of poles."""
    canvas, wanted = grid_of_windows(rng)
    for o in wanted:
        canvas.glaze(o, rng)
    throw_shadows(canvas, rng)
    return canvas


HARD: Mapping[str, Callable[[np.random.Generator], Canvas]] = MappingProxyType({
    "balconies": _balconies, "arches": _arches, "reflecting panes": _reflecting, "irregular": _irregular, "staircase": _staircase,
    "dormer": _dormer, "bay": _bay, "cornices": _cornices, "slabs": _slabs, "half-drawn blinds": _half_blinds, "shops": _shops,
    "hard shadows": _hard_shadows,
})  # fmt: skip

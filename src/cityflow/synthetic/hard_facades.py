"""Façades that mislead: windows among balconies, bays, cornices, shops and hard shadows, and walls that only look as if they had windows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import cv2
import numpy as np

from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.synthetic.drawn_facades import (
    FINE_M,
    DrawnFacade,
    ImageErrors,
    Layout,
    layout_of,
    pictured_facade,
    smooth_noise,
    wall_surface,
    window_part,
)
from cityflow.synthetic.town_facades import DOOR, WINDOW


@dataclass(slots=True)
class _Canvas:
    """A wall that is being painted, and the share of each of its openings that nothing stands before."""

    image: Float32Array
    size_m: tuple[float, float]
    openings: list[list[float]]
    whole: list[float]
    storeys: int

    def paint(self, left: float, right: float, bottom: float, top: float, colour: FloatArray | float, share: float = 1.0) -> None:  # fmt: skip
        part = window_part(self.image, self.size_m[1], np.array([left, right, bottom, top]))
        part[:] = (1 - share) * part + share * np.asarray(colour)

    def glaze(self, opening: list[float], rng: np.random.Generator, whole: float = 1.0, frame: bool = True) -> None:
        """A window with glass that is lighter above, a frame, and now and then a curtain."""
        part = window_part(self.image, self.size_m[1], np.array(opening))
        rows = len(part)
        part[:] = (rng.uniform(25, 75) * np.linspace(rng.uniform(0.9, 1.6), 1.0, max(rows, 1)))[:, None, None]
        if rng.random() < 0.2:
            part[: rows // 2] += 50
        if frame:
            part[:3] = part[-3:] = part[:, :3] = part[:, -3:] = 225
        self.openings.append([*opening, WINDOW])
        self.whole.append(whole)


def draw_hard_facade(style: str, errors: ImageErrors, rng: np.random.Generator) -> DrawnFacade:
    """One façade of `HARD` (with windows) or `WINDOWLESS`."""
    canvas = {**HARD, **WINDOWLESS}[style](rng)
    openings = np.array(canvas.openings, np.float64).reshape(-1, 5)
    layout = Layout(canvas.size_m, openings, canvas.storeys, np.array(canvas.whole, np.float64))
    return pictured_facade(layout, np.clip(canvas.image, 0, 255).astype(np.float32), errors, rng)


def _grid(rng: np.random.Generator, storeys: int | None = None) -> tuple[_Canvas, list[list[float]]]:
    """A wall and the windows of a usual layout, not yet painted."""
    layout = layout_of("plain", rng)
    while len(layout.openings) < 4 or (storeys and layout.storeys < storeys):
        layout = layout_of("plain", rng)
    rows, cols = (round(v / FINE_M) for v in layout.size_m[::-1])
    image = wall_surface(rows, cols, "plain", rng)
    wanted = [o[:4].tolist() for o in layout.openings if o[4] == WINDOW]
    return _Canvas(image, layout.size_m, [], [], layout.storeys), wanted


def _blank(rng: np.random.Generator) -> _Canvas:
    size = (round(rng.uniform(8, 25), 2), round(rng.uniform(5, 14), 2))
    image = wall_surface(round(size[1] / FINE_M), round(size[0] / FINE_M), "blank", rng)
    return _Canvas(image, size, [], [], 0)


def _balconies(rng: np.random.Generator) -> _Canvas:
    """Tall doors behind parapets in some columns; slabs throw shade."""
    canvas, wanted = _grid(rng)
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


def _arches(rng: np.random.Generator) -> _Canvas:
    """Windows with round heads."""
    canvas, wanted = _grid(rng)
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


def _reflecting(rng: np.random.Generator) -> _Canvas:
    """Panes that mirror the sky, brighter than the wall, some of them dark."""
    canvas, wanted = _grid(rng)
    canvas.image *= 120 / canvas.image.mean()
    tone = rng.uniform(180, 240)
    for o in wanted:
        canvas.glaze(o, rng, frame=bool(rng.random() < 0.5))
        if rng.random() < 0.75:
            canvas.paint(o[0] + 0.06, o[1] - 0.06, o[2] + 0.06, o[3] - 0.06, tone * rng.uniform(0.9, 1.05))
    return canvas


def _irregular(rng: np.random.Generator) -> _Canvas:
    """Windows of any size anywhere."""
    canvas = _blank(rng)
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


def _staircase(rng: np.random.Generator) -> _Canvas:
    """A column of tall windows over two storeys among usual ones."""
    canvas, wanted = _grid(rng, storeys=3)
    columns = sorted({round(o[0], 2) for o in wanted})
    tall = columns[len(columns) // 2]
    top = max(o[3] for o in wanted)
    canvas.glaze([tall, tall + 1.0, max(top - 3.8, 0.5), top], rng)
    for o in wanted:
        if o[1] < tall - 0.2 or o[0] > tall + 1.2:
            canvas.glaze(o, rng)
    return canvas


def _dormer(rng: np.random.Generator) -> _Canvas:
    """The front of a dormer: one window that fills most of it."""
    size = (round(rng.uniform(1.8, 3.0), 2), round(rng.uniform(1.6, 2.2), 2))
    image = wall_surface(round(size[1] / FINE_M), round(size[0] / FINE_M), "plain", rng)
    canvas = _Canvas(image, size, [], [], 1)
    side = rng.uniform(0.25, 0.5)
    canvas.glaze([side, size[0] - side, rng.uniform(0.3, 0.5), size[1] - rng.uniform(0.25, 0.4)], rng)
    return canvas


def _bay(rng: np.random.Generator) -> _Canvas:
    """An upright strip that stands out: its sides lighter and darker, shade beneath it."""
    canvas, wanted = _grid(rng)
    columns = sorted({(round(o[0], 2), round(o[1], 2)) for o in wanted})
    a, b = columns[int(rng.integers(len(columns)))]
    lowest = min(o[2] for o in wanted)
    canvas.paint(a - 0.35, b + 0.35, max(lowest - 0.6, 0), canvas.size_m[1], canvas.image.mean() * rng.uniform(0.8, 1.1), 0.8)  # fmt: skip
    canvas.paint(a - 0.35, a - 0.2, max(lowest - 0.6, 0), canvas.size_m[1], 0, 0.35)
    canvas.paint(b + 0.2, b + 0.6, max(lowest - 1.0, 0), canvas.size_m[1], 0, 0.35)
    for o in wanted:
        canvas.glaze(o, rng)
    return canvas


def _cornices(rng: np.random.Generator) -> _Canvas:
    """Bands between storeys, quoins, pilasters, and broad surrounds of windows."""
    canvas, wanted = _grid(rng)
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


def _slabs(rng: np.random.Generator) -> _Canvas:
    """Concrete slabs with dark joints and a window in most."""
    canvas, wanted = _grid(rng)
    columns, rows = sorted({round(o[0], 2) for o in wanted}), sorted({round(o[2], 2) for o in wanted})
    for at in [(a + b) / 2 + 0.5 for a, b in pairwise(columns)]:
        canvas.paint(at - 0.02, at + 0.04, 0, canvas.size_m[1], 70)
    for at in rows:
        canvas.paint(0, canvas.size_m[0], max(at - 0.9, 0), max(at - 0.84, 0.06), 70)
    for o in wanted:
        canvas.glaze(o, rng)
    return canvas


def _half_blinds(rng: np.random.Generator) -> _Canvas:
    """Roller blinds drawn to different heights."""
    canvas, wanted = _grid(rng)
    tone = rng.uniform(120, 225)
    for o in wanted:
        canvas.glaze(o, rng)
        drawn = rng.choice([0, 0, 0.3, 0.5, 0.8, 1.0])
        canvas.paint(o[0], o[1], o[3] - drawn * (o[3] - o[2]), o[3], tone)
    return canvas


def _shops(rng: np.random.Generator) -> _Canvas:
    """A ground floor of large panes under a board with letters, usual windows above; panes are not asked for."""
    canvas, wanted = _grid(rng, storeys=2)
    level = min(o[2] for o in wanted) + 1.6
    x = 0.5
    while x + 2.0 < canvas.size_m[0]:
        wide = rng.uniform(1.4, 2.8)
        canvas.glaze([x, min(x + wide, canvas.size_m[0] - 0.3), 0.3, level - 0.3], rng, whole=0.0)
        x += wide + 0.3
    board = rng.choice([[200, 30, 30], [30, 60, 160], [240, 240, 240], [40, 120, 60]])
    canvas.paint(0.3, canvas.size_m[0] - 0.3, level - 0.2, level + 0.5, board)
    _letters(canvas, 0.6, level - 0.1, 0.4, 255.0 - np.asarray(board, float), rng)
    for o in wanted:
        if o[2] > level + 0.5:
            canvas.glaze(o, rng)
    canvas.storeys = -1
    return canvas


def _hard_shadows(rng: np.random.Generator) -> _Canvas:
    """Windows on a wall with the shadows of a neighbour, of chimneys and of poles."""
    canvas, wanted = _grid(rng)
    for o in wanted:
        canvas.glaze(o, rng)
    _throw_shadows(canvas, rng)
    return canvas


def _shadows_alone(rng: np.random.Generator) -> _Canvas:
    canvas = _blank(rng)
    _throw_shadows(canvas, rng)
    return canvas


def _throw_shadows(canvas: _Canvas, rng: np.random.Generator) -> None:
    rows, cols = canvas.image.shape[:2]
    mask = np.zeros((rows, cols), np.uint8)
    slant = rng.uniform(-0.8, 0.8)
    for _ in range(int(rng.integers(2, 6))):
        x, y = rng.uniform(0, cols), rng.uniform(0, rows)
        wide, high = rng.uniform(0.15, 2.5) / FINE_M, rng.uniform(0.8, 6) / FINE_M
        ring = [(x, y), (x + wide, y + 0.3 * slant * wide), (x + wide + slant * high, y + high), (x + slant * high, y + high)]  # fmt: skip
        cv2.fillPoly(mask, [np.rint(ring).astype(np.int32)], 1)
    canvas.image *= (1 - rng.uniform(0.35, 0.6) * cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 1.5))[..., None]


def _ivy(rng: np.random.Generator) -> _Canvas:
    canvas = _blank(rng)
    shape = (canvas.image.shape[0], canvas.image.shape[1])
    y = np.linspace(0, 1, shape[0])[:, None]
    ragged = smooth_noise(*shape, 1.2, rng) + 0.6 * smooth_noise(*shape, 0.3, rng)
    covered = ragged + 2.2 * (y - rng.uniform(0.2, 0.8)) > 0
    leaves = 70 * (1 + 0.4 * smooth_noise(*shape, 0.1, rng))
    canvas.image[covered] = (leaves[..., None] * np.array([0.8, 1.15, 0.55]))[covered]
    return canvas


def _letters(canvas: _Canvas, left: float, low: float, high: float, colour: FloatArray, rng: np.random.Generator) -> None:  # fmt: skip
    text = "".join(chr(int(c)) for c in rng.integers(65, 91, 9))
    at = (round(left / FINE_M), round((canvas.size_m[1] - low) / FINE_M))
    marks = np.zeros(canvas.image.shape[:2], np.uint8)
    cv2.putText(marks, text, at, cv2.FONT_HERSHEY_SIMPLEX, high / FINE_M / 22, 255, 4)
    canvas.image[marks > 127] = colour


def _signs(rng: np.random.Generator) -> _Canvas:
    """A blank wall with letters painted on it, and now and then a board."""
    canvas = _blank(rng)
    tone = np.full(3, 30.0 if canvas.image.mean() > 128 else 235.0)
    _letters(canvas, rng.uniform(0.5, 2), rng.uniform(2.0, canvas.size_m[1] - 1.6), rng.uniform(0.6, 1.4), tone, rng)
    if rng.random() < 0.5:
        low = rng.uniform(1.0, canvas.size_m[1] - 2.5)
        canvas.paint(2.0, 6.0, low, low + 1.4, rng.uniform(30, 230, 3))
        _letters(canvas, 2.2, low + 0.4, 0.6, tone, rng)
    return canvas


def _cladding(rng: np.random.Generator) -> _Canvas:
    """Panels of scattered tone with dark joints."""
    canvas = _blank(rng)
    wide, high = rng.uniform(0.6, 1.8), rng.uniform(0.5, 1.4)
    scatter, joint = rng.uniform(0.03, 0.2), rng.uniform(30, 90)
    _tile(canvas, (wide, high), scatter, (2, joint), rng)
    return canvas


def _tile(
    canvas: _Canvas, size: tuple[float, float], scatter: float, joint: tuple[int, float], rng: np.random.Generator
) -> None:
    """Cover the wall with panels of a size in metres, of scattered brightness; a joint is so many fine pixels wide and so bright."""
    (wide, high), (px, tone) = size, joint
    for x in np.arange(0, canvas.size_m[0], wide):
        for y in np.arange(0, canvas.size_m[1], high):
            part = window_part(canvas.image, canvas.size_m[1], np.array([x, x + wide, y, y + high]))
            part *= 1 + scatter * rng.standard_normal()
            part[:px], part[:, :px] = tone, tone


def _timber(rng: np.random.Generator) -> _Canvas:
    """Dark beams on light plaster."""
    canvas = _blank(rng)
    canvas.image *= 200 / canvas.image.mean()
    for x in np.arange(0.2, canvas.size_m[0], rng.uniform(0.9, 1.5)):
        canvas.paint(x, x + 0.16, 0, canvas.size_m[1], np.array([70.0, 45, 30]))
    for y in np.arange(0.2, canvas.size_m[1], rng.uniform(1.0, 1.5)):
        canvas.paint(0, canvas.size_m[0], y, y + 0.16, np.array([70.0, 45, 30]))
    return canvas


def _boards(rng: np.random.Generator) -> _Canvas:
    """Upright boards or corrugated sheet, with stains."""
    canvas = _blank(rng)
    period = rng.uniform(0.15, 0.5)
    wave = 1 + rng.uniform(0.05, 0.25) * np.sign(np.sin(np.arange(canvas.image.shape[1]) * FINE_M * 2 * np.pi / period))
    stain = 1 + 0.12 * smooth_noise(canvas.image.shape[0], canvas.image.shape[1], 0.8, rng)
    canvas.image *= (wave[None] * stain).astype(np.float32)[..., None]
    return canvas


def _mirror(rng: np.random.Generator) -> _Canvas:
    """Glass from end to end that mirrors the sky and the houses opposite, with or without bars and bands before the floors."""
    canvas = _blank(rng)
    rows, cols = canvas.image.shape[:2]
    sky = 120 + 50 * smooth_noise(rows, cols, rng.uniform(1.0, 3.0), rng)
    y = np.arange(rows)[:, None] > rows * (1 - rng.uniform(0, 0.6)) + 30 * np.sign(
        smooth_noise(rows, cols, 2.0, rng)[:1]
    )
    canvas.image = ((sky - 60 * y)[..., None] * np.array([0.85, 0.95, 1.1])).astype(np.float32)
    wide, high, bar = rng.uniform(0.8, 2.0), rng.uniform(1.0, 3.2), rng.choice([20.0, 80.0, 200.0])
    spread = rng.uniform(0.02, 0.25)
    _tile(canvas, (wide, high), spread, (3, bar), rng)
    return canvas


def _garages(rng: np.random.Generator) -> _Canvas:
    """A row of garage doors; nothing of it is a window."""
    size = (round(rng.uniform(9, 25), 2), round(rng.uniform(2.6, 3.2), 2))
    image = wall_surface(round(size[1] / FINE_M), round(size[0] / FINE_M), "blank", rng)
    canvas, tone = _Canvas(image, size, [], [], 0), rng.uniform(40, 230)
    for x in np.arange(0.4, size[0] - 2.7, 2.9):
        canvas.paint(x, x + 2.4, 0.0, 2.1, tone * rng.uniform(0.85, 1.15))
        canvas.openings.append([x, x + 2.4, 0.0, 2.1, DOOR])
        canvas.whole.append(1.0)
    return canvas


HARD: Mapping[str, Callable[[np.random.Generator], _Canvas]] = MappingProxyType({
    "balconies": _balconies, "arches": _arches, "reflecting panes": _reflecting, "irregular": _irregular, "staircase": _staircase,
    "dormer": _dormer, "bay": _bay, "cornices": _cornices, "slabs": _slabs, "half-drawn blinds": _half_blinds, "shops": _shops,
    "hard shadows": _hard_shadows,
})  # fmt: skip
WINDOWLESS: Mapping[str, Callable[[np.random.Generator], _Canvas]] = MappingProxyType({
    "shadows alone": _shadows_alone, "ivy": _ivy, "signs": _signs, "cladding": _cladding, "timber": _timber, "boards": _boards,
    "mirror": _mirror, "garages": _garages,
})  # fmt: skip

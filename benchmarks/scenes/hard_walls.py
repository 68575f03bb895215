"""Walls without windows that look as if they had some."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import cv2
import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.synthetic.town_facades import DOOR
from scenes.drawn_facades import wall_surface, window_part
from scenes.facade_canvas import Canvas
from scenes.facade_errors import FINE_M, smooth_noise


def blank(rng: np.random.Generator) -> Canvas:
    size = (round(rng.uniform(8, 25), 2), round(rng.uniform(5, 14), 2))
    image = wall_surface(round(size[1] / FINE_M), round(size[0] / FINE_M), "blank", rng)
    return Canvas(image, size, [], [], 0)


def _shadows_alone(rng: np.random.Generator) -> Canvas:
    canvas = blank(rng)
    throw_shadows(canvas, rng)
    return canvas


def throw_shadows(canvas: Canvas, rng: np.random.Generator) -> None:
    rows, cols = canvas.image.shape[:2]
    mask = np.zeros((rows, cols), np.uint8)
    slant = rng.uniform(-0.8, 0.8)
    for _ in range(int(rng.integers(2, 6))):
        x, y = rng.uniform(0, cols), rng.uniform(0, rows)
        wide, high = rng.uniform(0.15, 2.5) / FINE_M, rng.uniform(0.8, 6) / FINE_M
        ring = [(x, y), (x + wide, y + 0.3 * slant * wide), (x + wide + slant * high, y + high), (x + slant * high, y + high)]  # fmt: skip
        cv2.fillPoly(mask, [np.rint(ring).astype(np.int32)], 1)
    canvas.image *= (1 - rng.uniform(0.35, 0.6) * cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 1.5))[..., None]


def _ivy(rng: np.random.Generator) -> Canvas:
    canvas = blank(rng)
    shape = (canvas.image.shape[0], canvas.image.shape[1])
    y = np.linspace(0, 1, shape[0])[:, None]
    ragged = smooth_noise(*shape, 1.2, rng) + 0.6 * smooth_noise(*shape, 0.3, rng)
    covered = ragged + 2.2 * (y - rng.uniform(0.2, 0.8)) > 0
    leaves = 70 * (1 + 0.4 * smooth_noise(*shape, 0.1, rng))
    canvas.image[covered] = (leaves[..., None] * np.array([0.8, 1.15, 0.55]))[covered]
    return canvas


def letters(canvas: Canvas, left: float, low: float, high: float, colour: FloatArray, rng: np.random.Generator) -> None:  # fmt: skip
    text = "".join(chr(int(c)) for c in rng.integers(65, 91, 9))
    at = (round(left / FINE_M), round((canvas.size_m[1] - low) / FINE_M))
    marks = np.zeros(canvas.image.shape[:2], np.uint8)
    cv2.putText(marks, text, at, cv2.FONT_HERSHEY_SIMPLEX, high / FINE_M / 22, 255, 4)
    canvas.image[marks > 127] = colour


def _signs(rng: np.random.Generator) -> Canvas:
    """A blank wall with letters painted on it, and now and then a board."""
    canvas = blank(rng)
    tone = np.full(3, 30.0 if canvas.image.mean() > 128 else 235.0)
    letters(canvas, rng.uniform(0.5, 2), rng.uniform(2.0, canvas.size_m[1] - 1.6), rng.uniform(0.6, 1.4), tone, rng)
    if rng.random() < 0.5:
        low = rng.uniform(1.0, canvas.size_m[1] - 2.5)
        canvas.paint(2.0, 6.0, low, low + 1.4, rng.uniform(30, 230, 3))
        letters(canvas, 2.2, low + 0.4, 0.6, tone, rng)
    return canvas


def _cladding(rng: np.random.Generator) -> Canvas:
    """Panels of scattered tone with dark joints."""
    canvas = blank(rng)
    wide, high = rng.uniform(0.6, 1.8), rng.uniform(0.5, 1.4)
    scatter, joint = rng.uniform(0.03, 0.2), rng.uniform(30, 90)
    _tile(canvas, (wide, high), scatter, (2, joint), rng)
    return canvas


def _tile(
    canvas: Canvas, size: tuple[float, float], scatter: float, joint: tuple[int, float], rng: np.random.Generator
) -> None:
    """Cover the wall with panels of a size in metres, of scattered brightness; a joint is so many fine pixels wide and so bright."""
    (wide, high), (px, tone) = size, joint
    for x in np.arange(0, canvas.size_m[0], wide):
        for y in np.arange(0, canvas.size_m[1], high):
            part = window_part(canvas.image, canvas.size_m[1], np.array([x, x + wide, y, y + high]))
            part *= 1 + scatter * rng.standard_normal()
            part[:px], part[:, :px] = tone, tone


def _timber(rng: np.random.Generator) -> Canvas:
    """Dark beams on light plaster."""
    canvas = blank(rng)
    canvas.image *= 200 / canvas.image.mean()
    for x in np.arange(0.2, canvas.size_m[0], rng.uniform(0.9, 1.5)):
        canvas.paint(x, x + 0.16, 0, canvas.size_m[1], np.array([70.0, 45, 30]))
    for y in np.arange(0.2, canvas.size_m[1], rng.uniform(1.0, 1.5)):
        canvas.paint(0, canvas.size_m[0], y, y + 0.16, np.array([70.0, 45, 30]))
    return canvas


def _boards(rng: np.random.Generator) -> Canvas:
    """Upright boards or corrugated sheet, with stains."""
    canvas = blank(rng)
    period = rng.uniform(0.15, 0.5)
    wave = 1 + rng.uniform(0.05, 0.25) * np.sign(np.sin(np.arange(canvas.image.shape[1]) * FINE_M * 2 * np.pi / period))
    stain = 1 + 0.12 * smooth_noise(canvas.image.shape[0], canvas.image.shape[1], 0.8, rng)
    canvas.image *= (wave[None] * stain).astype(np.float32)[..., None]
    return canvas


def _mirror(rng: np.random.Generator) -> Canvas:
    """Glass from end to end that mirrors the sky and the houses opposite, with or without bars and bands before the floors."""
    canvas = blank(rng)
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


def _garages(rng: np.random.Generator) -> Canvas:
    """A row of garage doors; nothing of it is a window."""
    size = (round(rng.uniform(9, 25), 2), round(rng.uniform(2.6, 3.2), 2))
    image = wall_surface(round(size[1] / FINE_M), round(size[0] / FINE_M), "blank", rng)
    canvas, tone = Canvas(image, size, [], [], 0), rng.uniform(40, 230)
    for x in np.arange(0.4, size[0] - 2.7, 2.9):
        canvas.paint(x, x + 2.4, 0.0, 2.1, tone * rng.uniform(0.85, 1.15))
        canvas.openings.append([x, x + 2.4, 0.0, 2.1, DOOR])
        canvas.whole.append(1.0)
    return canvas


WINDOWLESS: Mapping[str, Callable[[np.random.Generator], Canvas]] = MappingProxyType({
    "shadows alone": _shadows_alone, "ivy": _ivy, "signs": _signs, "cladding": _cladding, "timber": _timber, "boards": _boards,
    "mirror": _mirror, "garages": _garages,
})  # fmt: skip

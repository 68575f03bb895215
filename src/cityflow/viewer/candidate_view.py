"""All candidates of one unit, side by side: each model from four sides, with its scores."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw

from cityflow.core.arrays import ByteArray
from cityflow.core.building import Polyhedron
from cityflow.viewer.model_view import SKY, draw_models, no_terrain, surfaces_of

SIDES_DEG = (20.0, 110.0, 200.0, 290.0)
"""Where the viewer looks, clockwise from north."""
VIEW_PX, GAP_PX, LINE_PX = 340, 8, 16
INK, CHOSEN, PAPER = (40, 40, 40), (20, 110, 40), (250, 250, 248)


@dataclass(frozen=True, slots=True)
class DrawnCandidate:
    """A model with what is written over it; `chosen`: the one that the run kept."""

    solid: Polyhedron | None
    lines: tuple[str, ...]
    chosen: bool = False


def draw_candidates(candidates: Sequence[DrawnCandidate]) -> bytes:
    """A PNG with a column per candidate."""
    heads = max(len(c.lines) for c in candidates) * LINE_PX + 2 * GAP_PX
    columns = [_column(c, heads) for c in candidates]
    sheet = Image.fromarray(np.concatenate(columns, axis=1))
    pen = ImageDraw.Draw(sheet)
    for k, candidate in enumerate(candidates):
        for row, text in enumerate(candidate.lines):
            at = (k * (VIEW_PX + GAP_PX) + GAP_PX, GAP_PX + row * LINE_PX)
            pen.text(at, text, fill=CHOSEN if candidate.chosen else INK)
    buffer = io.BytesIO()
    sheet.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def _column(candidate: DrawnCandidate, heads: int) -> ByteArray:
    parts = [np.full((heads, VIEW_PX, 3), PAPER, np.uint8)]
    for side in SIDES_DEG if candidate.solid is not None else ():
        parts += [_view(candidate.solid, side), np.full((GAP_PX, VIEW_PX, 3), PAPER, np.uint8)]
    whole = heads + len(SIDES_DEG) * (VIEW_PX + GAP_PX)
    parts.append(np.full((whole - sum(len(p) for p in parts), VIEW_PX, 3), PAPER, np.uint8))
    return np.concatenate([np.concatenate(parts), np.full((whole, GAP_PX, 3), PAPER, np.uint8)], axis=1)


def _view(solid: Polyhedron | None, side: float) -> ByteArray:
    """A square picture, the model in its middle."""
    assert solid is not None
    pixels = draw_models(surfaces_of([solid]), no_terrain(), VIEW_PX, looking_deg=side)
    square = np.full((VIEW_PX, VIEW_PX, 3), SKY, np.uint8)
    rows, cols = min(VIEW_PX, pixels.shape[0]), min(VIEW_PX, pixels.shape[1])
    top, left = (VIEW_PX - rows) // 2, (VIEW_PX - cols) // 2
    square[top : top + rows, left : left + cols] = pixels[:rows, :cols]
    return square

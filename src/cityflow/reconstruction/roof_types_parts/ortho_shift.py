"""How far a plain ortho shows a roof beside its walls, from the roof's rim in it, and lines brought back over the walls.

A plain ortho displaces everything by its height above the terrain, away from the camera. So the rim of the roof is found displaced
against the outline by one vector, and stands out beyond the walls by one overhang; ridges are displaced more, by their height. The
paper (Hron 2020, section 3) uses only what the displacement leaves as it is, and the central parts of pictures.
"""

from __future__ import annotations

import math

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.reconstruction.roof_types_parts.outline_sides import Sides
from cityflow.reconstruction.roof_types_parts.roof_lines import RoofLines, turn_between

OVERHANGS_M = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
"""That are tried beside the displacement; set by hand."""
ACROSS_M, STEP_M, FINE_M = 0.25, 0.2, 0.05
"""How far a line lies off its rim (sigma): a pixel of a usual ortho; steps of the search, and of its refinement; set by hand."""

PER_M = 0.25
"""Loss (share of the outline's length) per metre of displacement; set by hand."""
MOST_M = 2.0
"""Largest displacement sought, m: of an eave 6 m high that is seen 18° off the vertical; set by hand."""


def rim_shift(lines: RoofLines, sides: Sides) -> FloatArray:
    """(2,) displacement of the roof's rim against the outline, metres; 0 where nothing tells."""
    votes = _votes(lines, sides, MOST_M + max(OVERHANGS_M))
    if len(votes) < 2:
        return np.zeros(2)
    reach = np.arange(-MOST_M, MOST_M + 1e-9, STEP_M)
    best = _best(votes, np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2), sides)
    near = np.arange(-STEP_M, STEP_M + 1e-9, FINE_M)
    return _best(votes, best + np.stack(np.meshgrid(near, near), axis=-1).reshape(-1, 2), sides)


def _votes(lines: RoofLines, sides: Sides, reach: float) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Of every side that has any: its outward normal, and offsets and common lengths of lines along it."""
    found = []
    for line, ends, length, angle in zip(sides.lines(), sides.ends, sides.length, sides.angle, strict=True):
        if length < 2.0 or len(lines) == 0:
            continue
        along = (ends[1] - ends[0]) / length
        offset = -(lines.ends @ line[:2] - line[2]).mean(axis=1)
        t = np.sort((lines.ends - ends[0]) @ along, axis=1)
        common = np.minimum(t[:, 1], length + reach) - np.maximum(t[:, 0], -reach)
        near = (turn_between(lines.angle, angle) <= math.radians(9.0)) & (np.abs(offset) <= reach)
        near &= common >= 0.3 * np.minimum(lines.length, length)
        if near.any():
            found.append((-line[:2], offset[near], np.minimum(common[near], length)))
    return found


def _best(votes: list[tuple[FloatArray, FloatArray, FloatArray]], tried: FloatArray, sides: Sides) -> FloatArray:
    norm = np.hypot(*tried.T)
    allowed = norm <= MOST_M + 1e-9
    scores = []
    for overhang in OVERHANGS_M:
        score = -PER_M * norm * sides.length.sum() * 0.25 - 1e9 * ~allowed
        for normal, offset, length in votes:
            off = offset[None] - (tried @ normal)[:, None] - overhang
            score = score + (length * np.exp(-0.5 * (off / ACROSS_M) ** 2)).max(axis=1)
        scores.append(score)
    return np.asarray(tried[int(np.argmax(np.max(scores, axis=0)))])


def brought_back(lines: RoofLines, shift: FloatArray, height: FloatArray, rim_height: float) -> RoofLines:
    """Lines over the walls again.

    Parameters
    ----------
    shift : (2,) displacement of the rim, metres
    height : (N,) metres above the terrain of each line
    rim_height : metres above the terrain of the rim
    """
    share = np.clip(height / max(rim_height, 1.0), 1.0, 3.0)
    return lines.shifted(-share[:, None] * shift)

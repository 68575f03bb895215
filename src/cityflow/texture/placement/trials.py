"""Page widths and orders of patches that are tried."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.texture.placement.layout import Bounds
from cityflow.texture.placement.pixel_runs import TURNS, Patches

HOPED_FOR = 0.92
"""Share of a page that patches take at best; a page that is smaller than that allows is not tried; set by hand."""

EXPECTED = 0.86
"""Share of a page that patches usually take; set by hand."""

SPREAD = 0.25
"""Standard deviation, as a natural logarithm, by which weights are shaken; set by hand."""

SEED = 20170
"""Any number: the same one, so that the same patches are placed alike."""


class Trial(NamedTuple):
    """Patches in the order in which they are placed, and the page that they are placed on."""

    order: IntArray
    bounds: Bounds


class Edges(NamedTuple):
    """Shortest and longest edge of a page, pixels, powers of two."""

    shortest: int
    longest: int


def power_of_two(length: float) -> int:
    """The smallest that is not below `length`."""
    return 1 << max(int(np.ceil(length)) - 1, 0).bit_length()


def trials(patches: Patches, left: IntArray, edges: Edges, effort: float) -> list[Trial]:
    """Trials in the order of their promise, as many as `effort` allows (in products of patches and pixels), at least one and at most 24."""
    pixels = patches.pixels[left]
    count = int(np.clip(effort / (len(left) * pixels.sum()), 1, 24))
    widths = _widths(patches, left, edges)
    weights = _weights(patches, left)
    rng = np.random.default_rng(SEED)
    result = []
    for number in range(count):
        weight = weights[number % len(weights)]
        if number >= len(widths) * len(weights):
            weight = weight * np.exp(SPREAD * rng.standard_normal(len(weight)))
        width = widths[number // len(weights) % len(widths)]
        rows = min(power_of_two(1.3 * pixels.sum() / width + 1), edges.longest)
        result.append(Trial(left[np.argsort(-weight, kind="stable")], Bounds(width, rows, edges.longest)))
    return result


def _weights(patches: Patches, left: IntArray) -> list[FloatArray]:
    """What orders the patches: large and long ones first, so that small ones fill the holes between them."""
    shapes, pixels = patches.shapes[::TURNS][left], patches.pixels[left].astype(np.float64)
    longest, shortest = shapes.max(axis=1), shapes.min(axis=1)
    return [pixels * longest, pixels * longest * shortest]


def _widths(patches: Patches, left: IntArray, edges: Edges) -> list[int]:
    """Powers of two whose page may become the smallest; then widths of a square that has no room to spare."""
    shapes = patches.shapes[::TURNS][left]
    least = max(int(shapes.min(axis=1).max()), 1)
    longest, pixels = int(shapes.max()), float(patches.pixels[left].sum())
    area = power_of_two(pixels / HOPED_FOR)
    square = 1 << (area.bit_length() - 1) // 2
    widths = [square]
    if longest > 2 * square:
        widths.insert(0, power_of_two(pixels / EXPECTED / power_of_two(longest)))
    page = [int(np.clip(max(w, edges.shortest, power_of_two(least)), 1, edges.longest)) for w in widths]
    tight = [int(np.sqrt(pixels / EXPECTED) * share) for share in (1.0, 0.9)]
    return list(dict.fromkeys(page + [w for w in tight if least <= w <= page[0]]))

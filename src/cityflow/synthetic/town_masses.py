"""Masses: level blocks with voids cut into them, as boxes that stand beside and upon each other exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.synthetic.roofs import MAIN, PARAPET, LocalFace, rectangle
from cityflow.synthetic.town_shapes import SLAB_M, Volume

IN_GROUND_M = -1.0
"""Voids and boxes that begin at or below this height begin in the ground."""
PARAPET_M, PARAPET_WIDE_M = 0.95, 0.25


class Box(NamedTuple):
    """A box of the plan frame, metres; heights above the base."""

    u_0: float
    v_0: float
    low: float
    u_1: float
    v_1: float
    high: float


def box_volume(box: Box, kind: str = MAIN, windows: bool = True) -> Volume:
    """A level volume: in the ground where it begins there, else carried."""
    ring = rectangle(box.u_0, box.v_0, box.u_1, box.v_1)
    bottom = None if box.low <= IN_GROUND_M else box.low
    return Volume(ring, (LocalFace(ring, 0, 0, box.high, kind),), 0.0, bottom, kind, windows, bottom is not None)


def carved(mass: Box, voids: Sequence[Box]) -> list[Volume]:
    """A block without its voids, as few boxes as a greedy search finds; the first one stands in the ground, at the front."""
    cuts = [np.unique(np.round([b[axis] for b in (mass, *voids) for axis in (k, k + 3)], 6)) for k in range(3)]
    cuts = [c[(c >= mass[k]) & (c <= mass[k + 3])] for k, c in enumerate(cuts)]
    middle = np.meshgrid(*((c[:-1] + c[1:]) / 2 for c in cuts), indexing="ij")
    solid = np.ones(middle[0].shape, bool)
    for void in voids:
        solid &= ~np.logical_and.reduce([(middle[k] > void[k]) & (middle[k] < void[k + 3]) for k in range(3)])
    return [box_volume(b) for b in _boxes(solid, cuts)]


def _boxes(solid: BoolArray, cuts: Sequence[FloatArray]) -> list[Box]:
    """Boxes that fill the solid cells without overlap: from below, each as long, as deep, then as high as it can be."""
    left, boxes = solid.copy(), []
    for k, j, i in np.argwhere(solid.transpose(2, 1, 0)).tolist():
        if not left[i, j, k]:
            continue
        i_1, j_1, k_1 = i + 1, j + 1, k + 1
        while i_1 < solid.shape[0] and left[i_1, j, k]:
            i_1 += 1
        while j_1 < solid.shape[1] and left[i:i_1, j_1, k].all():
            j_1 += 1
        while k_1 < solid.shape[2] and left[i:i_1, j:j_1, k_1].all():
            k_1 += 1
        left[i:i_1, j:j_1, k:k_1] = False
        u, v, z = cuts
        boxes.append(
            Box(float(u[i]), float(v[j]), float(z[k]), float(u[i_1]), float(v[j_1]), float(z[k_1]))
        )  # fmt: skip
    return boxes


def with_eaves(volumes: Sequence[Volume], mass: Box, reach: float) -> list[Volume]:
    """The boxes of a block; where one of them alone is the highest, its roof stands out on each side beyond which the block goes on below."""
    highest = [v for v in volumes if v.faces[0].height == mass.high]
    if len(highest) != 1:
        return list(volumes)
    (u_0, v_0), (u_1, v_1) = highest[0].ring[0], highest[0].ring[2]
    ring = rectangle(
        u_0 - reach * (u_0 > mass.u_0), v_0 - reach * (v_0 > mass.v_0), u_1 + reach * (u_1 < mass.u_1), v_1 + reach * (v_1 < mass.v_1)
    )  # fmt: skip
    out = replace(highest[0], faces=(LocalFace(ring, 0, 0, mass.high),), slab_m=SLAB_M)
    return [out if v is highest[0] else v for v in volumes]


def parapet(box: Box, sides: str) -> list[Volume]:
    """A parapet on top of a box along some of its sides: f(ront), b(ack), l(eft), r(ight)."""
    u_0, v_0, _, u_1, v_1, z = box
    w, top = PARAPET_WIDE_M, z + PARAPET_M
    low, high = v_0 + w * ("f" in sides), v_1 - w * ("b" in sides)
    strips = {
        "f": Box(u_0, v_0, z, u_1, v_0 + w, top),
        "b": Box(u_0, v_1 - w, z, u_1, v_1, top),
        "l": Box(u_0, low, z, u_0 + w, high, top),
        "r": Box(u_1 - w, low, z, u_1, high, top),
    }
    return [box_volume(strips[s], PARAPET, windows=False) for s in sides]

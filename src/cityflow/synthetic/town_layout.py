"""The plan of the town: a turned net of streets, and what kind of block lies between them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.grid import Bounds
from cityflow.synthetic import town_special as special
from cityflow.synthetic.town_drafts import BlockDraft
from cityflow.synthetic.town_houses import houses_block
from cityflow.synthetic.town_levels import LEVELS
from cityflow.synthetic.town_mixed import mixed_block
from cityflow.synthetic.town_terraces import RowGaps, perimeter_block, terraces_block

PAVEMENT_M = 2.2
ROWS = {"terraces": terraces_block, "perimeter": perimeter_block}
MAKERS: dict[str, Callable[[np.random.Generator, tuple[float, float]], BlockDraft]] = {
    "houses": houses_block,
    "church": special.church_block,
    "hall": special.hall_block,
    "stepped": special.stepped_block,
    "round": special.round_block,
    "curved": special.curved_block,
    "slab": special.slab_block,
    "park": special.park_block,
}
SPECIAL = ("church", "curved", "stepped", "round", "hall", "slab")
COMMON = ("terraces", "perimeter", "houses", "terraces", "houses")


@dataclass(frozen=True, slots=True)
class Axis:
    """Where blocks begin and end along one axis of the net; between them lie streets. (n,) metres each."""

    start: FloatArray
    end: FloatArray


@dataclass(frozen=True, slots=True)
class StreetNet:
    """A net of streets in a frame turned by `heading` (radians) about `centre` (world x, y)."""

    centre: tuple[float, float]
    heading: float
    u: Axis
    v: Axis

    def to_world(self, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        c, s = np.cos(self.heading), np.sin(self.heading)
        return self.centre[0] + c * u - s * v, self.centre[1] + s * u + c * v

    def from_world(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        c, s = np.cos(self.heading), np.sin(self.heading)
        d_x, d_y = x - self.centre[0], y - self.centre[1]
        return c * d_x + s * d_y, c * d_y - s * d_x


def make_net(rng: np.random.Generator, bounds: Bounds) -> StreetNet:
    """Streets over all of `bounds` and beyond."""
    centre = (bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2
    reach = float(np.hypot(bounds[2] - bounds[0], bounds[3] - bounds[1])) / 2 + 30.0
    return StreetNet(
        centre,
        float(rng.uniform(-0.7, 0.7)),
        _axis(rng, reach, (54.0, 74.0)),
        _axis(rng, reach, (42.0, 56.0)),
    )


def _axis(rng: np.random.Generator, reach: float, block_m: tuple[float, float]) -> Axis:
    """Blocks and streets in turn from -reach to beyond reach, whole centimetres."""
    count = int(2 * reach / (block_m[0] + 10.0)) + 2
    block = np.round(rng.uniform(*block_m, count), 2)
    street = np.round(rng.choice([9.4, 10.9, 13.4], count), 2)
    end = np.round(np.cumsum(block + street) - street - reach, 2)
    return Axis(np.round(end - block, 2), end)


@dataclass(frozen=True, slots=True)
class PlacedBlock:
    """A block of the net and what it holds; its frame is the net's, shifted to (u, v)."""

    col: int
    row: int
    u: float
    v: float
    draft: BlockDraft


def fill_blocks(
    seed: int,
    net: StreetNet,
    bounds: Bounds,
    park_share: float,
    gaps: RowGaps | None = None,
    level: int = 0,
    eaves: float = 0.0,
) -> list[PlacedBlock]:
    """What stands in each block that meets the bounds, row after row; with a `level`, most whole blocks have buildings with discontinuities."""
    cells = [(i, j) for j in range(len(net.v.start)) for i in range(len(net.u.start))]
    corners = np.array([_corners(net, i, j) for i, j in cells])
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    meets = np.all(corners.max(axis=1) > low, axis=1) & np.all(corners.min(axis=1) < high, axis=1)
    whole = np.all(corners.min(axis=1) > low + 2, axis=1) & np.all(corners.max(axis=1) < high - 2, axis=1)
    kinds = _kinds(np.random.default_rng([seed, 11]), whole, meets, park_share)
    if level:
        broken = whole & (np.random.default_rng([seed, 13]).random(len(whole)) >= LEVELS[level].common_share)
        kinds = ["mixed" if b else kind for b, kind in zip(broken, kinds, strict=True)]
    blocks = []
    for k, (i, j) in enumerate(cells):
        if kinds[k] is not None:
            size = float(net.u.end[i] - net.u.start[i]), float(net.v.end[j] - net.v.start[j])
            rng, extent = np.random.default_rng([seed, 12, i, j]), (round(size[0], 2), round(size[1], 2))
            mixed = kinds[k] == "mixed"
            draft = (
                mixed_block(rng, extent, replace(LEVELS[level], eaves=eaves))
                if mixed
                else _drafted(str(kinds[k]), rng, extent, gaps)
            )
            blocks.append(PlacedBlock(i, j, float(net.u.start[i]), float(net.v.start[j]), draft))
    return blocks


def _drafted(kind: str, rng: np.random.Generator, size: tuple[float, float], gaps: RowGaps | None) -> BlockDraft:
    return ROWS[kind](rng, size, gaps) if kind in ROWS else MAKERS[kind](rng, size)


def _corners(net: StreetNet, i: int, j: int) -> FloatArray:
    u = np.array([net.u.start[i], net.u.end[i], net.u.end[i], net.u.start[i]])
    v = np.array([net.v.start[j], net.v.start[j], net.v.end[j], net.v.end[j]])
    return np.column_stack(net.to_world(u, v))


def _kinds(rng: np.random.Generator, whole: BoolArray, meets: BoolArray, park_share: float) -> list[str | None]:
    """Blocks that lie in the bounds as a whole get special and common kinds in turn, the others houses or terraces."""
    kinds: list[str | None] = [None] * len(whole)
    inner = rng.permutation(np.flatnonzero(whole))
    deck: list[str] = []
    while len(deck) < len(inner):
        deck += _hand(rng)
    for k, kind in zip(inner, deck, strict=False):
        kinds[k] = "park" if rng.random() < park_share else kind
    for k in np.flatnonzero(meets & ~whole):
        kinds[k] = "park" if rng.random() < park_share else str(rng.choice(["houses", "terraces", "terraces"]))
    return kinds


def _hand(rng: np.random.Generator) -> list[str]:
    """Eleven kinds: six special and five common ones, mixed so that common ones come early in small towns."""
    special_kinds, common = list(rng.permutation(SPECIAL)), list(COMMON)
    hand = []
    while special_kinds or common:
        hand += [str(k) for k in (common[:1] + special_kinds[:1])]
        common, special_kinds = common[1:], special_kinds[1:]
    return hand

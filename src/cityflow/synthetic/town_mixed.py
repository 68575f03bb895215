"""Blocks of buildings with discontinuities: four places, or two and a large building, trees and paved yards."""

from __future__ import annotations

import numpy as np

from cityflow.synthetic.town_drafts import BlockDraft, TreeDraft, UnitDraft
from cityflow.synthetic.town_levels import Level
from cityflow.synthetic.town_storeys import HOUSES, court, podium

RIM_M = 3.0
"""Buildings keep this far from the edge of the block; what stands out before them may reach into it."""
BEFORE_WALL_M = (0.9, 2.0)


def mixed_block(rng: np.random.Generator, size: tuple[float, float], level: Level) -> BlockDraft:
    """Two halves, each with a house at either street or with one large building."""
    block = BlockDraft("mixed", size)
    deck = [HOUSES[int(k)] for k in rng.permutation(len(HOUSES))]
    large = int(rng.integers(4))
    half = size[0] / 2
    for side in range(2):
        u_0 = side * half
        if large == side:
            maker = podium if rng.random() < 0.5 else court
            unit = maker(rng, level, (half - 2 * RIM_M, size[1] - 2 * RIM_M))
            _place(rng, block, unit, (u_0 + half / 2, size[1] / 2), level)
            continue
        for back in (False, True):
            unit = deck.pop()(rng, level)
            if back:
                unit = unit.moved(np.pi, 0.0, 0.0)
            depth = _extent(unit)[3] - _extent(unit)[1]
            v = RIM_M + depth / 2
            _place(rng, block, unit, (u_0 + half / 2, size[1] - v if back else v), level)
    block.paved.append((1.0, 1.0, size[0] - 1.0, 0.4 * size[1]))
    for _ in range(3):
        radius = float(rng.uniform(1.8, 3.2))
        at = float(rng.uniform(2, size[0] - 2)), size[1] / 2 + float(rng.uniform(-1.5, 1.5))
        block.trees.append(TreeDraft(*at, radius, radius * float(rng.uniform(2.2, 3.0))))
    return block


def _extent(unit: UnitDraft) -> tuple[float, float, float, float]:
    """Least u, v and greatest u, v of what makes its outline."""
    corners = np.array([c for v in unit.volumes if v.of_outline for c in v.ring])
    (u_0, v_0), (u_1, v_1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return u_0, v_0, u_1, v_1


def _place(rng: np.random.Generator, block: BlockDraft, unit: UnitDraft, at: tuple[float, float], level: Level) -> None:
    """With its middle at a place, turned a little about it, trees against its walls."""
    u_0, v_0, u_1, v_1 = _extent(unit)
    turn = float(rng.uniform(-level.turn_rad, level.turn_rad)) if level.turn_rad else 0.0
    centred = unit.moved(0.0, -(u_0 + u_1) / 2, -(v_0 + v_1) / 2)
    block.units.append(centred.moved(turn, *at))
    wide, deep = u_1 - u_0, v_1 - v_0
    for _ in range(int(rng.poisson(level.wall_trees)) if level.wall_trees else 0):
        radius, off = float(rng.uniform(1.4, 2.6)), float(rng.uniform(*BEFORE_WALL_M))
        along, side = float(rng.uniform(-0.5, 0.5)), float(rng.choice([-1.0, 1.0]))
        place = (
            (along * wide, side * (deep / 2 + off)) if rng.random() < 0.6 else (side * (wide / 2 + off), along * deep)
        )
        c, s = np.cos(turn), np.sin(turn)
        u, v = at[0] + c * place[0] - s * place[1], at[1] + s * place[0] + c * place[1]
        block.trees.append(TreeDraft(float(u), float(v), radius, radius * float(rng.uniform(2.4, 3.4))))

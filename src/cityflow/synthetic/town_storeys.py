"""Buildings whose storeys differ: set-backs, arcades, passages, towers on slabs, stilts, courts, terraced floors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cityflow.synthetic.town_building import GROUND, between, new_building
from cityflow.synthetic.town_details import (
    POST_M,
    add_back_details,
    add_bays,
    add_canopy,
    add_lift_house,
    posts,
    roof_of,
)
from cityflow.synthetic.town_drafts import BreakDraft, UnitDraft
from cityflow.synthetic.town_levels import Level
from cityflow.synthetic.town_masses import Box, parapet

CUT_FALL_M = 3.5
"""Most fall of the terrain under houses that are cut into a slope."""


def set_back_house(rng: np.random.Generator, level: Level) -> UnitDraft:
    """One or two upper floors that stand back from the front and perhaps from other sides, a terrace before them."""
    b = new_building(rng, level, (between(rng, (15, 22)), between(rng, (12, 15))), (3, 5))
    (length, depth), low = b.size, b.storeys - int(rng.integers(1, 3))
    front, end = between(rng, level.set_back_m), between(rng, level.set_back_m)
    b.cut("set-back", Box(0.0, 0.0, b.floor(low), length, front, b.top), storey=low)
    sides = "f"
    if rng.random() < 0.5:
        b.cut("set-back", Box(0.0, depth - end, b.floor(low), length, depth, b.top), front=False, storey=low)
        sides = "fb"
    terrace = Box(0.0, 0.0, 0.0, length, front, b.floor(low))
    if b.wants():
        b.more += parapet(terrace, "flr")
        if "b" in sides:
            b.more += parapet(terrace._replace(v_0=depth - end, v_1=depth), "blr")
    add_bays(b, low)
    add_lift_house(b, front + 2.0)
    return b.draft("set-back")


def arcade_house(rng: np.random.Generator, level: Level) -> UnitDraft:
    """An arcade along the front between posts, under a level or gabled roof; balconies or loggias at the back."""
    b = new_building(
        rng, level, (between(rng, (16, 23)), between(rng, (12, 14.5))), (3, 4), flat=bool(rng.random() < 0.5)
    )
    length, deep = b.size[0], between(rng, level.arcade_m)
    b.cut("arcade", Box(0.0, 0.0, GROUND, length, deep, b.floor(1)))
    b.more += posts(b, 0.0)
    add_back_details(b)
    return b.draft("arcade", roof_of(b))


def passage_house(rng: np.random.Generator, level: Level) -> UnitDraft:
    """A passage of 3.2 to 5 m through the whole depth, bay windows at the front."""
    b = new_building(
        rng, level, (between(rng, (17, 23)), between(rng, (11, 13.5))), (3, 4), flat=bool(rng.random() < 0.5)
    )
    (length, depth), wide = b.size, between(rng, (3.2, 5.0))
    u = round(float(rng.uniform(0.25, 0.55)) * (length - wide), 2)
    b.cut("passage", Box(u, 0.0, GROUND, u + wide, depth, b.floor(1)))
    add_bays(b, b.storeys)
    return b.draft("passage", roof_of(b))


def stilted_house(rng: np.random.Generator, level: Level) -> UnitDraft:
    """A block on posts: open below but for a core with the stairs; balconies or loggias above."""
    b = new_building(rng, level, (between(rng, (15, 21)), between(rng, (10, 12.5))), (3, 5))
    length, depth = b.size
    core = round(length * float(rng.uniform(0.3, 0.5)), 2), round(length * float(rng.uniform(0.65, 0.8)), 2)
    b.cut("stilts", Box(0.0, 0.0, GROUND, core[0], depth, b.floor(1)))
    b.cut("stilts", Box(core[1], 0.0, GROUND, length, depth, b.floor(1)))
    for v in (0.0, depth - POST_M):
        b.more += [p for p in posts(b, v) if not core[0] - POST_M < p.ring[0][0] < core[1]]
    add_back_details(b)
    add_lift_house(b, 3.0)
    return b.draft("stilts")


def stepped_house(rng: np.random.Generator, level: Level) -> UnitDraft:
    """Terraced floors, each standing back from the one below: the kind that is cut into slopes."""
    b = new_building(rng, level, (between(rng, (12, 18)), between(rng, (12, 15))), (3, 4))
    length, back = b.size[0], 0.0
    for storey in range(1, b.storeys):
        step = between(rng, level.set_back_m)
        b.cut("set-back", Box(0.0, back, b.floor(storey), length, back + step, b.top), storey=storey)
        if b.wants():
            b.more += parapet(Box(0.0, back, 0.0, length, back + step, b.floor(storey)), "f")
        back = round(back + step, 2)
    return b.draft("stepped terraces", fall_m=CUT_FALL_M)


def podium(rng: np.random.Generator, level: Level, room: tuple[float, float]) -> UnitDraft:
    """A tower on a slab of one or two storeys, a canopy before the entrance."""
    b = new_building(rng, level, (round(min(room[0], 24.0), 2), round(min(room[1], 30.0), 2)), (6, 9))
    (length, depth), low = b.size, int(rng.integers(1, 3))
    wide, deep = round(0.55 * length, 2), round(0.45 * depth, 2)
    u, v = round(float(rng.uniform(2, length - wide - 2)), 2), round(float(rng.uniform(3, depth - deep - 3)), 2)
    slab, z = b.floor(low), b.top
    for void in (
        Box(0, 0, slab, length, v, z),
        Box(0, v + deep, slab, length, depth, z),
        Box(0, v, slab, u, v + deep, z),
    ):
        b.voids.append(void)
    b.voids.append(Box(u + wide, v, slab, length, v + deep, z))
    b.breaks.append(BreakDraft("tower", (u, 0.0), (u + wide, 0.0), v, slab, z, None, low))
    if b.wants():
        b.more += parapet(Box(0.0, 0.0, 0.0, length, depth, slab), "fblr")
    if b.wants():
        add_canopy(b, 2.8)
    return b.draft("tower on slab")


def court(rng: np.random.Generator, level: Level, room: tuple[float, float]) -> UnitDraft:
    """A closed block around a court, with a passage into it; the top floor perhaps stands back from the street."""
    b = new_building(rng, level, (round(min(room[0], 27.0), 2), round(min(room[1], 34.0), 2)), (3, 4))
    (length, depth), wing = b.size, 8.5
    b.cut("court", Box(wing, wing, GROUND, length - wing, depth - wing, b.top))
    u = round(length / 2 - 1.9, 2)
    b.cut("passage", Box(u, 0.0, GROUND, u + 3.8, wing, b.floor(1)))
    if rng.random() < 0.6:
        back = between(rng, level.set_back_m)
        b.cut("set-back", Box(0.0, 0.0, b.floor(b.storeys - 1), length, back, b.top), storey=b.storeys - 1)
    return b.draft("court")


HOUSES: tuple[Callable[[np.random.Generator, Level], UnitDraft], ...] = (
    set_back_house,
    arcade_house,
    passage_house,
    stilted_house,
    stepped_house,
)

"""A building in the making: a block, its voids, what stands out of it or upon it, and the discontinuities that this makes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from cityflow.synthetic import roofs
from cityflow.synthetic.town_drafts import BreakDraft, Style, UnitDraft, draw_style
from cityflow.synthetic.town_levels import Level
from cityflow.synthetic.town_masses import IN_GROUND_M, Box, box_volume, carved, with_eaves
from cityflow.synthetic.town_shapes import Volume

STOREY_M = (3.1, 3.6)
"""From floor to floor; the clear height of arcades, passages and stilts."""
OPEN_FALL_M = 1.2
"""Most fall of the terrain under buildings that are open below."""
EAVE_M = (0.3, 0.8)
"""How far the roof of the highest floors stands out over terraces."""
GROUND = IN_GROUND_M - 1.0
"""Where voids and posts begin that reach into the ground, above the base."""


@dataclass(slots=True)
class Building:
    """A building in the making: a mass from (0, 0) to `size` and `top`, its voids, what else belongs to it, and its discontinuities."""

    rng: np.random.Generator
    level: Level
    size: tuple[float, float]
    storeys: int
    style: Style
    voids: list[Box] = field(default_factory=list)
    more: list[Volume] = field(default_factory=list)
    breaks: list[BreakDraft] = field(default_factory=list)

    def floor(self, storey: int) -> float:
        """Height of a storey's floor above the base."""
        return round(storey * self.style.storey_m, 3)

    @property
    def top(self) -> float:
        return self.floor(self.storeys)

    @property
    def mass(self) -> Box:
        return Box(0.0, 0.0, GROUND, *self.size, self.top)

    def wants(self) -> bool:
        """Whether a detail is there."""
        return bool(self.rng.random() < self.level.details)

    def cut(self, kind: str, void: Box, front: bool = True, storey: int = 0) -> None:
        """A void that is open to the front or to the back; open to the sky where it reaches the top."""
        self.voids.append(void)
        a, b = ((void.u_0, void.v_0), (void.u_1, void.v_0)) if front else ((void.u_1, void.v_1), (void.u_0, void.v_1))
        low = max(void.low, 0.0)
        soffit = None if void.high >= self.top else void.high
        self.breaks.append(BreakDraft(kind, a, b, void.v_1 - void.v_0, low, void.high, soffit, storey))

    def add(self, kind: str, box: Box, storey: int) -> None:
        """A body that stands out before the front or the back."""
        self.more.append(box_volume(box, kind, windows=kind == roofs.BAY))
        front = box.v_0 < 0
        a, b = ((box.u_0, box.v_0), (box.u_1, box.v_0)) if front else ((box.u_1, box.v_1), (box.u_0, box.v_1))
        self.breaks.append(BreakDraft(kind, a, b, box.v_0 - box.v_1, box.low, box.high, box.low, storey))

    def draft(self, shape: str, roof: tuple[Volume, ...] = (), fall_m: float = OPEN_FALL_M) -> UnitDraft:
        masses = carved(self.mass, self.voids)
        if self.level.eaves:
            # a stream of its own: buildings are otherwise as without eaves
            rng = self.rng.spawn(1)[0]
            if rng.random() < self.level.eaves:
                masses = with_eaves(masses, self.mass, between(rng, EAVE_M))
        volumes = (*masses, *roof, *self.more)
        return UnitDraft(shape, volumes, self.style, breaks=tuple(self.breaks), most_fall_m=fall_m)


def new_building(
    rng: np.random.Generator, level: Level, size: tuple[float, float], storeys: tuple[int, int], flat: bool = True
) -> Building:
    style = replace(draw_style(rng, flat=flat), storey_m=between(rng, STOREY_M))
    return Building(rng, level, size, int(rng.integers(storeys[0], storeys[1] + 1)), style)


def between(rng: np.random.Generator, span: tuple[float, float]) -> float:
    return round(float(rng.uniform(*span)), 2)

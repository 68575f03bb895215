"""Levels of difficulty: what the buildings with discontinuities of a town are like."""

from __future__ import annotations

from dataclasses import dataclass

MOST_LEVEL = 3


@dataclass(frozen=True, slots=True)
class Level:
    """What a level asks for.

    Attributes
    ----------
    set_back_m, arcade_m : least and greatest depth
    details : chance of each bay window, balcony, loggia, canopy, parapet and panel
    turn_rad : units stand off the direction of the street by at most this
    wall_trees : trees for each unit that stand against its walls
    common_share : share of whole blocks that are as in a town without discontinuities
    eaves : chance that the roof of the highest floors stands out over the terraces before them
    """

    set_back_m: tuple[float, float]
    arcade_m: tuple[float, float]
    details: float
    turn_rad: float
    wall_trees: float
    common_share: float
    eaves: float = 0.0


LEVELS: dict[int, Level] = {
    1: Level((2.0, 3.0), (2.8, 3.4), 0.0, 0.0, 0.0, 0.25),
    2: Level((1.2, 3.0), (2.4, 3.4), 0.7, 0.06, 0.5, 0.25),
    3: Level((1.0, 2.2), (1.5, 3.0), 1.0, 0.15, 1.5, 0.25),
}
"""1: a few large discontinuities, parallel to the streets; 2: with all details; 3: shallow ones, turned, trees against the walls."""

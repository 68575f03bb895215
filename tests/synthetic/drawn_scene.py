"""A corner of a synthetic town with its drawn frames, made once for several tests."""

from __future__ import annotations

from functools import cache

from cityflow.core.grid import Bounds
from cityflow.synthetic.ambient import AmbientParameters
from cityflow.synthetic.render import RenderParameters
from cityflow.synthetic.town import Town, TownParameters, make_town
from scenes.drawn_frames import DrawnFrame, DrawnParameters, drawn_with_truth
from scenes.drawn_heights import HeightNoise

CELL_M = 0.1
BOUNDS: Bounds = (85020.0, 447060.0, 85044.0, 447084.0)
FAST = RenderParameters(ambient=AmbientParameters(rays=0), supersampling=1)
EXACT = HeightNoise(
    level_gsd=0, facade_gsd=0, rounded_cells=0, widened_cells=0, frayed=0, leaf_m=0, leaf_missing=0, leaf_sunk=0, gap_m=0, slit_m=0,
    dark_missing=0,
)  # fmt: skip
USUAL = DrawnParameters(render=FAST)


@cache
def town() -> Town:
    return make_town(7, TownParameters(width_m=120, height_m=120))


@cache
def drawn(seed: int = 3, exact: bool = False) -> tuple[DrawnFrame, ...]:
    parameters = DrawnParameters(render=FAST, nadir=EXACT, tilted=EXACT) if exact else USUAL
    return drawn_with_truth(town(), BOUNDS, CELL_M, seed, parameters)

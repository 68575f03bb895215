"""Evidence for the buildings that a small town seldom has (halls, churches, crescents, towers), each drawn with its surroundings alone.

python benchmarks/rare_models.py [--seeds 1 2] [--size 400]     # then: reconstruct_town.py --seeds 1 2 --size 400
"""

from __future__ import annotations

import argparse
import json
import pickle
from pathlib import Path

import numpy as np

from cityflow.core.grid import Bounds
from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_units import Unit
from drawn_town import GSD_M, DrawnTown
from scenes.drawn_frames import drawn_with_truth
from scenes.drawn_points import drawn_wall_points
from scenes.drawn_surface import drawn_surface
from town_models import CACHE, KINDS, Neighbourhood, true_model

RARE = (
    "church", "hall", "hall saw-tooth", "curved gable", "curved flat", "round cone", "round flat", "stepped", "tower", "slab",
    "corner flat", "garage",
)  # fmt: skip
OF_EACH = 2
AROUND_M, LATTICE_M = 6.0, 0.4


def chosen(town: Town) -> list[Unit]:
    """The first few of each rare shape."""
    return [u for shape in RARE for u in [u for u in town.units if u.shape == shape][:OF_EACH]]


def drawn_around(town: Town, unit: Unit) -> Neighbourhood:
    """A unit and what stands close to it, drawn; the town itself is whole."""
    x_0, y_0, x_1, y_1 = unit.bounds
    low = np.floor(np.array([x_0 - AROUND_M, y_0 - AROUND_M]) / LATTICE_M) * LATTICE_M
    high = np.ceil(np.array([x_1 + AROUND_M, y_1 + AROUND_M]) / LATTICE_M) * LATTICE_M
    bounds: Bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    drawn = drawn_with_truth(town, bounds, GSD_M, town.seed)
    frames = tuple(d.rasters for d in drawn)
    made = DrawnTown(
        town.seed, round(town.parameters.width_m), frames, drawn_surface(town, drawn[0], seed=town.seed), {}
    )
    around = Neighbourhood(made)
    made.__dict__["town"] = town
    around.__dict__["walls"] = find_wall_points(drawn_wall_points(frames, town.seed), WallPointParameters())
    return around


def make(seed: int, size: int, cache: Path) -> None:
    town = make_town(seed, TownParameters(width_m=size, height_m=size))
    units = chosen(town)
    folders = {kind: cache / f"s{seed}_{size}_{kind}" for kind in KINDS}
    for folder in folders.values():
        folder.mkdir(parents=True, exist_ok=True)
    for unit in units:
        around = drawn_around(town, unit)
        for kind, folder in folders.items():
            kept = around.evidence(unit, kind), true_model(unit)
            (folder / f"{unit.id}.pkl").write_bytes(pickle.dumps(kept, protocol=5))
        print(seed, unit.id, unit.shape, flush=True)
    for folder in folders.values():
        (folder / "index.json").write_text(json.dumps([(u.id, u.shape) for u in units]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=(1, 2))
    parser.add_argument("--size", type=int, default=400)
    parser.add_argument("--cache", type=Path, default=CACHE)
    asked = parser.parse_args()
    for seed in asked.seeds:
        make(seed, asked.size, asked.cache)


if __name__ == "__main__":
    main()

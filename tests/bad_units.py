"""Units with evidence as bad as surveys deliver it: each a valid solid all the same."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from shapely import Polygon, box
from shapely.affinity import translate

from cityflow.core.arrays import FloatArray
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence

ORIGIN = np.array([84_900.0, 447_500.0, 2.0])
HOUSE = box(0, 0, 12, 8)


def gable(x: FloatArray, y: FloatArray) -> FloatArray:
    """Ridge along x at y = 4, 8 m high; slopes of 35 degrees."""
    return np.asarray(8.0 - 0.7 * np.abs(y - 4.0))


def saw_teeth(x: FloatArray, y: FloatArray) -> FloatArray:
    """75 gables of 2 m in two rows of unequal height: 150 planes."""
    row = np.where(y < 6.0, 0.0, 1.5)
    return np.asarray(6.0 + row - np.abs(x % 4.0 - 2.0))


def scanned(
    height: Callable[[FloatArray, FloatArray], FloatArray], outline: Polygon, density: float, noise: float, seed: int
) -> FloatArray:
    """(N, 3) points of a roof all over the box of a local outline."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = outline.bounds
    count = int(density * (x1 - x0) * (y1 - y0))
    x, y = rng.uniform(x0, x1, count), rng.uniform(y0, y1, count)
    return np.column_stack([x, y, height(x, y) + rng.normal(0, noise, count)])


def unit(xyz: FloatArray, outline: Polygon = HOUSE) -> Evidence:
    """Evidence of local points over a local outline whose floor is at 0."""
    placed = translate(outline, *ORIGIN[:2])
    return Evidence("bad", placed, PointCloud.of(xyz + ORIGIN, BUILDING), float(ORIGIN[2]))


def _under_a_tree(xyz: FloatArray) -> FloatArray:
    """Leaves as roof points over a third of the roof, which they half hide."""
    rng = np.random.default_rng(1)
    under = np.hypot(xyz[:, 0] - 2, xyz[:, 1] - 2) < 3.5
    leaf = under & (rng.random(len(xyz)) < 0.6)
    leaves = np.where(leaf, rng.uniform(6.0, 12.0, len(xyz)), xyz[:, 2])
    return np.column_stack([xyz[:, :2], leaves])


def _with_chimneys(xyz: FloatArray) -> FloatArray:
    """Two chimneys, an antenna, birds."""
    rng = np.random.default_rng(2)
    raised = xyz.copy()
    for x, y in ((3.0, 3.0), (9.0, 5.0)):
        on = (np.abs(xyz[:, 0] - x) < 0.4) & (np.abs(xyz[:, 1] - y) < 0.4)
        raised[on, 2] = 9.0 + rng.normal(0, 0.03, np.count_nonzero(on))
    mast = np.column_stack([np.full((20, 2), (6.0, 4.1)) + rng.normal(0, 0.02, (20, 2)), np.linspace(8, 13, 20)])
    birds = rng.uniform((0, 0, 8), (12, 8, 40), (10, 3))
    return np.concatenate([raised, mast, birds])


def bad_units() -> dict[str, Evidence]:
    """Name and evidence of each."""
    house = scanned(gable, HOUSE, 10.0, 0.04, 0)
    rng = np.random.default_rng(3)
    return {
        "ten points": unit(house[:10]),
        "one point": unit(house[:1]),
        "on one line": unit(
            np.column_stack([np.linspace(0.5, 11.5, 300), np.full(300, 3.0), rng.normal(7, 0.03, 300)])
        ),
        "at one place": unit(np.tile([[6.0, 4.0, 7.0]], (500, 1))),
        "two roofs in one outline": unit(
            scanned(lambda x, y: np.where(x < 7, 3.0, 9.0 - 0.6 * np.abs(y - 4)), HOUSE, 10.0, 0.04, 4)
        ),
        "tree over the roof": unit(_under_a_tree(house)),
        "half a roof missing": unit(house[house[:, 1] < 4.0]),
        "outline shifted by a metre": unit(_grounded(scanned(gable, translate(HOUSE, 1.0, 1.0), 10.0, 0.04, 5))),
        "chimneys and antenna": unit(_with_chimneys(house)),
        "tower of 200 m": unit(
            scanned(lambda x, y: np.full(len(x), 200.0), box(0, 0, 20, 20), 5.0, 0.05, 6), box(0, 0, 20, 20)
        ),
        "not numbers": unit(np.where(rng.random(house.shape) < 0.1, np.nan, house)),
        "below the floor": unit(house - (0.0, 0.0, 20.0)),
        "sliver": unit(scanned(gable, box(0, 0, 30, 0.4), 20.0, 0.04, 7), box(0, 0, 30, 0.4)),
        "rough and alike": unit(house + _alike(house)),
    }


def large_units() -> dict[str, Evidence]:
    """Those that ask for much work."""
    hall = box(0, 0, 150, 12)
    return {
        "150 planes": unit(scanned(saw_teeth, hall, 12.0, 0.03, 8), hall),
        "200,000 points": unit(scanned(gable, HOUSE, 2e5 / HOUSE.area, 0.08, 9)),
    }


def _grounded(xyz: FloatArray) -> FloatArray:
    """Points inside the house that was taken for theirs."""
    return xyz[(xyz[:, 0] < 12) & (xyz[:, 1] < 8)]


def _alike(xyz: FloatArray) -> FloatArray:
    """Errors of 15 cm in height that squares of half a metre share."""
    rng = np.random.default_rng(10)
    cell = np.floor(xyz[:, :2] / 0.5).astype(int)
    return np.column_stack([np.zeros((len(xyz), 2)), rng.normal(0, 0.15, (40, 40))[cell[:, 0], cell[:, 1]]])

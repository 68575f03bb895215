"""Groups of buildings whose wings meet at right angles or end to end, and single buildings that look like them: which lines between parts are borders is known.

A part has walls of its own height and a roof with a ridge of its own. It is a building of its own where it is as large as one and its eaves lie at another
height than those of the part that it stands against (farms). Wings of a house, manor or church are no buildings: they are narrower, share eaves, or are a
choir, an apse or a tower.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import shapely
from shapely import LineString, Polygon, affinity, box

from cityflow.core.arrays import FloatArray
from cityflow.core.splitting import SplitEvidence
from scenes.drawn_bodies import Body, Group, points_of
from split_unbroken import HUES, LOOKS, ORIGIN, WALLS, Survey, frame_of, turned

CELLS_M = (0.08, 0.14)
WAVES_M, WAVES_OVER_M = (0.01, 0.08), (1.0, 8.0)
FACADES_KNOWN = (0.05, 0.3, 0.9)
NADIR_ALONE = 0.5
"""Share of the surveys without oblique frames."""
LEAST_STEP_M = 0.4


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _other_eaves(rng: np.random.Generator, eaves: float) -> float:
    step = _between(rng, LEAST_STEP_M, 2.6)
    return eaves - step if eaves - step > 2.4 and rng.random() < 0.5 else eaves + step


def _colours(rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    return HUES[rng.integers(len(HUES))], WALLS[rng.integers(len(WALLS))]


def farm(rng: np.random.Generator) -> Group:
    """A barn and one to three others that stand with an end against its long sides."""
    length, depth = _between(rng, 22, 45), _between(rng, 9, 16)
    roof, wall = _colours(rng)
    slope = _between(rng, 0.25, 0.8)
    bodies = [
        Body((0.0, 0.0, length, depth), True, _between(rng, 3.0, 6.0), slope, roof, wall, bool(rng.random() < 0.3))
    ]
    borders = []
    taken: list[tuple[bool, float, float]] = []
    for _ in range(int(rng.integers(1, 4))):
        width, reach, above = _between(rng, 7.5, 15), _between(rng, 12, 40), bool(rng.random() < 0.6)
        at = float(rng.choice([0.0, length - width, _between(rng, 0.0, length - width)]))
        if any(t == above and at < b + 3 and at + width > a - 3 for t, a, b in taken):
            continue
        taken.append((above, at, at + width))
        own = _colours(rng) if rng.random() < 0.5 else (roof, wall)
        into = depth / 2 if rng.random() < 0.4 else 0.0
        ring = (at, depth, at + width, depth + reach) if above else (at, -reach, at + width, 0.0)
        over = (0.0, into, 0.0, 0.0) if above else (0.0, 0.0, 0.0, into)
        bodies.append(Body(ring, False, _other_eaves(rng, bodies[0].eaves), _between(rng, 0.2, 0.8), *own, False, over))
        v = depth if above else 0.0
        borders.append(((at, v), (at + width, v)))
    return Group(tuple(bodies), tuple(borders))


def barns(rng: np.random.Generator) -> Group:
    """Two to three end to end, of other eaves, mostly of one colour."""
    bodies, borders, u, depth = [], [], 0.0, _between(rng, 9, 15)
    roof, wall = _colours(rng)
    eaves = _between(rng, 3.0, 6.0)
    for k in range(int(rng.integers(2, 4))):
        length, own = _between(rng, 12, 28), (_colours(rng) if rng.random() < 0.3 else (roof, wall))
        wide = depth + _between(rng, 0.5, 3.0) if k and rng.random() < 0.5 else depth
        bodies.append(Body((u, 0.0, u + length, wide), True, eaves, _between(rng, 0.25, 0.8), *own))
        if k:
            borders.append(((u, 0.0), (u, min(depth, wide))))
        u, eaves = u + length, _other_eaves(rng, eaves)
    return Group(tuple(bodies), tuple(borders))


def winged(rng: np.random.Generator) -> Group:
    """One house or manor: wings with the same eaves as wide as one likes, or narrow and short ones with lower eaves."""
    large = bool(rng.random() < 0.5)
    length, depth = (
        (_between(rng, 18, 32), _between(rng, 9, 14)) if large else (_between(rng, 9, 14), _between(rng, 7.5, 9.5))
    )
    roof, wall = _colours(rng)
    eaves, slope, hip = _between(rng, 3.0, 7.0), _between(rng, 0.3, 0.9), bool(rng.random() < 0.4)
    bodies = [Body((0.0, 0.0, length, depth), True, eaves, slope, roof, wall, hip)]
    for at in (0.0, 1.0) if large and rng.random() < 0.6 else (float(rng.choice([0.0, _between(rng, 0.2, 0.8)])),):
        width, reach = (
            _between(rng, 0.55, 1.0 if large else 0.75) * depth,
            _between(rng, 5, 13) if large else _between(rng, 3.5, 7),
        )
        u = at * (length - width)
        low = 0.0 if large else float(rng.choice([0.0, 0.4, 1.2]))
        bodies.append(
            Body(
                (u, depth, u + width, depth + reach),
                False,
                eaves - low,
                slope,
                roof,
                wall,
                False,
                (0.0, depth / 2, 0.0, 0.0),
            )
        )
    return Group(tuple(bodies))


def church(rng: np.random.Generator) -> Group:
    """Nave, choir on the same axis, narrower and lower, mostly a tower, often a transept."""
    length, depth = _between(rng, 18, 30), _between(rng, 9, 13)
    roof, wall = _colours(rng)
    eaves, slope = _between(rng, 6, 10), _between(rng, 0.8, 1.4)
    nave = Body((0.0, 0.0, length, depth), True, eaves, slope, roof, wall)
    width, low = _between(rng, 0.55, 0.85) * depth, _between(rng, 0.5, 3.0)
    v = (depth - width) / 2
    bodies = [
        nave,
        Body(
            (length, v, length + _between(rng, 5, 10), v + width),
            True,
            eaves - low,
            slope,
            roof,
            wall,
            bool(rng.random() < 0.5),
        ),
    ]
    if rng.random() < 0.7:
        side = _between(rng, 5, 7)
        v = (depth - side) / 2
        bodies.append(
            Body(
                (-side + 2.0, v, 2.0, v + side),
                True,
                eaves + slope * depth / 2 + _between(rng, 4, 10),
                1.5,
                roof,
                wall,
                True,
            )
        )
    if rng.random() < 0.5:
        u = _between(rng, 0.55, 0.75) * length
        bodies.append(Body((u, -4.0, u + 7.0, depth + 4.0), False, eaves - 1.0, slope, roof, wall))
    return Group(tuple(bodies))


def hall(rng: np.random.Generator) -> Group:
    """Sheds side by side under one saw-tooth roof, mostly with a lower annexe."""
    count, pitch, depth = int(rng.integers(3, 7)), _between(rng, 6, 11), _between(rng, 12, 28)
    roof, wall = _colours(rng)
    eaves, rise = _between(rng, 4, 8), _between(rng, 1.6, 3.0)
    flip = bool(rng.random() < 0.5)
    bodies = [
        Body(
            (k * pitch, 0.0, (k + 1) * pitch, depth),
            True,
            eaves,
            (-1 if flip else 1) * rise / pitch,
            roof,
            wall,
            shed=True,
        )
        for k in range(count)
    ]
    if rng.random() < 0.6:
        u, wide = _between(rng, 0.0, 0.4) * count * pitch, _between(rng, 8, 14)
        low = max(eaves - _between(rng, 1.5, 3.5), 2.4)
        bodies.append(Body((u, depth, u + wide, depth + _between(rng, 5, 8)), True, low, 0.0, roof, wall))
    return Group(tuple(bodies))


KINDS: dict[str, Callable[[np.random.Generator], Group]] = {
    "farm": farm,
    "barns": barns,
    "winged": winged,
    "church": church,
    "hall": hall,
}


def group_evidence(kind: str, seed: int) -> tuple[SplitEvidence, Sequence[LineString]]:
    """What splitting gets of one group, and its true borders in the world."""
    rng = np.random.default_rng(seed)
    group = KINDS[kind](rng)
    survey = Survey(
        _between(rng, *WAVES_M), _between(rng, *WAVES_OVER_M), float(rng.choice(FACADES_KNOWN)), _between(rng, *CELLS_M)
    )
    turn = _between(rng, -40, 40)
    points = turned(points_of(group, rng), turn)
    names = ["nadir"] if rng.random() < NADIR_ALONE else list(LOOKS)
    frames = tuple(frame_of(name, points, survey, rng) for name in names)
    plan = (
        shapely.union_all([box(*b.ring) for b in group.bodies])
        .buffer(1e-3, join_style="mitre")
        .buffer(-1e-3, join_style="mitre")
    )
    outline = affinity.translate(affinity.rotate(plan, turn, origin=(0, 0)), *(ORIGIN[:2] + 30))
    assert isinstance(outline, Polygon)
    lines = [LineString(turned(np.column_stack([np.array(b), np.zeros((2, 4))]), turn)[:, :2]) for b in group.borders]
    return SplitEvidence(f"{kind}{seed}", outline, frames, 0.0), lines

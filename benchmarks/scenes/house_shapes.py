"""Roofs of drawn houses by type: volumes of random size, slope and place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cityflow.synthetic import town_shapes as shapes
from cityflow.synthetic.roofs import DORMER, LocalFace, rectangle
from cityflow.synthetic.town_shapes import Overhang, Volume


def _size(rng: np.random.Generator) -> tuple[float, float, float, float, Overhang]:
    length, depth = float(rng.uniform(9, 17)), float(rng.uniform(7, 10))
    over = 0.0 if rng.random() < 0.3 else float(rng.uniform(0.1, 0.8))
    return (
        length,
        depth,
        float(rng.uniform(3, 8)),
        float(np.tan(np.radians(rng.uniform(22, 50)))),
        Overhang.all_round(over),
    )


def _chimneys(rng: np.random.Generator, length: float, depth: float, ridge: float, slope: float) -> list[Volume]:
    count = int(rng.integers(0, 3))
    return [
        shapes.chimney(
            float(rng.uniform(0.25, 0.7)) * length,
            depth / 2 + float(rng.choice([-1.3, 0.5])) * float(rng.uniform(0.7, 1.3)),
            ridge + float(rng.uniform(0.3, 0.9)),
            ridge - 2.5 * slope - 0.5,
        )
        for _ in range(count)
    ]


def _flat(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, _, _ = _size(rng)
    return [shapes.flat_roof(rectangle(0, 0, length, depth), eave), *_chimneys(rng, length, depth, eave, 0.1)]


def _shed(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, _, over = _size(rng)
    slope = float(np.tan(np.radians(rng.uniform(8, 25))))
    return [shapes.shed_roof(length, depth, eave, slope, over)]


def _gable(rng: np.random.Generator, at: float = 0.5) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    ridge = eave + slope * depth / 2
    return [shapes.gable_roof(length, depth, eave, slope, over, at), *_chimneys(rng, length, depth, ridge, slope)]


def _gable_off(rng: np.random.Generator) -> list[Volume]:
    return _gable(rng, 0.5 + float(rng.choice([-1, 1])) * float(rng.uniform(0.06, 0.16)))


def _hip(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    length = max(length, depth + 2.0)
    ridge = eave + slope * depth / 2
    return [shapes.hip_roof(length, depth, eave, slope, over.left), *_chimneys(rng, length, depth, ridge, slope)]


def _half_hip(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    slope, ridge = max(slope, 0.7), eave + max(slope, 0.7) * depth / 2
    main = shapes.half_hip_roof(length, depth, eave, slope, over.left, float(rng.uniform(0.4, 0.65)))
    return [main, *_chimneys(rng, length, depth, ridge, slope)]


def _pyramid(rng: np.random.Generator) -> list[Volume]:
    _, _, eave, slope, over = _size(rng)
    side = float(rng.uniform(7, 11))
    return [shapes.hip_roof(side, side, eave, slope, over.left)]


def _dormers(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    slope = max(slope, 0.75)
    ridge = eave + slope * depth / 2
    main = shapes.gable_roof(length, depth, eave, slope, over)
    dormers = []
    for side in (0, 1)[: int(rng.integers(1, 3))]:
        count, width = int(rng.integers(1, 4)), float(rng.uniform(1.5, 2.5))
        back = float(rng.uniform(0.5, 1.0))
        top = min(eave + slope * back + 1.6, ridge - 0.4)
        for k in range(count):
            u = (k + 0.5) * length / count - width / 2
            v = (back, depth / 2) if side == 0 else (depth / 2, depth - back)
            dormers.append(shapes.dormer(u, v, width, top, eave))
    return [main, *dormers, *_chimneys(rng, length, depth, ridge, slope)]


def _dormered(rng: np.random.Generator, kind: str) -> list[Volume]:
    """A gable with one to three dormers on one side or both, of 2 to 3.2 m width that run at least 1.5 m into the roof."""
    length, depth, eave, slope, over = _size(rng)
    length, depth, slope = max(length, 11.0), max(depth, 8.0), max(slope, 0.75)
    ridge = eave + slope * depth / 2
    volumes = [shapes.gable_roof(length, depth, eave, slope, over)]
    for side in (0, 1)[: int(rng.integers(1, 3))]:
        count, width = int(rng.integers(1, 4)), float(rng.uniform(2.0, 3.2))
        back, run = float(rng.uniform(0.5, 1.0)), float(rng.uniform(1.5, 2.0))
        for k in range(count):
            u = (k + 0.5) * length / count - width / 2
            at = (u, back, width, run) if side == 0 else (length - u - width, back, width, run)
            own = _dormer_of(kind, at, eave, slope, ridge - 0.25)
            volumes.append(own if side == 0 else shapes.moved(own, np.pi, length, depth))
    return [*volumes, *_chimneys(rng, length, depth, ridge, slope)]


def _dormer_of(kind: str, at: tuple[float, float, float, float], eave: float, slope: float, most: float) -> Volume:
    """A dormer on the slope of v: u and v of its front's start, width, and how far its eave runs into the roof."""
    u, v, width, run = at
    ring, tilt = rectangle(u, v, u + width, v + run + 2.5), 0.35 * slope if kind == "shed" else 0.0
    low = min(eave + slope * v + (slope - tilt) * run, most - tilt * run)
    if kind != "gabled":
        return Volume(ring, (LocalFace(ring, 0, tilt, low - tilt * v, DORMER),), 0.0, eave, DORMER)
    rise = min(0.45 * width / 2, most - low)
    pitch, middle = rise / (width / 2), u + width / 2
    left, right = rectangle(u, v, middle, v + run + 2.5), rectangle(middle, v, u + width, v + run + 2.5)
    faces = (
        LocalFace(left, pitch, 0, low - pitch * u, DORMER),
        LocalFace(right, -pitch, 0, low + pitch * (u + width), DORMER),
    )
    return Volume(ring, faces, 0.0, eave, DORMER)


def _level_dormers(rng: np.random.Generator) -> list[Volume]:
    return _dormered(rng, "level")


def _shed_dormers(rng: np.random.Generator) -> list[Volume]:
    return _dormered(rng, "shed")


def _gabled_dormers(rng: np.random.Generator) -> list[Volume]:
    return _dormered(rng, "gabled")


def _winged(rng: np.random.Generator, at: float) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    width = float(rng.uniform(0.5, 0.8)) * depth
    length = max(length, 1.6 * width + 3)
    reach = depth / 2 + float(rng.uniform(3.5, 7))
    low = eave - float(rng.choice([0.0, 0.0, 0.5, 1.2]))
    main = shapes.gable_roof(length, depth, eave, slope, over)
    wing = shapes.gable_roof(reach, width, low, slope, replace(over, left=0.0))
    return [
        main,
        shapes.moved(wing, np.pi / 2, at * (length - width) + width, depth / 2),
        *_chimneys(rng, length, depth, eave + slope * depth / 2, slope),
    ]


def _l_gable(rng: np.random.Generator) -> list[Volume]:
    return _winged(rng, float(rng.choice([0.0, 1.0])))


def _t_gable(rng: np.random.Generator) -> list[Volume]:
    return _winged(rng, float(rng.uniform(0.2, 0.8)))


def _l_hip(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    length = max(length, 2.0 * depth)
    width = depth if rng.random() < 0.5 else float(rng.uniform(0.7, 0.95)) * depth
    reach = depth + float(rng.uniform(4, 8))
    main = shapes.hip_roof(length, depth, eave, slope, over.left)
    wing = shapes.hip_roof(max(reach, width + 1), width, eave, slope, over.left)
    return [main, shapes.moved(wing, np.pi / 2, width, 0.0)]


def _mansard(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, _, _ = _size(rng)
    steep, gentle = float(np.tan(np.radians(rng.uniform(62, 70)))), float(np.tan(np.radians(rng.uniform(18, 30))))
    run = float(rng.uniform(0.9, 1.4))
    top, half = eave + steep * run, depth / 2
    last = top + gentle * (half - run)
    faces = (
        LocalFace(rectangle(0, 0, length, run), 0, steep, eave),
        LocalFace(rectangle(0, run, length, half), 0, gentle, top - gentle * run),
        LocalFace(rectangle(0, half, length, depth - run), 0, -gentle, last + gentle * half),
        LocalFace(rectangle(0, depth - run, length, depth), 0, -steep, eave + steep * depth),
    )
    return [Volume(rectangle(0, 0, length, depth), faces)]


def _butterfly(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, _, _ = _size(rng)
    slope, half = float(np.tan(np.radians(rng.uniform(12, 25)))), depth / 2
    faces = (
        LocalFace(rectangle(0, 0, length, half), 0, -slope, eave + slope * half),
        LocalFace(rectangle(0, half, length, depth), 0, slope, eave - slope * half),
    )
    return [Volume(rectangle(0, 0, length, depth), faces)]


def _sawtooth(rng: np.random.Generator) -> list[Volume]:
    _, _, eave, _, _ = _size(rng)
    count, pitch, depth = int(rng.integers(3, 6)), float(rng.uniform(5, 8)), float(rng.uniform(14, 22))
    slope = float(rng.uniform(2.0, 3.0)) / pitch
    rings = [rectangle(k * pitch, 0, (k + 1) * pitch, depth) for k in range(count)]
    return [Volume(r, (LocalFace(r, slope, 0, eave - slope * k * pitch),)) for k, r in enumerate(rings)]


def _cone(rng: np.random.Generator) -> list[Volume]:
    radius = float(rng.uniform(4, 9))
    angle = np.arange(24) * 2 * np.pi / 24
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return [shapes.cone_roof(ring, (0.0, 0.0), float(rng.uniform(4, 9)), float(rng.uniform(0.4, 1.0)), 0.0)]


SHAPES: dict[str, Callable[[np.random.Generator], list[Volume]]] = {
    "flat": _flat, "shed": _shed, "gable": _gable, "gable off": _gable_off, "hip": _hip, "half-hip": _half_hip, "pyramid": _pyramid,
    "L gable": _l_gable, "T gable": _t_gable, "L hip": _l_hip, "gable dormers": _dormers,
    "mansard": _mansard, "butterfly": _butterfly, "sawtooth": _sawtooth, "cone": _cone,
    "level dormers": _level_dormers, "shed dormers": _shed_dormers, "gabled dormers": _gabled_dormers,
}  # fmt: skip

"""Detached houses: gable, hip, half-hip, pyramid, shed, flat, L- and T-shapes, with dormers and chimneys."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cityflow.synthetic import roofs
from cityflow.synthetic import town_shapes as shapes
from cityflow.synthetic.roofs import LocalFace
from cityflow.synthetic.town_drafts import BlockDraft, TreeDraft, UnitDraft, draw_style
from cityflow.synthetic.town_shapes import Overhang, Volume

HOUSE_SHAPES = ("gable", "hip", "half-hip", "pyramid", "shed", "flat", "L", "T")
HOUSE_M = (13.0, 15.5)
"""No house is longer or deeper, wings included; without overhang."""


def draw_overhang(rng: np.random.Generator) -> float:
    """0 to 1 m; one house in five has none."""
    return 0.0 if rng.random() < 0.2 else round(float(rng.uniform(0.15, 1.0)), 2)


def draw_slope(rng: np.random.Generator) -> float:
    return float(np.tan(np.radians(rng.uniform(24, 48))))


def make_house(rng: np.random.Generator, shape: str) -> UnitDraft:
    """A house with its main corner at (0, 0) and its front along v = 0."""
    length, depth = float(rng.uniform(9, 13)), float(rng.uniform(7.5, 9.5))
    eave, over = float(rng.uniform(3.0, 6.8)), draw_overhang(rng)
    volumes = SHAPES[shape](rng, (length, depth), eave, over)
    return UnitDraft(shape, tuple(volumes), draw_style(rng, flat=shape == "flat"))


def _gable(rng: np.random.Generator, size: tuple[float, float], eave: float, over: float) -> list[Volume]:
    slope = draw_slope(rng)
    ridge_at = 0.5 if rng.random() < 0.7 else float(rng.uniform(0.38, 0.62))
    main = shapes.gable_roof(*size, eave, slope, Overhang.all_round(over), ridge_at)
    return [main, *roof_extras(rng, size, eave, slope, ridge_at)]


def _hip(rng: np.random.Generator, size: tuple[float, float], eave: float, over: float) -> list[Volume]:
    slope = draw_slope(rng)
    return [shapes.hip_roof(*size, eave, slope, over), *_chimney(rng, size, eave, slope)]


def _half_hip(rng: np.random.Generator, size: tuple[float, float], eave: float, over: float) -> list[Volume]:
    slope = max(draw_slope(rng), 0.75)
    main = shapes.half_hip_roof(*size, eave, slope, over, float(rng.uniform(0.45, 0.65)))
    return [main, *_chimney(rng, size, eave, slope)]


def _pyramid(rng: np.random.Generator, size: tuple[float, float], eave: float, over: float) -> list[Volume]:
    return [shapes.hip_roof(size[1], size[1], eave, draw_slope(rng), over)]


def _shed(rng: np.random.Generator, size: tuple[float, float], eave: float, over: float) -> list[Volume]:
    return [shapes.shed_roof(*size, eave, float(rng.uniform(0.08, 0.35)), Overhang.all_round(over))]


def _flat(rng: np.random.Generator, size: tuple[float, float], eave: float, over: float) -> list[Volume]:
    main = shapes.flat_roof(roofs.rectangle(0, 0, *size), eave, min(over, 0.6))
    if rng.random() < 0.5:
        return [main]
    u, v = float(rng.uniform(1, size[0] - 4)), float(rng.uniform(1, size[1] - 4))
    ring = roofs.rectangle(u, v, u + 2.6, v + 2.6)
    lift = Volume(ring, (LocalFace(ring, 0, 0, eave + 2.2),), 0.0, eave - 0.3, windows=False)
    return [main, lift]


def _l_shape(rng: np.random.Generator, size: tuple[float, float], eave: float, over: float) -> list[Volume]:
    return _with_wing(rng, size, eave, (over, 0.0))


def _t_shape(rng: np.random.Generator, size: tuple[float, float], eave: float, over: float) -> list[Volume]:
    return _with_wing(rng, size, eave, (over, float(rng.uniform(0.25, 0.75))))


def _with_wing(
    rng: np.random.Generator, size: tuple[float, float], eave: float, over_at: tuple[float, float]
) -> list[Volume]:
    """A gable with a narrower gabled wing at the back; `over_at`: overhang, and where along the main one it stands."""
    (length, depth), (over, at) = size, over_at
    slope = draw_slope(rng)
    width = float(rng.uniform(0.55, 0.75)) * depth
    reach = depth / 2 + float(rng.uniform(3.5, 5.5))
    low = eave - float(rng.choice([0.0, 0.4, 1.2]))
    main = shapes.gable_roof(length, depth, eave, slope, Overhang.all_round(over))
    wing = shapes.gable_roof(reach, width, low, slope, Overhang(0, over, over, over))
    u = at * (length - width)
    return [
        main,
        shapes.moved(wing, np.pi / 2, u + width, depth / 2),
        *_chimney(rng, size, eave, slope),
    ]


SHAPES: dict[str, Callable[[np.random.Generator, tuple[float, float], float, float], list[Volume]]] = {
    "gable": _gable,
    "hip": _hip,
    "half-hip": _half_hip,
    "pyramid": _pyramid,
    "shed": _shed,
    "flat": _flat,
    "L": _l_shape,
    "T": _t_shape,
}


def roof_extras(
    rng: np.random.Generator, size: tuple[float, float], eave: float, slope: float, ridge_at: float = 0.5
) -> list[Volume]:
    """Dormers on the front, perhaps, and a chimney at the ridge, perhaps."""
    (length, depth), rise = size, slope * size[1] / 2
    front = rise / (depth * ridge_at)
    extras = []
    if rng.random() < 0.5 and rise > 2.4:
        set_back = float(rng.uniform(0.4, 0.9))
        width, top = float(rng.uniform(1.5, 2.4)), min(eave + front * set_back + 1.7, eave + rise - 0.4)
        count = int(rng.integers(1, max(2, int(length / (width + 1.6)) + 1)))
        for i in range(count):
            u = (i + 0.5) * length / count - width / 2
            extras.append(shapes.dormer(u, (set_back, depth * ridge_at), width, top, eave + front * set_back - 0.3))
    return extras + _chimney(rng, size, eave, slope)


def _chimney(rng: np.random.Generator, size: tuple[float, float], eave: float, slope: float) -> list[Volume]:
    """Next to the ridge in two houses of three; what the planes of the roof are does not matter, it stands in them."""
    if rng.random() > 0.65:
        return []
    length, depth = size
    ridge = eave + slope * depth / 2
    u = float(rng.uniform(0.35, 0.6)) * length
    v = depth / 2 + float(rng.choice([-1.0, 0.35])) * float(rng.uniform(0.7, 1.1))
    return [shapes.chimney(u, v, ridge + float(rng.uniform(0.5, 1.0)), ridge - slope * 2.2 - 0.5)]


def houses_block(rng: np.random.Generator, size: tuple[float, float]) -> BlockDraft:
    """Two rows of plots, a detached house on each, garden trees between."""
    block = BlockDraft("houses", size)
    across = max(1, int(size[0] // 18.5))
    deck = [str(s) for s in rng.permutation(HOUSE_SHAPES)]
    pitch = size[0] / across
    for row in range(2):
        for i in range(across):
            shape = deck[(row * across + i) % len(deck)]
            _place_house(rng, block, shape, i * pitch, row, pitch)
    return block


def _place_house(rng: np.random.Generator, block: BlockDraft, shape: str, u_0: float, row: int, pitch: float) -> None:
    half = block.size[1] / 2
    jitter = float(rng.uniform(-0.06, 0.06))
    room = max(pitch - HOUSE_M[0] - 3.2, 0.1)
    u, v = 1.6 + float(rng.uniform(0, room)), 2.2 + float(rng.uniform(0, 1.5))
    house = make_house(rng, shape)
    if row == 0:
        block.units.append(house.moved(jitter, u_0 + u, v))
    else:
        block.units.append(house.moved(np.pi + jitter, u_0 + pitch - u, block.size[1] - v))
    if rng.random() < 0.75:
        radius = float(rng.uniform(1.5, 3.6))
        at = u_0 + float(rng.uniform(0, pitch)), half + float(rng.uniform(-2.5, 2.5))
        block.trees.append(TreeDraft(*at, radius, radius * float(rng.uniform(2.2, 3.2))))
    drive = (u_0, 0.0, u_0 + 1.6, half - 2) if row == 0 else (u_0 + pitch - 1.6, half + 2, u_0 + pitch, block.size[1])
    block.paved.append(drive)

"""What buildings with discontinuities have besides: posts, gables with panels and dormers, lift houses, bay windows, balconies, loggias, canopies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cityflow.synthetic import roofs
from cityflow.synthetic import town_shapes as shapes
from cityflow.synthetic.town_building import GROUND, Building, between
from cityflow.synthetic.town_drafts import FLATS
from cityflow.synthetic.town_masses import Box, box_volume
from cityflow.synthetic.town_shapes import Overhang, Volume

POST_M, POST_PITCH_M = 0.5, 4.2
BALCONY_M = (3.4, 1.4, 0.2, 1.0)
"""Width, depth, thickness, and height of the balustrade."""
FLAT_MATERIALS = tuple(material for material, _ in FLATS)


def posts(b: Building, v: float) -> list[Volume]:
    """Under the first floor, along the whole length."""
    count = max(2, round(b.size[0] / POST_PITCH_M) + 1)
    return [
        box_volume(Box(u, v, GROUND, u + POST_M, v + POST_M, b.floor(1)), roofs.POST, windows=False)
        for u in np.round(np.linspace(0.0, b.size[0] - POST_M, count), 3).tolist()
    ]


def roof_of(b: Building) -> tuple[Volume, ...]:
    """A gable on the mass where the style has no level roof, with panels on its front and a chimney; else panels and a lift house."""
    (length, depth), level_roof = b.size, b.style.roof.material in FLAT_MATERIALS
    if level_roof:
        add_lift_house(b, depth / 2)
        return ()
    slope, over = float(np.tan(np.radians(b.rng.uniform(28, 42)))), between(b.rng, (0.3, 0.8))
    gable = shapes.gable_roof(length, depth, b.top + 0.8, slope, Overhang.all_round(over))
    extras = [shapes.chimney(0.3 * length, 0.55 * depth, b.top + 0.8 + slope * depth / 2 + 0.7, b.top + 1.2)]
    if b.wants():
        extras.append(_panels(b, slope))
    if b.wants():
        extras += [
            shapes.dormer(
                u * length,
                (1.0, depth / 2),
                1.9,
                b.top + 0.8 + min(slope * 1.0 + 1.8, slope * depth / 2 - 0.4),
                b.top + 0.6,
            )
            for u in (0.2, 0.7)
        ]
    return replace(gable, bottom=b.top, carried=True), *extras


def _panels(b: Building, slope: float) -> Volume:
    """Solar panels 0.12 m above the front of a gable."""
    length, half = b.size[0], b.size[1] / 2
    ring = roofs.rectangle(0.42 * length, 0.25 * half, 0.65 * length, 0.75 * half)
    face = roofs.LocalFace(ring, 0, slope, b.top + 0.8 + 0.12, roofs.PANEL)
    return Volume(ring, (face,), 0.0, b.top + 0.4, roofs.PANEL, windows=False)


def add_lift_house(b: Building, v: float) -> None:
    """On a level roof, with panels beside it in half of all cases."""
    length = b.size[0]
    if b.wants():
        u = round(float(b.rng.uniform(0.2, 0.6)) * length, 2)
        v = round(min(v, b.size[1] - 5.5), 2)
        b.more.append(box_volume(Box(u, v, b.top, u + 3.2, v + 3.6, b.top + 2.4), windows=False))
        ring = roofs.rectangle(0.05 * length, v, 0.05 * length + 2.4, v + 1.2)
        b.more.append(
            Volume(
                ring,
                (roofs.LocalFace(ring, 0, 0.5, b.top + 0.15 - 0.5 * v, roofs.PANEL),),
                0.0,
                b.top,
                roofs.PANEL,
                False,
            )
        )


def add_bays(b: Building, below: int) -> None:
    """Bay windows at the front, from the second storey to the one below `below`."""
    count = int(b.size[0] // 7.5)
    for n in range(count):
        if b.wants() and below >= 2:
            wide, out = between(b.rng, (3.0, 3.8)), between(b.rng, (1.0, 1.5))
            u = round((n + 0.5) * b.size[0] / count - wide / 2, 2)
            b.add(roofs.BAY, Box(u, -out, b.floor(1), u + wide, 0.0, b.floor(below)), 1)


def add_back_details(b: Building) -> None:
    """Balconies before the back, or loggias in it, from the second storey on."""
    length, depth = b.size
    wide, out, thick, rail = BALCONY_M
    loggias, count = b.rng.random() < 0.5, int(length // 6.5)
    for n in range(count if b.level.details else 0):
        u = round((n + 0.5) * length / count - wide / 2, 2)
        for storey in range(1, b.storeys):
            z = b.floor(storey)
            if loggias:
                void = Box(u, depth - 1.6, z, u + wide, depth, round(z + b.style.storey_m - 0.3, 3))
                b.cut("loggia", void, front=False, storey=storey)
            elif b.wants():
                box = Box(u, depth, z - thick, u + wide, depth + out, z)
                b.add(roofs.BALCONY, box, storey)
                b.more += _rails(box, rail)


def _rails(box: Box, rail: float) -> list[Volume]:
    u_0, v_0, _, u_1, v_1, z = box
    w, top = 0.1, z + rail
    sides = (
        Box(u_0, v_1 - w, z, u_1, v_1, top),
        Box(u_0, v_0, z, u_0 + w, v_1 - w, top),
        Box(u_1 - w, v_0, z, u_1, v_1 - w, top),
    )
    return [box_volume(s, roofs.PARAPET, windows=False) for s in sides]


def add_canopy(b: Building, height: float) -> None:
    """A plate of 0.6 m on two posts before the front."""
    wide, out = between(b.rng, (5.0, 8.0)), between(b.rng, (2.5, 3.5))
    u = round((b.size[0] - wide) / 2, 2)
    b.add(roofs.CANOPY, Box(u, -out, height, u + wide, 0.0, height + 0.6), 0)
    for at in (u, u + wide - 0.3):
        b.more.append(box_volume(Box(at, -out, GROUND, at + 0.3, 0.3 - out, height), roofs.POST, windows=False))

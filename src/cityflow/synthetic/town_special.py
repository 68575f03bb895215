"""Blocks of one large building: church with tower, hall, stepped block, round and curved building, slab."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.synthetic import town_shapes as shapes
from cityflow.synthetic.mesh import Material
from cityflow.synthetic.roofs import LocalFace, rectangle
from cityflow.synthetic.town_drafts import SLATES, BlockDraft, Finish, TreeDraft, UnitDraft, draw_style
from cityflow.synthetic.town_houses import make_house
from cityflow.synthetic.town_shapes import Overhang, Ring, Volume


def church_block(rng: np.random.Generator, size: tuple[float, float]) -> BlockDraft:
    """Nave with transept, apse and a tower with a spire; trees around."""
    block = BlockDraft("church", size)
    width, length = float(rng.uniform(10, 13)), float(rng.uniform(22, 28))
    eave, slope = float(rng.uniform(8, 11)), float(np.tan(np.radians(rng.uniform(48, 56))))
    nave = shapes.gable_roof(length, width, eave, slope, Overhang(0, 0, 0.3, 0.3))
    arm = shapes.gable_roof(width + 8.0, 7.0, eave - 1.0, slope, Overhang(0.3, 0.3, 0.3, 0.3))
    transept = shapes.moved(arm, np.pi / 2, 0.72 * length, -4.0)
    side = float(rng.uniform(6.0, 7.5))
    top = eave + slope * width / 2 + float(rng.uniform(6, 12))
    spire = shapes.hip_roof(side, side, top, float(rng.uniform(2.2, 3.5)), 0.0)
    tower = shapes.moved(spire, 0.0, 2.0 - side, (width - side) / 2)
    volumes = (nave, transept, tower, _apse(length, width, eave))
    style = draw_style(rng)
    slate = Finish(Material.SLATE, SLATES[int(rng.integers(len(SLATES)))])
    tall = replace(style, storey_m=6.0, sill_m=2.2, window_m=(1.1, 3.4), pitch_m=3.6, roof=slate)
    u, v = (size[0] - length - side) / 2 + side, (size[1] - width) / 2
    block.units.append(UnitDraft("church", volumes, tall).moved(0.0, u, v))
    block.trees += _rim_trees(rng, size, 9)
    block.paved.append((0.0, v, u - side, v + width))
    return block


def _apse(length: float, width: float, eave: float) -> Volume:
    """Half of a ten-sided ring against the end of the nave, under a steep half cone."""
    radius, low = 0.36 * width, eave - 1.5
    angle = np.linspace(-np.pi / 2, np.pi / 2, 6)
    tip = (length, width / 2)
    rim = np.column_stack([length + radius * np.cos(angle), width / 2 + radius * np.sin(angle)])
    ring = [(length - 0.5, width / 2 - radius), *map(tuple, rim), (length - 0.5, width / 2 + radius)]
    rise = 2.4
    faces = []
    for a, b in pairwise(rim):
        inward = np.asarray(tip) - (a + b) / 2
        g = inward / float(inward @ inward) * rise
        corners = ((float(a[0]), float(a[1])), (float(b[0]), float(b[1])), tip)
        faces.append(LocalFace(corners, float(g[0]), float(g[1]), float(low - g @ a)))
    faces += [_strip(length, width / 2, -radius, low, rise), _strip(length, width / 2, radius, low, rise)]
    return Volume(tuple((float(p), float(q)) for p, q in ring), tuple(faces))


def _strip(u: float, v: float, reach: float, low: float, rise: float) -> LocalFace:
    """Half a metre of ordinary roof that ties the apse to the nave."""
    slope = -rise / reach
    a, b = sorted((v, v + reach))
    return LocalFace(rectangle(u - 0.5, a, u, b), 0, slope, low - slope * (v + reach))


def hall_block(rng: np.random.Generator, size: tuple[float, float]) -> BlockDraft:
    """A hall of low slope or with a saw-tooth roof, a lower annexe, a paved yard."""
    block = BlockDraft("hall", size)
    length, depth = 0.62 * size[0], float(rng.uniform(0.5, 0.6)) * size[1]
    eave = float(rng.uniform(6.5, 10))
    style = draw_style(rng, flat=True)
    wide = replace(style, storey_m=5.5, sill_m=2.8, window_m=(3.0, 1.4), pitch_m=5.0)
    if rng.random() < 0.35:
        volumes, name = _saw_teeth(length, depth, eave), "hall saw-tooth"
    else:
        over = Overhang.all_round(0.4 if rng.random() < 0.5 else 0.0)
        volumes, name = [shapes.gable_roof(length, depth, eave, float(rng.uniform(0.06, 0.16)), over)], "hall"
    ring = rectangle(2.0, depth - 0.5, 14.0, depth + 6.5)
    volumes.append(Volume(ring, (LocalFace(ring, 0, 0, eave - float(rng.uniform(2.2, 3.5))),)))
    block.units.append(UnitDraft(name, tuple(volumes), wide).moved(0.0, 0.15 * size[0], 0.14 * size[1]))
    block.paved.append((0.0, 0.0, size[0], size[1]))
    block.trees += _rim_trees(rng, size, 3)
    return block


def _saw_teeth(length: float, depth: float, eave: float) -> list[Volume]:
    """Sheds side by side; the upright sides are height steps within one outline."""
    count = max(3, round(length / 8))
    pitch = length / count
    slope = 2.4 / pitch
    return [
        Volume(
            rectangle(i * pitch, 0, (i + 1) * pitch, depth),
            (LocalFace(rectangle(i * pitch, 0, (i + 1) * pitch, depth), -slope, 0, eave + slope * (i + 1) * pitch),),
        )
        for i in range(count)
    ]


def stepped_block(rng: np.random.Generator, size: tuple[float, float]) -> BlockDraft:
    """Level parts of very different height in one outline, a lift house upon them, and a tower block beside."""
    block = BlockDraft("stepped", size)
    count = int(rng.integers(3, 5))
    cuts = np.round(np.cumsum(np.r_[0.0, rng.uniform(8, 13, count)]), 3)
    heights = rng.permutation(np.array([5.5, 9.0, 14.5, 20.0])[:count]) + rng.uniform(-0.9, 0.9, count)
    depth = np.round(rng.uniform(11, 15, count), 3)
    volumes = [
        shapes.flat_roof(rectangle(float(cuts[i]), 0.0, float(cuts[i + 1]), float(depth[i])), float(heights[i]))
        for i in range(count)
    ]
    high = int(np.argmax(heights))
    lift = rectangle(float(cuts[high]) + 2, 4.0, float(cuts[high]) + 5.5, 8.0)
    top = float(heights[high])
    volumes.append(Volume(lift, (LocalFace(lift, 0, 0, top + 2.7),), 0.0, top - 0.4, windows=False))
    block.units.append(UnitDraft("stepped", tuple(volumes), draw_style(rng, flat=True)).moved(0.0, 2.0, 3.0))
    side = float(rng.uniform(11, 14))
    tower = shapes.flat_roof(rectangle(0, 0, side, side), float(rng.uniform(24, 38)))
    at = size[0] - side - 3, size[1] - side - 3
    block.units.append(UnitDraft("tower", (tower,), draw_style(rng, flat=True)).moved(0.0, *at))
    block.paved.append((at[0] - 8, at[1], at[0] - 2, size[1]))
    block.trees += _rim_trees(rng, size, 4)
    return block


def slab_block(rng: np.random.Generator, size: tuple[float, float]) -> BlockDraft:
    """A long slab of many storeys, and garages."""
    block = BlockDraft("slab", size)
    length, depth = size[0] - 14, float(rng.uniform(10, 12.5))
    volumes = [shapes.flat_roof(rectangle(0, 0, length, depth), float(rng.uniform(14, 26)), 0.0)]
    for share in (0.25, 0.7):
        ring = rectangle(share * length, depth / 2 - 2, share * length + 4, depth / 2 + 2)
        top = volumes[0].faces[0].height
        volumes.append(Volume(ring, (LocalFace(ring, 0, 0, top + 2.4),), 0.0, top - 0.4, windows=False))
    block.units.append(UnitDraft("slab", tuple(volumes), draw_style(rng, flat=True)).moved(0.0, 7.0, 4.0))
    count = int(rng.integers(4, 9))
    for i in range(count):
        ring = rectangle(0, 0, 3.0, 6.0)
        garage = UnitDraft("garage", (shapes.flat_roof(ring, 2.6),), draw_style(rng, flat=True), row=0, level=0)
        block.units.append(garage.moved(0.0, 8.0 + 3.0 * i, size[1] - 9.0))
    block.paved.append((6.0, size[1] - 15.0, 10.0 + 3.0 * count, size[1] - 9.0))
    block.trees += _rim_trees(rng, size, 5)
    return block


def round_block(rng: np.random.Generator, size: tuple[float, float]) -> BlockDraft:
    """A round building (cone or level roof) and two houses."""
    block = BlockDraft("round", size)
    radius, sides = float(rng.uniform(7, 10)), 32
    angle = np.arange(sides) * 2 * np.pi / sides
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    eave = float(rng.uniform(6, 12))
    if rng.random() < 0.6:
        volume = shapes.cone_roof(ring, (0.0, 0.0), eave, float(rng.uniform(0.3, 0.8)), float(rng.uniform(0, 0.6)))
        style, name = draw_style(rng), "round cone"
    else:
        volume, name = shapes.flat_roof(_as_ring(ring), eave), "round flat"
        style = draw_style(rng, flat=True)
    narrow = replace(style, window_m=(0.8, 1.5), pitch_m=1.2)
    block.units.append(UnitDraft(name, (volume,), narrow).moved(0.0, 0.42 * size[0], size[1] / 2))
    for v in (2.0, size[1] / 2 + 1.5):
        house = make_house(rng, str(rng.choice(["gable", "hip", "half-hip", "shed"])))
        block.units.append(house.moved(0.0, size[0] - 15.0, v))
    block.trees += _rim_trees(rng, size, 5)
    return block


def _as_ring(points: FloatArray) -> Ring:
    return tuple((float(u), float(v)) for u, v in points)


def curved_block(rng: np.random.Generator, size: tuple[float, float]) -> BlockDraft:
    """A crescent: short straight pieces along an arc, level or with a ridge."""
    block = BlockDraft("curved", size)
    inner = float(rng.uniform(14, 18))
    outer, eave = inner + float(rng.uniform(9, 11)), float(rng.uniform(7, 13))
    reach, pieces = float(rng.uniform(0.55, 0.8)) * np.pi, 18
    angle = np.pi / 2 + np.linspace(-reach / 2, reach / 2, pieces + 1)
    spoke = np.column_stack([np.cos(angle), np.sin(angle)])
    ridged = bool(rng.random() < 0.5)
    faces = _crescent_faces(spoke, (inner, outer), eave, float(rng.uniform(0.5, 0.8)) if ridged else 0.0)
    ring = _as_ring(np.concatenate([outer * spoke, inner * spoke[::-1]]))
    style = replace(draw_style(rng, flat=not ridged), pitch_m=1.9, window_m=(1.1, 1.5))
    name = "curved gable" if ridged else "curved flat"
    unit = UnitDraft(name, (Volume(ring, faces),), style)
    block.units.append(unit.moved(0.0, size[0] / 2, (size[1] - outer) / 2 - inner * 0.3))
    block.paved.append((size[0] / 2 - 9, 2.0, size[0] / 2 + 9, 12.0))
    block.trees += _rim_trees(rng, size, 5)
    return block


def _crescent_faces(spoke: FloatArray, radii: tuple[float, float], eave: float, slope: float) -> tuple[LocalFace, ...]:
    """Two faces per piece (one where level): outer one falling outwards, inner one falling inwards."""
    inner, outer = radii
    if slope == 0:
        return tuple(
            LocalFace(_as_ring(np.array([inner * a, outer * a, outer * b, inner * b])), 0, 0, eave)
            for a, b in pairwise(spoke)
        )
    middle, faces = (inner + outer) / 2, []
    for a, b in pairwise(spoke):
        out = (a + b) / np.linalg.norm(a + b)
        g = slope * out
        low_in = eave - float(g @ (inner * a))
        low_out = eave + float(g @ (outer * a))
        faces.append(
            LocalFace(
                _as_ring(np.array([inner * a, middle * a, middle * b, inner * b])), float(g[0]), float(g[1]), low_in
            )
        )
        faces.append(
            LocalFace(
                _as_ring(np.array([middle * a, outer * a, outer * b, middle * b])), -float(g[0]), -float(g[1]), low_out
            )
        )
    return tuple(faces)


def park_block(rng: np.random.Generator, size: tuple[float, float]) -> BlockDraft:
    """Trees, close and far."""
    block = BlockDraft("park", size)
    for _ in range(int(size[0] * size[1] / 110)):
        radius = float(rng.uniform(1.8, 5.0))
        at = float(rng.uniform(2, size[0] - 2)), float(rng.uniform(2, size[1] - 2))
        block.trees.append(TreeDraft(*at, radius, radius * float(rng.uniform(2.2, 3.2))))
    block.paved.append((0.0, size[1] / 2 - 1.5, size[0], size[1] / 2 + 1.5))
    return block


def _rim_trees(rng: np.random.Generator, size: tuple[float, float], count: int) -> list[TreeDraft]:
    """Trees along the edge of a block."""
    trees = []
    for _ in range(count):
        radius = float(rng.uniform(1.8, 4.0))
        u, v = float(rng.uniform(2, size[0] - 2)), float(rng.choice([1.5, size[1] - 1.5]))
        trees.append(TreeDraft(u, v, radius, radius * float(rng.uniform(2.2, 3.2))))
    return trees

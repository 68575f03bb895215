"""Cars at the kerbs: two boxes each, a body and a cabin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.grid import Bounds
from cityflow.synthetic.mesh import Material, Part
from cityflow.synthetic.town_ground import Ground
from cityflow.synthetic.town_layout import PAVEMENT_M, PlacedBlock, StreetNet
from cityflow.synthetic.town_soup import FaceSoup, Look, TextureFrame

LENGTH_M, WIDTH_M = 4.3, 1.78
BODY_M = (0.22, 0.85)
CABIN_M = (0.85, 1.45)
PAINTS = np.array([(40, 42, 46), (200, 200, 204), (150, 30, 28), (36, 60, 110), (236, 236, 232), (110, 112, 116), (60, 90, 70)])  # fmt: skip


@dataclass(frozen=True, slots=True)
class Cars:
    """(C,) each: world x, y of the middle, heading of the length (radians), height of the ground, row in `PAINTS`."""

    x: FloatArray
    y: FloatArray
    heading: FloatArray
    ground: FloatArray
    paint: IntArray

    def __len__(self) -> int:
        return len(self.x)

    def polygons(self) -> list[Polygon]:
        """Plan of every car."""
        return [shapely.Polygon(r) for r in _rings(self, np.arange(len(self)), (LENGTH_M, WIDTH_M, 0.0))]


def park_cars(
    seed: int, blocks: Sequence[PlacedBlock], net: StreetNet, ground: Ground, bounds: Bounds, share: float
) -> Cars:
    """Cars along the kerbs of all blocks; `bounds` are those of the town, `share` of the places is taken."""
    rng = np.random.default_rng([seed, 31])
    rows = [np.empty((0, 3))]
    for block in blocks:
        length, depth = block.draft.size
        off = PAVEMENT_M + 0.25 + WIDTH_M / 2
        rows += [_kerb(rng, block.u, length, (0.0, block.v - off), share)]
        rows += [_kerb(rng, block.u, length, (0.0, block.v + depth + off), share)]
        rows += [_kerb(rng, block.v, depth, (np.pi / 2, block.u - off), share)]
    table = np.concatenate(rows)
    x, y = net.to_world(table[:, 0], table[:, 1])
    inside = (x > bounds[0] + 4) & (x < bounds[2] - 4) & (y > bounds[1] + 4) & (y < bounds[3] - 4)
    inside &= ground.terrain.is_buildable(x, y)
    x, y, table = x[inside], y[inside], table[inside]
    paint = rng.integers(len(PAINTS), size=len(x))
    return Cars(x, y, table[:, 2] + net.heading, ground.z(x, y), paint)


def _kerb(rng: np.random.Generator, start: float, length: float, line: tuple[float, float], share: float) -> FloatArray:
    """(C, 3) u, v and heading in the net's frame of the places taken along one kerb."""
    heading, across = line
    places = start + 4.0 + np.arange(int((length - 8.0) / 5.6)) * 5.6
    taken = places[rng.random(len(places)) < share]
    along = taken + rng.uniform(0, 0.8, len(taken))
    fixed = across + rng.uniform(-0.15, 0.15, len(taken))
    u, v = (along, fixed) if heading == 0 else (fixed, along)
    return np.column_stack([u, v, np.full(len(taken), heading)])


def _rings(cars: Cars, rows: IntArray, box: tuple[float, float, float]) -> FloatArray:
    """(C, 4, 2) corners of boxes of length, width, and shift backwards."""
    length, width, back = box
    corner = np.array([(-length, -width), (length, -width), (length, width), (-length, width)]) / 2 - [back, 0]
    c, s = np.cos(cars.heading[rows])[:, None], np.sin(cars.heading[rows])[:, None]
    x = cars.x[rows][:, None] + c * corner[:, 0] - s * corner[:, 1]
    y = cars.y[rows][:, None] + s * corner[:, 0] + c * corner[:, 1]
    return np.stack([x, y], axis=2)


def add_cars(soup: FaceSoup, cars: Cars, bounds: Bounds) -> None:
    """All cars whose plan may meet `bounds`."""
    far = LENGTH_M / 2 + WIDTH_M / 2
    meets = (cars.x + far > bounds[0]) & (cars.x - far < bounds[2])
    meets &= (cars.y + far > bounds[1]) & (cars.y - far < bounds[3])
    for paint in range(len(PAINTS)):
        rows = np.flatnonzero(meets & (cars.paint == paint))
        r, g, b = (int(c) for c in PAINTS[paint])
        body = Look(Part.CAR, Material.PAINT, (r, g, b), seed=paint)
        add_boxes(soup, _rings(cars, rows, (LENGTH_M, WIDTH_M, 0.0)), cars.ground[rows], BODY_M, body)
        cabin = Look(Part.CAR, Material.GLASS, (52, 60, 66), seed=paint)
        add_boxes(soup, _rings(cars, rows, (2.2, 1.5, 0.25)), cars.ground[rows], CABIN_M, cabin)


def add_boxes(soup: FaceSoup, rings: FloatArray, ground: FloatArray, span: tuple[float, float], look: Look) -> None:
    """Upright boxes over plan rings (K, n, 2), counter-clockwise, from ground + span[0] to ground + span[1]."""
    if len(rings) == 0:
        return
    low = np.concatenate([rings, np.broadcast_to((ground + span[0])[:, None, None], (*rings.shape[:2], 1))], axis=2)
    high = low + np.array([0, 0, span[1] - span[0]])
    following_low, following_high = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    sides = np.stack([low, following_low, following_high, high], axis=2).reshape(-1, 4, 3)
    along = sides[:, 1] - sides[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    up = np.array([0.0, 0.0, 1.0])
    soup.add(sides, look, TextureFrame(sides[:, 0], along, up))
    flat = high[:, 1] - high[:, 0]
    flat /= np.linalg.norm(flat, axis=1)[:, None]
    soup.add(high, look, TextureFrame(high[:, 0], flat, np.cross(up, flat)))
    soup.add(low[:, ::-1], look, TextureFrame(low[:, 0], flat, np.cross(flat, up)))

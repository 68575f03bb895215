"""What a block of the town shall hold, in the block's own plan frame, before it stands on the terrain."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from cityflow.synthetic.mesh import Material
from cityflow.synthetic.town_shapes import Ring, Volume, moved, quarter_exact
from cityflow.synthetic.town_soup import Tint

BRICKS: tuple[Tint, ...] = ((146, 76, 58), (165, 92, 66), (120, 66, 54), (176, 120, 88), (190, 160, 120))
PLASTERS: tuple[Tint, ...] = (
    (226, 216, 196), (238, 234, 226), (214, 190, 140), (196, 170, 150), (222, 204, 160), (186, 196, 190),
    (204, 150, 120), (168, 180, 196), (230, 200, 190),
)  # fmt: skip
TILES: tuple[Tint, ...] = ((160, 76, 52), (140, 66, 48), (176, 96, 66), (112, 62, 52), (96, 84, 78))
SLATES: tuple[Tint, ...] = ((78, 82, 90), (92, 94, 98), (66, 70, 80))
FLATS: tuple[tuple[Material, Tint], ...] = (
    (Material.BITUMEN, (74, 74, 78)),
    (Material.GRAVEL, (150, 146, 138)),
    (Material.BITUMEN, (108, 106, 104)),
    (Material.METAL, (150, 158, 164)),
)
DOORS: tuple[Tint, ...] = ((84, 54, 36), (40, 66, 52), (52, 58, 84), (120, 40, 36), (180, 176, 170))


class Finish(NamedTuple):
    """Material and base colour of a surface."""

    material: Material
    tint: Tint


@dataclass(frozen=True, slots=True)
class Style:
    """Colours of a unit and the rhythm of its façades.

    Attributes
    ----------
    facade, roof : material and base colour
    storey_m : from floor to floor;  sill_m : height of sills above the floor
    window_m : width and height;  pitch_m : from one window to the next
    recess_m : depth of the reveals
    door_tint : base colour of doors
    seed : makes patterns and window positions the unit's own
    """

    facade: Finish
    roof: Finish
    storey_m: float
    sill_m: float
    window_m: tuple[float, float]
    pitch_m: float
    recess_m: float
    door_tint: Tint
    seed: int


@dataclass(frozen=True, slots=True)
class BreakDraft:
    """A place where the storeys of a building differ, as it was made.

    Attributes
    ----------
    kind : set-back, arcade, passage, bay, balcony, loggia, stilts, canopy, tower, court
    a, b : ends of the outer edge, plan frame, metres; outside on the right hand
    depth_m : square to it, inwards; negative where something stands out
    low_m, high_m : heights that the void, or what stands out, begins and ends at, above the base
    soffit_m : height of the underside over the void or of what stands out; None: open to the sky
    storey : number of the lowest storey that it is in, from 0
    """

    kind: str
    a: tuple[float, float]
    b: tuple[float, float]
    depth_m: float
    low_m: float
    high_m: float
    soffit_m: float | None
    storey: int

    def moved(self, angle: float, u: float, v: float) -> BreakDraft:
        c, s = quarter_exact(angle)
        a, b = ((c * p - s * q + u, s * p + c * q + v) for p, q in (self.a, self.b))
        return replace(self, a=a, b=b)


@dataclass(frozen=True, slots=True)
class UnitDraft:
    """A single unit: its volumes (first the main one, whose first ring edge is the front) and style.

    Attributes
    ----------
    row : number of the terrace within the block, -1 for what stands alone
    level : units of a block with the same number stand at one height; -1: at the terrain's mean under the unit
    twin : identical to the unit before but for the façade
    pipes : drain pipe at the left (u small) and right end of front and back
    breaks : where its storeys differ
    most_fall_m : the terrain under it falls no more, metres; None: as the town has it
    """

    shape: str
    volumes: tuple[Volume, ...]
    style: Style
    row: int = -1
    level: int = -1
    twin: bool = False
    pipes: tuple[bool, bool] = (False, False)
    breaks: tuple[BreakDraft, ...] = ()
    most_fall_m: float | None = None

    def moved(self, angle: float, u: float, v: float) -> UnitDraft:
        volumes = tuple(moved(volume, angle, u, v) for volume in self.volumes)
        return replace(self, volumes=volumes, breaks=tuple(b.moved(angle, u, v) for b in self.breaks))


@dataclass(frozen=True, slots=True)
class GapDraft:
    """A gap of 0.8 to 2 m between two units of a row (indices into the block's units); `tree`: filled by a high tree."""

    ring: Ring
    between: tuple[int, int]
    tree: bool


@dataclass(frozen=True, slots=True)
class TreeDraft:
    """A tree in the block frame: place, radius of the crown and height of its top above ground; metres."""

    u: float
    v: float
    radius: float
    height: float


@dataclass(slots=True)
class BlockDraft:
    """All that one block holds; `paved` are rectangles (u_0, v_0, u_1, v_1) of paving instead of garden."""

    kind: str
    size: tuple[float, float]
    units: list[UnitDraft] = field(default_factory=list)
    gaps: list[GapDraft] = field(default_factory=list)
    trees: list[TreeDraft] = field(default_factory=list)
    paved: list[tuple[float, float, float, float]] = field(default_factory=list)


def draw_style(rng: np.random.Generator, flat: bool = False) -> Style:
    """A style at random; `flat` roofs get a material for level roofs."""
    return Style(
        facade=draw_facade(rng),
        roof=draw_flat_roof(rng) if flat else draw_roof(rng),
        storey_m=float(rng.uniform(2.6, 3.2)),
        sill_m=float(rng.uniform(0.75, 1.0)),
        window_m=(float(rng.uniform(0.9, 1.5)), float(rng.uniform(1.2, 1.6))),
        pitch_m=float(rng.uniform(1.9, 3.0)),
        recess_m=float(rng.uniform(0.10, 0.20)),
        door_tint=DOORS[int(rng.integers(len(DOORS)))],
        seed=int(rng.integers(2**31)),
    )


def draw_facade(rng: np.random.Generator) -> Finish:
    if rng.random() < 0.45:
        return Finish(Material.BRICK, _varied(rng, BRICKS[int(rng.integers(len(BRICKS)))]))
    return Finish(Material.PLASTER, _varied(rng, PLASTERS[int(rng.integers(len(PLASTERS)))]))


def draw_roof(rng: np.random.Generator) -> Finish:
    if rng.random() < 0.75:
        return Finish(Material.ROOF_TILE, _varied(rng, TILES[int(rng.integers(len(TILES)))]))
    return Finish(Material.SLATE, _varied(rng, SLATES[int(rng.integers(len(SLATES)))]))


def draw_flat_roof(rng: np.random.Generator) -> Finish:
    material, tint = FLATS[int(rng.integers(len(FLATS)))]
    return Finish(material, _varied(rng, tint))


def _varied(rng: np.random.Generator, tint: Tint) -> Tint:
    """The same colour a little brighter or darker."""
    r, g, b = (int(c) for c in np.clip(np.asarray(tint) * rng.uniform(0.88, 1.1), 0, 255))
    return r, g, b

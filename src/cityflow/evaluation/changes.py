"""Changes of buildings between two epochs: new, gone, altered; an alteration is one that stands out of the accuracy of both models.

Roofs are compared where both models have one, on a lattice of places. What differs by more than several standard deviations, and more than a
person cares for, over a part of the roof that is no thin rim, is altered. How exact heights are is what the models state, and at least the scatter
of all pairs of the update: most buildings stay as they are, so the median of all roofs' differences is the offset between the surveys, which is taken
away. Outlines are compared likewise: a part in plan that is wider than several standard deviations of both outlines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import shapely
from pydantic import Field
from scipy import ndimage
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Semantic
from cityflow.core.grid import Grid
from cityflow.core.parameters import Parameters
from cityflow.evaluation.change_pairs import EpochUnit, Pair
from cityflow.geometry.polyhedron import face_normals, volume

NMAD = 1.4826
ENOUGH_PAIRS = 20
"""Pairs whose median and scatter say more of the surveys than what the models state."""
UNSTATED_SIGMA_M = 0.1
"""Of a roof whose model states nothing; set by hand."""


class ChangeParameters(Parameters):
    """What counts as an alteration."""

    sigmas: float = Field(3.0, gt=0, le=10, description="least difference, in its standard deviations")
    least_height_m: float = Field(0.5, ge=0, le=10, description="least difference of a roof, m")
    least_area_m2: float = Field(4.0, gt=0, le=1000, description="least part of a roof or outline that differs, m²")
    cell_m: float = Field(0.5, ge=0.1, le=2, description="distance of the places at which roofs are compared, m")


class Kind(StrEnum):
    """What became of a building."""

    NEW = "new"
    GONE = "gone"
    ALTERED = "altered"


@dataclass(frozen=True, slots=True)
class Figures:
    """Differences, after minus before; None where one of them has no model.

    Attributes
    ----------
    ridge_m, eaves_m : of the highest and lowest vertex of the roof
    volume_m3, area_m2 : of the solid and of the footprint
    roof_mean_m, roof_rms_m : of the roofs, where both exist, less the offset between the surveys
    roof_changed_m2, outline_changed_m2 : plan area of what is altered
    significance : of the larger alteration, in standard deviations; None of new and gone ones
    """

    ridge_m: float | None
    eaves_m: float | None
    volume_m3: float | None
    area_m2: float
    roof_mean_m: float | None = None
    roof_rms_m: float | None = None
    roof_changed_m2: float = 0.0
    outline_changed_m2: float = 0.0
    significance: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One change; `before` and `after` are the building, None where there is none."""

    kind: Kind
    before: EpochUnit | None
    after: EpochUnit | None
    figures: Figures

    @property
    def id(self) -> str:
        """Of the building as it is now, of one that is gone as it was."""
        unit = self.after or self.before
        assert unit is not None
        return unit.id


@dataclass(frozen=True, slots=True)
class Changes:
    """Of an update.

    Attributes
    ----------
    found : changes, by kind and name;  compared : buildings that were modelled again and found as they were
    without_model : names of buildings that one of the epochs has no model of: only their outlines were compared
    offset_m, scatter_m : median and NMAD of the differences of all roofs; 0 where there are too few to tell
    """

    found: tuple[Change, ...]
    compared: int
    without_model: tuple[str, ...]
    offset_m: float
    scatter_m: float


@dataclass(frozen=True, slots=True, eq=False)
class _Roofs:
    """Differences of two roofs: heights (rows, cols) of places, NaN where one has none; their stated standard deviation."""

    heights: FloatArray
    sigma_m: float

    @property
    def known(self) -> FloatArray:
        return self.heights[np.isfinite(self.heights)]


def changes_of(pairs: Sequence[Pair], parameters: ChangeParameters) -> Changes:
    """What became of every pair."""
    both = [(a, b) for a, b in pairs if a is not None and b is not None]
    roofs = [_roofs(a, b, parameters) for a, b in both]
    medians = np.array([np.median(r.known) for r in roofs if r is not None and len(r.known)])
    told = len(medians) >= ENOUGH_PAIRS
    offset = float(np.median(medians)) if told else 0.0
    scatter = float(NMAD * np.median(np.abs(medians - offset))) if told else 0.0
    found = [_one(a, b) for a, b in pairs if a is None or b is None]
    judged = [_judged(a, b, r, (offset, scatter), parameters) for (a, b), r in zip(both, roofs, strict=True)]
    altered = [c for c in judged if c is not None]
    bare = sorted({b.id for (_, b), r in zip(both, roofs, strict=True) if r is None})
    order = list(Kind)
    every = sorted([*found, *altered], key=lambda c: (order.index(c.kind), c.id))
    return Changes(tuple(every), len(both) - len(altered), tuple(bare), offset, scatter)


def _one(before: EpochUnit | None, after: EpochUnit | None) -> Change:
    unit, sign = (after, 1.0) if after is not None else (before, -1.0)
    assert unit is not None
    solid = _solid(unit.building)
    room = None if solid is None else sign * volume(solid)
    return Change(
        Kind.NEW if after else Kind.GONE, before, after, Figures(None, None, room, sign * unit.footprint.area)
    )


def _judged(
    before: EpochUnit, after: EpochUnit, roofs: _Roofs | None, survey: tuple[float, float], p: ChangeParameters
) -> Change | None:
    outline, width = _outline_change(before, after, p)
    raised, height, mean, rms = 0.0, 0.0, None, None
    if roofs is not None and len(roofs.known):
        offset, scatter = survey
        less, sigma = roofs.heights - offset, max(roofs.sigma_m, scatter)
        part = _thick(np.nan_to_num(np.abs(less)) > max(p.sigmas * sigma, p.least_height_m))
        raised = float(part.sum()) * p.cell_m**2
        height = float(np.median(np.abs(less[part]))) / sigma if part.any() else 0.0
        known = less[np.isfinite(less)]
        mean, rms = float(known.mean()), float(np.sqrt(np.mean(known**2)))
    if max(raised, outline) < p.least_area_m2:
        return None
    old, new = _solid(before.building), _solid(after.building)
    ends = [None, None] if old is None or new is None else [b - a for a, b in zip(_ends(old), _ends(new), strict=True)]
    room = None if old is None or new is None else volume(new) - volume(old)
    figures = Figures(
        ends[1], ends[0], room, after.footprint.area - before.footprint.area, mean, rms, raised, outline,
        max(height if raised >= p.least_area_m2 else 0.0, width if outline >= p.least_area_m2 else 0.0),
    )  # fmt: skip
    return Change(Kind.ALTERED, before, after, figures)


def _outline_change(before: EpochUnit, after: EpochUnit, p: ChangeParameters) -> tuple[float, float]:
    """Area in plan that only one has, without rims that are thinner than `sigmas` of both; and its width in standard deviations."""
    sigma = float(np.hypot(before.outline_sigma_m, after.outline_sigma_m))
    rim = p.sigmas * sigma
    less = shapely.symmetric_difference(before.footprint, after.footprint)
    core = shapely.buffer(less, -rim / 2, join_style="mitre")
    if core.is_empty:
        return 0.0, 0.0
    part = shapely.intersection(shapely.buffer(core, rim / 2, join_style="mitre"), less)
    return float(part.area), 2 * float(part.area) / max(float(part.length), 1e-9) / sigma


def _thick(part: BoolArray) -> BoolArray:
    """Without rims of one or two places."""
    return np.asarray(ndimage.binary_opening(part, np.ones((3, 3), bool)))


def _roofs(before: EpochUnit, after: EpochUnit, p: ChangeParameters) -> _Roofs | None:
    """None where one has no model."""
    old, new = _solid(before.building), _solid(after.building)
    if old is None or new is None or before.building is None or after.building is None:
        return None
    common = shapely.intersection(before.footprint, after.footprint)
    grid = Grid.covering(common.bounds, p.cell_m)
    x, y = grid.centres()
    inside = shapely.contains_xy(common, x, y)
    heights = np.full((2, *grid.shape), np.nan)
    for k, solid in enumerate((old, new)):
        heights[k][inside] = roof_heights(solid, np.column_stack([x[inside], y[inside]]))
    blocks = [_is_block(b) for b in (before.building, after.building)]
    # a block has one height for the whole roof: it tells no more than the other's roof spreads
    spread = max((_spread(heights[1 - k]) for k in (0, 1) if blocks[k] and not blocks[1 - k]), default=0.0)
    sigma = float(np.sqrt(_sigma(before.building) ** 2 + _sigma(after.building) ** 2 + spread**2))
    return _Roofs(heights[1] - heights[0], sigma)


def roof_heights(solid: Polyhedron, xy: FloatArray) -> FloatArray:
    """(N,) height of the highest roof at (N, 2) places, world metres; NaN where there is none."""
    found = np.full(len(xy), np.nan)
    for normal, face in zip(face_normals(solid), solid.faces, strict=True):
        if face.semantic is not Semantic.ROOF or abs(normal[2]) < 1e-6:
            continue
        rings = [solid.ring(ring) for ring in face.rings]
        inside = shapely.intersects_xy(Polygon(rings[0][:, :2], [r[:, :2] for r in rings[1:]]), xy[:, 0], xy[:, 1])
        middle = np.concatenate(rings).mean(axis=0)
        z = middle[2] - (xy[inside] - middle[:2]) @ normal[:2] / normal[2]
        found[inside] = np.fmax(found[inside], z)
    return found


def _solid(building: Building | None) -> Polyhedron | None:
    return None if building is None else building.solids.get(Lod.LOD22)


def _ends(solid: Polyhedron) -> tuple[float, float]:
    """Lowest and highest vertex of the roof."""
    z = np.concatenate([solid.ring(ring)[:, 2] for face in solid.of_semantic(Semantic.ROOF) for ring in face.rings])
    return float(z.min()), float(z.max())


def _is_block(building: Building) -> bool:
    return building.attributes.get("lod") == Lod.LOD12.value


def _spread(heights: FloatArray) -> float:
    known = heights[np.isfinite(heights)]
    return float(known.std()) if len(known) else 0.0


def _sigma(building: Building) -> float:
    """Standard deviation of the roof's height as its planes state it, by the points that support them."""
    stated = np.array([(q.sigma_height, max(q.points, 1)) for q in building.planes if np.isfinite(q.sigma_height)])
    if not len(stated):
        return UNSTATED_SIGMA_M
    return float(np.sqrt(np.average(stated[:, 0] ** 2, weights=stated[:, 1])))

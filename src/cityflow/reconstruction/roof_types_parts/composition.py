"""Roofs of several parts: a main skeleton, wings that lean on it, heights fitted together, and what the whole costs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.roof_types import RoofType
from cityflow.reconstruction.roof_types_parts.decomposition import Layout, Wing, ridge_line
from cityflow.reconstruction.roof_types_parts.hypotheses import (
    Hypothesis,
    HypothesisParameters,
    hypotheses,
    wing_hypotheses,
)
from cityflow.reconstruction.roof_types_parts.roof_model import PlacedSkeleton, RoofModel, roof_model
from cityflow.reconstruction.roof_types_parts.shape_fit import CUT, Clues, cell_means, fitted_heights, line_gain
from cityflow.reconstruction.roof_types_parts.skeletons import D0, Quad, Skeleton, plane_groups, shape_heights

NO_REGION = np.empty((0, 3))
RIDGED = (RoofType.GABLE, RoofType.HIP, RoofType.HALF_HIP, RoofType.MANSARD)
MAINS_TRIED, MAINS_WITHIN = 3, 8.0
"""Main skeletons of different types that wings are tried on: so many, as long as they cost so little more than the best."""
STEP_M = 1.0
"""Level roofs that differ by more are stepped."""


@dataclass(frozen=True, slots=True)
class Composition:
    """Placed skeletons, main first, the type of the whole, and its cost over all cells."""

    parts: tuple[PlacedSkeleton, ...]
    type: RoofType
    cost: float


def simple_roofs(found: list[Hypothesis]) -> list[Composition]:
    """Hypotheses over all of the outline."""
    return [Composition((PlacedSkeleton(h.skeleton, NO_REGION),), h.skeleton.type, h.cost) for h in found]


def composed_roofs(clues: Clues, layout: Layout, wanted: str, parameters: HypothesisParameters) -> list[Composition]:
    """The best roofs over one layout, for several types of its main part."""
    main = Polygon(layout.main.ring())
    free = _inside(clues, main) & ~_over_wings(clues, layout)
    own = clues.within(free)
    if len(own.cells) < max(6, 0.3 * len(clues.within(_inside(clues, main)).cells)):
        own = clues.within(_inside(clues, main))
    if len(own.cells) < 3:
        return []
    tried = [h for h in hypotheses(own, layout.main, parameters) if not wanted or h.skeleton.type == wanted]
    return [_composed(clues, layout, h, parameters) for h in _different(tried)]


def _different(tried: list[Hypothesis]) -> list[Hypothesis]:
    """The cheapest of each type and direction."""
    kept: list[Hypothesis] = []
    for h in tried:
        if h.cost > tried[0].cost + MAINS_WITHIN or len(kept) == MAINS_TRIED:
            break
        if all(not _alike(h.skeleton, k.skeleton) for k in kept):
            kept.append(h)
    return kept


def _alike(a: Skeleton, b: Skeleton) -> bool:
    return a.type is b.type and abs(float(a.quad.direction @ b.quad.direction)) > 0.7


def _inside(clues: Clues, polygon: Polygon) -> BoolArray:
    return np.asarray(shapely.contains_xy(polygon, *clues.cells.xy.T))


def _over_wings(clues: Clues, layout: Layout) -> BoolArray:
    """Places of the main part that a wing may cover on its way to the main ridge."""
    over = np.zeros(len(clues.cells.xy), bool)
    for wing in layout.wings:
        d = wing.quad.distances(clues.cells.xy)
        over |= (d[:, 0] > 0) & (d[:, 1] > 0) & (d[:, 3] > 0) & (d[:, 2] > -0.5 * wing.quad.width)
    return over


def _composed(clues: Clues, layout: Layout, main: Hypothesis, parameters: HypothesisParameters) -> Composition:
    parts = [PlacedSkeleton(main.skeleton, _main_region(layout))]
    beside = main.beside
    for number, wing in enumerate(layout.wings):
        placed, more = _placed_wing(clues, wing, parts[wing.parent].skeleton, parameters)
        children = [-w.quad.sides[2] for w in layout.wings if w.parent == number + 1]
        region = np.concatenate([placed.region, *(c[None] for c in children)])
        parts.append(PlacedSkeleton(placed.skeleton, region))
        beside += more
    fitted = _fitted_together(clues, parts)
    heights = height_cost(clues, roof_model(fitted))
    return Composition(tuple(fitted), type_of_whole(fitted), heights + beside - _valley_gain(clues, layout, fitted))


def _main_region(layout: Layout) -> FloatArray:
    return np.array([-w.quad.sides[2] for w in layout.wings if w.parent == 0]).reshape(-1, 3)


def _placed_wing(
    clues: Clues, wing: Wing, parent: Skeleton, parameters: HypothesisParameters
) -> tuple[PlacedSkeleton, float]:
    """The cheapest skeleton of a wing, its region, and what of its cost heights did not cause."""
    own = clues.within(_inside(clues, wing.polygon))
    if len(own.cells) < 2:
        own = clues.touching(_inside(clues, wing.polygon))
    joined = _joined(wing, parent)
    if len(own.cells) == 0:
        flat = replace(parent, type=RoofType.FLAT, quad=wing.quad, eave=parent.eave, rise=0.0)
        return PlacedSkeleton(flat, wing.quad.sides[:3]), 0.0
    best, runs_on = wing_hypotheses(own, joined, wing.quad, parameters)[0]
    left = joined.sides[2] if runs_on else wing.quad.sides[2]
    return PlacedSkeleton(best.skeleton, np.stack([*wing.quad.sides[:2], left])), best.beside


def _joined(wing: Wing, parent: Skeleton) -> Quad:
    """The wing's quad with its left side at the ridge of the part that it leans on, where that runs across."""
    across = abs(float(parent.quad.direction @ wing.quad.sides[2, :2])) < 0.5
    if parent.type not in RIDGED or not across:
        return wing.quad
    line = ridge_line(parent.quad, float(parent.shape[D0]))
    line = line if line[:2] @ wing.quad.sides[2, :2] > 0 else -line
    return Quad(np.stack([*wing.quad.sides[:2], line, wing.quad.sides[3]]))


def _fitted_together(clues: Clues, parts: list[PlacedSkeleton]) -> list[PlacedSkeleton]:
    """Eave and rise of every part from the cells where it is the highest, twice."""
    if len(parts) == 1:
        return parts
    cells = clues.cells
    shapes = [cell_means(shape_heights(p.skeleton, cells.xy), cells.cell, len(cells)) for p in parts]
    for _ in range(2):
        owner = roof_model(parts).owners(cells.xy)
        for k, part in enumerate(parts):
            mine = cell_means((owner == k).astype(np.float64), cells.cell, len(cells)) > 0.999
            if np.count_nonzero(mine) < 4:
                continue
            _, eave, rise = fitted_heights(shapes[k][mine], cells.z[mine], cells.weight[mine], clues.sigma)
            if part.skeleton.rise * rise > 0 or part.skeleton.rise == 0:
                parts[k] = replace(part, skeleton=part.skeleton.with_heights(eave, rise))
    return parts


def height_cost(clues: Clues, model: RoofModel) -> float:
    """What the heights of all cells cost under a model."""
    cells = clues.cells
    off = (cells.z - cell_means(model.heights(cells.xy), cells.cell, len(cells))) / clues.sigma
    return float(np.sum(cells.weight * np.minimum(0.5 * off**2, CUT)))


def _valley_gain(clues: Clues, layout: Layout, parts: list[PlacedSkeleton]) -> float:
    """What lines say of the valleys where wings run into the parts that they lean on."""
    if clues.trust == 0:
        return 0.0
    edges = []
    for wing, placed in zip(layout.wings, parts[1:], strict=True):
        if placed.skeleton.type in RIDGED and parts[wing.parent].skeleton.type in RIDGED:
            edges += valleys(wing, placed.skeleton, parts[wing.parent].skeleton)
    return clues.trust * float(line_gain(np.array(edges), clues.segments)) if edges else 0.0


def valleys(wing: Wing, own: Skeleton, parent: Skeleton) -> list[FloatArray]:
    """(4,) x, y of start (ridge of the wing) and end (eave) of the valleys of a wing."""
    sides = plane_groups(own)[0][0][:2]
    facing = plane_groups(parent)[0][0][:2]
    far = wing.quad.middle
    onto = facing[int(np.argmin(facing @ np.append(far, 1.0)))]
    found = []
    for k in range(2):
        crossing = np.stack([sides[k] - onto, sides[1 - k] - onto])
        valley = sides[k] - onto
        border = wing.quad.sides[2] * np.array([1, 1, -1])
        lateral = wing.quad.sides[k] * np.array([1, 1, -1])
        ends = [_zero_of(crossing), _zero_of(np.stack([valley, border])), _zero_of(np.stack([valley, lateral]))]
        if any(e is None for e in ends):
            continue
        top, at_border, at_side = (np.asarray(e) for e in ends)
        inside = lateral @ np.append(at_border, 1.0) > 0
        found.append(np.concatenate([top, at_border if inside else at_side]))
    return found


def _zero_of(rows: FloatArray) -> FloatArray | None:
    """Where two a·x + b·y + c are zero."""
    if abs(np.linalg.det(rows[:, :2])) < 1e-6:
        return None
    return np.asarray(np.linalg.solve(rows[:, :2], -rows[:, 2]))


def type_of_whole(parts: list[PlacedSkeleton]) -> RoofType:
    """The type that all parts share, stepped where they are level at different heights, else complex."""
    types = {p.skeleton.type for p in parts}
    if types == {RoofType.FLAT}:
        eaves = [p.skeleton.eave for p in parts]
        return RoofType.STEPPED_FLAT if max(eaves) - min(eaves) > STEP_M else RoofType.FLAT
    return parts[0].skeleton.type if len(types) == 1 else RoofType.COMPLEX

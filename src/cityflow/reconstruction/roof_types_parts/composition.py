"""Roofs of several parts: a main skeleton, wings that lean on it, heights fitted together, and what the whole costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.roof_type_names import RoofType
from cityflow.geometry.roof_type import LEVEL_SHARE, MAIN_SHARE, RIVAL_SHARE, STEP_M
from cityflow.reconstruction.roof_types_parts.decomposition import Layout, Wing, ridge_line
from cityflow.reconstruction.roof_types_parts.height_fit import RIDGED, linear_fit
from cityflow.reconstruction.roof_types_parts.hypotheses import hypotheses, wing_hypotheses
from cityflow.reconstruction.roof_types_parts.hypothesis import Hypothesis, HypothesisParameters, minimised
from cityflow.reconstruction.roof_types_parts.roof_model import PlacedSkeleton, RoofModel, roof_model
from cityflow.reconstruction.roof_types_parts.shape_fit import Clues, cell_means, line_gain, misfit
from cityflow.reconstruction.roof_types_parts.skeletons import D0, Quad, Skeleton, plane_groups

NO_REGION = np.empty((0, 3))
MAINS_TRIED, MAINS_WITHIN, WINGS_TRIED = 3, 8.0, 4
"""Main skeletons of different types that wings are tried on: so many, as long as they cost so little more than the best; set by hand."""
LIFT_M, LIFT_GAIN = 0.6, 1.5
"""How far a wing is lifted at most, and what that must gain (log-likelihood); set by hand."""


@dataclass(frozen=True, slots=True)
class Composition:
    """Placed skeletons, main first, the type of the whole, its cost over all cells, the layout of what has wings, and dormers."""

    parts: tuple[PlacedSkeleton, ...]
    type: RoofType
    cost: float
    layout: Layout | None = None
    dormers: tuple[PlacedSkeleton, ...] = ()

    @property
    def standing(self) -> tuple[PlacedSkeleton, ...]:
        """All parts with the dormers."""
        return *self.parts, *self.dormers


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
    """Wings one after the other, each of its cheapest types tried in the whole."""
    areas = [_own_area(layout), *(w.polygon.area for w in layout.wings)]
    parts, beside = [PlacedSkeleton(main.skeleton, _main_region(layout))], main.beside
    for number, wing in enumerate(layout.wings):
        children = [-w.quad.sides[2] for w in layout.wings if w.parent == number + 1]
        found: list[tuple[float, list[PlacedSkeleton], float]] = []
        for placed, more in _placed_wings(clues, wing, parts[wing.parent].skeleton, parameters):
            region = np.concatenate([placed.region, *(c[None] for c in children)])
            found.append(_tried(clues, layout, [*parts, PlacedSkeleton(placed.skeleton, region)], beside + more))
        _, parts, beside = min(found, key=lambda f: f[0])
    fitted = parts
    if layout.wings:
        fitted = _fitted_together(clues, layout, parts)
    cost = height_cost(clues, roof_model(fitted)) + beside - _valley_gain(clues, layout, fitted)
    cost += clues.per_parameter() * len(layout.wings)
    return Composition(tuple(fitted), type_of_whole(fitted, areas), cost, layout)


def _tried(
    clues: Clues, layout: Layout, parts: list[PlacedSkeleton], beside: float
) -> tuple[float, list[PlacedSkeleton], float]:
    """Cost of the parts so far, as they are, with lines along valleys."""
    cost = height_cost(clues, roof_model(parts)) + beside - _valley_gain(clues, layout, parts)
    return cost, parts, beside


def _own_area(layout: Layout) -> float:
    return float(Polygon(layout.main.ring()).area)


def _main_region(layout: Layout) -> FloatArray:
    return np.array([-w.quad.sides[2] for w in layout.wings if w.parent == 0]).reshape(-1, 3)


def _placed_wings(
    clues: Clues, wing: Wing, parent: Skeleton, parameters: HypothesisParameters
) -> list[tuple[PlacedSkeleton, float]]:
    """The cheapest skeletons of a wing in their regions, and what of their costs heights did not cause."""
    own = clues.within(_inside(clues, wing.polygon))
    if len(own.cells) < 2:
        own = clues.touching(_inside(clues, wing.polygon))
    joined = _joined(wing, parent)
    if len(own.cells) == 0:
        flat = replace(parent, type=RoofType.FLAT, quad=wing.quad, rise=0.0)
        return [(PlacedSkeleton(flat, wing.quad.sides[:3]), 0.0)]
    slope = parent.rise / (parent.quad.width / 2) if parent.type in RIDGED else np.nan
    found, seen = list[tuple[PlacedSkeleton, float]](), set[tuple[RoofType, bool]]()
    for h, runs_on in wing_hypotheses(own, joined, wing.quad, slope, parameters):
        if (h.skeleton.type, runs_on) in seen or len(found) == WINGS_TRIED:
            continue
        seen.add((h.skeleton.type, runs_on))
        left = joined.sides[2] if runs_on else wing.quad.sides[2]
        found.append((PlacedSkeleton(h.skeleton, np.stack([*wing.quad.sides[:2], left])), h.beside))
    return found


def _joined(wing: Wing, parent: Skeleton) -> Quad:
    """The wing's quad with its left side at the ridge of the part that it leans on, where that runs across."""
    across = abs(float(parent.quad.direction @ wing.quad.sides[2, :2])) < 0.5
    if parent.type not in RIDGED or not across:
        return wing.quad
    line = ridge_line(parent.quad, float(parent.shape[D0]))
    line = line if line[:2] @ wing.quad.sides[2, :2] > 0 else -line
    return Quad(np.stack([*wing.quad.sides[:2], line, wing.quad.sides[3]]))


def _fitted_together(clues: Clues, layout: Layout, parts: list[PlacedSkeleton]) -> list[PlacedSkeleton]:
    """Eave and rise of every part from the cells where it is the highest; shared by parts where that costs less."""
    if len(parts) == 1:
        return parts
    each = clues.per_parameter()
    best, least = parts, np.inf
    for share_eave, share_slope in ((False, False), (False, True), (True, False), (True, True)):
        fitted, numbers = parts, 0
        for _ in range(2):
            fitted, numbers = linear_fit(clues, fitted, share_eave, share_slope)
        cost = height_cost(clues, roof_model(fitted)) + each * numbers - _valley_gain(clues, layout, fitted)
        if cost < least - 1e-9:
            best, least = fitted, cost
    return best


def lifted(clues: Clues, roof: Composition) -> Composition:
    """Wings raised or lowered to where their valleys were seen, as far as heights allow."""
    layout, parts = roof.layout, list(roof.parts)
    if clues.trust == 0 or layout is None:
        return roof
    for k, wing in enumerate(layout.wings, start=1):
        if not {parts[k].skeleton.type, parts[wing.parent].skeleton.type} <= set(RIDGED):
            continue

        def cost(by: FloatArray, k: int = k, parts: list[PlacedSkeleton] = parts) -> float:
            moved = _raised(parts, k, float(by[0]))
            return height_cost(clues, roof_model(moved)) - _valley_gain(clues, layout, moved)

        limits = np.array([-LIFT_M]), np.array([LIFT_M])
        tries = [minimised(cost, np.array([start]), limits) for start in (-0.5 * LIFT_M, 0.0, 0.5 * LIFT_M)]
        by, least = min(tries, key=lambda t: t[1])
        parts = _raised(parts, k, float(by[0])) if least < cost(np.zeros(1)) - LIFT_GAIN else parts
    return replace(roof, parts=tuple(parts))


def _raised(parts: list[PlacedSkeleton], k: int, by: float) -> list[PlacedSkeleton]:
    own = parts[k].skeleton.with_heights(parts[k].skeleton.eave + by, parts[k].skeleton.rise)
    return [*parts[:k], replace(parts[k], skeleton=own), *parts[k + 1 :]]


def height_cost(clues: Clues, model: RoofModel) -> float:
    """What the heights of all cells cost under a model."""
    cells = clues.cells
    off = (cells.z - cell_means(model.heights(cells.xy), cells.cell, len(cells))) / clues.sigma
    return float(misfit(off, cells.weight))


def _valley_gain(clues: Clues, layout: Layout, parts: list[PlacedSkeleton]) -> float:
    """What lines say of the valleys where wings run into the parts that they lean on."""
    if clues.trust == 0:
        return 0.0
    edges = []
    for wing, placed in zip(layout.wings[: len(parts) - 1], parts[1:], strict=True):
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


def type_of_whole(parts: Sequence[PlacedSkeleton], areas: Sequence[float]) -> RoofType:
    """The type that most of the roof has; small annexes do not change it. Stepped where level parts differ in height."""
    shares: dict[RoofType, float] = {}
    for part, area in zip(parts, areas, strict=True):
        shares[part.skeleton.type] = shares.get(part.skeleton.type, 0.0) + area / sum(areas)
    best = max(shares, key=lambda kind: shares[kind])
    if best is RoofType.FLAT:
        eave = parts[int(np.argmax(areas))].skeleton.eave
        near = sum(
            a
            for p, a in zip(parts, areas, strict=True)
            if p.skeleton.type is best and abs(p.skeleton.eave - eave) <= STEP_M
        )
        flat = RoofType.FLAT if near >= LEVEL_SHARE * sum(areas) else RoofType.STEPPED_FLAT
        return flat if shares[best] >= LEVEL_SHARE else RoofType.COMPLEX
    rivals = sum(share for kind, share in shares.items() if kind not in (best, RoofType.FLAT))
    return best if shares[best] >= MAIN_SHARE and rivals <= RIVAL_SHARE else RoofType.COMPLEX

"""Roofs by their types, from an ortho, a surface model of any resolution and the outline (Hron 2020, section 3).

Straight lines found in the orthos are joined and sorted into ridges, hips, valleys and eaves; the outline is cut into parts; for
each part a skeleton of every type is constructed, fitted to heights and lines, and the cheapest is kept. Then every height is
determined anew from the surface model.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import RoofPlane, Scalar, Status
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.core.roof_types import RoofType
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.extruded import moved
from cityflow.reconstruction.roof_types_parts import heights as heights_of
from cityflow.reconstruction.roof_types_parts import hypotheses as hypotheses_of
from cityflow.reconstruction.roof_types_parts import ortho_shift, roof_lines
from cityflow.reconstruction.roof_types_parts.composition import Composition, composed_roofs, lifted, simple_roofs
from cityflow.reconstruction.roof_types_parts.decomposition import DecompositionParameters, layouts
from cityflow.reconstruction.roof_types_parts.dormers import DormerParameters, with_dormers
from cityflow.reconstruction.roof_types_parts.heights import HeightCells, RoofLevels
from cityflow.reconstruction.roof_types_parts.hypotheses import HypothesisParameters
from cityflow.reconstruction.roof_types_parts.line_categories import (
    Category,
    CategoryParameters,
    SortedLines,
    categorise,
)
from cityflow.reconstruction.roof_types_parts.ortho_shift import ShiftParameters
from cityflow.reconstruction.roof_types_parts.outline_sides import fills, is_round, sides_of, whole_quad
from cityflow.reconstruction.roof_types_parts.regular_outline import REACH_M, RegularParameters, Rim, regular_outline
from cityflow.reconstruction.roof_types_parts.roof_lines import LineParameters, RoofLines
from cityflow.reconstruction.roof_types_parts.roof_model import RoofModel, partition_of, roof_model
from cityflow.reconstruction.roof_types_parts.shape_fit import Clues, noise_of, with_noise_of
from cityflow.reconstruction.solids.assemble import assemble
from cityflow.reconstruction.solids.levels import LevelParameters, block_levels

METHOD = "roof_types"
PART_NUMBERS = 3
"""Eave, rise, and what is free besides in the usual case."""
LADDER = 4
"""So many roofs are tried until one gives a valid solid."""
DORMERS_WITHIN = 6.0
"""Dormers are sought on roofs that cost so little more than the best."""
ROUGH_INSIDE, ROUGH_REST, ROUGH_FILL = 0.7, 0.4, 0.5
"""Where an outline has no other decomposition: share of wings inside it, share that parts leave uncovered, how far it fills its
four sides as a whole."""
Origin = tuple[float, float, float]


class RoofTypesParameters(Parameters):
    """How lines are found and sorted, what roofs may look like, and when a roof is of no known type."""

    lines: LineParameters = LineParameters()
    categories: CategoryParameters = CategoryParameters()
    shift: ShiftParameters = ShiftParameters()
    regular: RegularParameters = RegularParameters()
    parts: DecompositionParameters = DecompositionParameters()
    roofs: HypothesisParameters = HypothesisParameters()
    dormers: DormerParameters = DormerParameters()
    levels: LevelParameters = LevelParameters()
    straighten_m: float = Field(0.3, ge=0, le=5, description="bends of the outline below this (m) make no side")
    margin_m: float = Field(0.5, ge=0, le=5, description="heights nearer to the outline than this (m) are not fitted")
    least_fill: float = Field(
        0.9, gt=0, le=1, description="an outline that fills its four sides so far (share) is one part"
    )
    most_rest: float = Field(0.15, ge=0, lt=1, description="share of an outline that its parts may leave uncovered")
    least_cells: int = Field(4, ge=3, le=1000, description="fewer heights than this tell nothing")
    most_off: float = Field(
        0.4,
        gt=0,
        le=1,
        description="a roof that leaves more of its heights (share) beyond three sigma is of unknown type",
    )


@dataclass(frozen=True, slots=True)
class Reading:
    """What was found before any roof was tried: for pictures and reports, too.

    Attributes
    ----------
    origin : world, of the local frame
    outline : Polygon, local
    fitted : Polygon, local; the outline without the errors of its corners, over which roofs are fitted
    cells, levels, lines : heights and sorted lines, local
    clues : what hypotheses are compared with
    segments : (M, 4) float64, lines as they were detected, before any were joined
    """

    origin: Origin
    outline: Polygon
    fitted: Polygon
    cells: HeightCells
    levels: RoofLevels
    lines: SortedLines
    clues: Clues
    segments: FloatArray = field(default_factory=lambda: np.empty((0, 4)))


def reconstruct(evidence: Evidence, parameters: RoofTypesParameters) -> Candidate:
    """The method. No solid, and why, where there are too few heights or no type fits."""
    reading = read(evidence, parameters)
    if len(reading.cells) < parameters.least_cells:
        return _none(f"{len(reading.cells)} heights inside the outline, {parameters.least_cells} needed")
    roofs = best_roofs(reading, evidence.wanted_type, parameters)
    if not roofs:
        return _none("no roof type fits the outline")
    off = _share_off(reading, roof_model(roofs[0].standing))
    if off > parameters.most_off:
        return _none(
            f"{100 * off:.0f} % of the heights lie beyond three sigma of the best roof ({roofs[0].type}): type unknown"
        )
    return _first_valid(evidence, reading, roofs, parameters)


def _first_valid(
    evidence: Evidence, reading: Reading, roofs: list[Composition], parameters: RoofTypesParameters
) -> Candidate:
    """The best roof; where its solid has faults, the next one, marked."""
    tried = 0
    faults = "none tried"
    while faults and tried < min(len(roofs), LADDER):
        candidate, faults = _candidate(evidence, reading, roofs[tried], parameters)
        if faults and roofs[tried].dormers:
            candidate, faults = _candidate(evidence, reading, replace(roofs[tried], dormers=()), parameters)
        tried += 1
    if faults:
        return _none(f"no valid solid of the best {min(len(roofs), LADDER)} roofs: {faults}")
    margin = roofs[tried].cost - roofs[tried - 1].cost if len(roofs) > tried else 0.0
    notes = {**candidate.notes, "margin": round(float(margin), 3)}
    if tried == 1:
        return replace(candidate, notes=notes)
    return replace(
        candidate, notes=notes, status=Status.DEGRADED, reason=f"{tried - 1} better roofs gave no valid solid"
    )


def _none(reason: str) -> Candidate:
    return Candidate(METHOD, None, status=Status.FAILED, reason=reason, roof_type=RoofType.UNKNOWN.value)


def read(evidence: Evidence, parameters: RoofTypesParameters) -> Reading:
    """Heights and lines of one unit."""
    x0, y0 = (float(np.floor(v)) for v in evidence.outline.bounds[:2])
    origin = (x0, y0, float(np.floor(evidence.ground_height)))
    outline = moved(evidence.outline, -x0, -y0)
    cells = heights_of.height_cells(evidence, outline, origin, parameters.margin_m)
    if len(cells) < parameters.least_cells:
        none = SortedLines(roof_lines.joined([]), np.empty(0, np.int64), np.empty((0, 2)))
        return Reading(
            origin, outline, outline, cells, RoofLevels(0, 0), none, Clues(cells, 1.0, np.empty((0, 4)), 0.0)
        )
    levels = heights_of.roof_levels(evidence, outline, origin, cells)
    lines, detected = find_lines(evidence, origin, outline, levels, parameters)
    fitted = fitted_outline(evidence, origin, outline, lines, parameters)
    if fitted is not outline:
        inside = heights_of.height_cells(evidence, fitted, origin, parameters.margin_m)
        if len(inside) >= parameters.least_cells:
            cells, levels = inside, heights_of.roof_levels(evidence, fitted, origin, inside)
        else:  # of few points, those at the rim may all lie beyond sides that have moved
            fitted = outline
    z = heights_of.height_at(evidence, origin, lines.ends.reshape(-1, 2)).reshape(-1, 2)
    kinds = categorise(lines, z, fitted, levels, parameters.categories)
    inner = kinds.lines.take(kinds.category != Category.EAVE)
    trust = 1.0 if len(lines) else 0.0
    clues = Clues(cells, noise_of(cells), np.ascontiguousarray(inner.ends.reshape(-1, 4)), trust)
    segments = np.ascontiguousarray(detected.ends.reshape(-1, 4))
    return Reading(origin, outline, fitted, cells, levels, kinds, clues, segments)


def fitted_outline(
    evidence: Evidence, origin: Origin, outline: Polygon, lines: RoofLines, parameters: RoofTypesParameters
) -> Polygon:
    """The outline that roofs are fitted over; the given one itself where there is no reason to doubt it."""
    sides = sides_of(outline, parameters.straighten_m)
    around = heights_of.height_cells(evidence, outline.buffer(REACH_M, join_style="mitre"), origin, 0.0)
    return regular_outline(outline, sides, Rim(around, lines), parameters.regular)


def find_lines(
    evidence: Evidence, origin: Origin, outline: Polygon, levels: RoofLevels, parameters: RoofTypesParameters
) -> tuple[RoofLines, RoofLines]:
    """Lines of all epochs in the local frame, joined within their epoch, duplicates of all together left out; and all as detected."""
    own, found, detected = parameters.lines, list[RoofLines](), list[RoofLines]()
    for epoch, picture in enumerate(evidence.pictures):
        raw = roof_lines.picture_lines(picture, epoch, evidence.outline, own)
        lines = roof_lines.merged(raw, own)
        for each, kept in ((raw, detected), (lines, found)):
            local = each.shifted(-np.asarray(origin[:2]))
            kept.append(local if picture.true else _over_walls(evidence, local, origin, outline, levels, parameters))
    if not found and evidence.heights is not None:
        lines = roof_lines.merged(roof_lines.relief_lines(evidence.heights, evidence.outline, own), own)
        found = [lines.shifted(-np.asarray(origin[:2]))]
    return roof_lines.without_duplicates(roof_lines.joined(found), own), roof_lines.joined(detected)


def _over_walls(
    evidence: Evidence,
    lines: RoofLines,
    origin: Origin,
    outline: Polygon,
    levels: RoofLevels,
    parameters: RoofTypesParameters,
) -> RoofLines:
    """Lines of a plain ortho without the displacement of the roof."""
    shift = ortho_shift.rim_shift(lines, sides_of(outline, parameters.straighten_m), parameters.shift)
    ground = evidence.ground_height - origin[2]
    z = heights_of.height_at(evidence, origin, lines.ends.mean(axis=1) - shift)
    z = np.clip(np.nan_to_num(z, nan=levels.bottom), levels.bottom, levels.top)
    return ortho_shift.brought_back(lines, shift, z - ground, levels.bottom - ground)


def best_roofs(reading: Reading, wanted: str, parameters: RoofTypesParameters) -> list[Composition]:
    """The cheapest roofs over all types, layouts and directions, one of each type; of the wanted type where one is wanted."""
    found = _roofs(reading, reading.clues, wanted, parameters)
    if not found and reading.fitted is not reading.outline:
        reading = replace(reading, fitted=reading.outline)
        found = _roofs(reading, reading.clues, wanted, parameters)
    if not found:
        return []
    clues = with_noise_of(reading.clues, roof_model(min(found, key=lambda c: c.cost).parts))
    if not 0.9 * reading.clues.sigma < clues.sigma < 1.1 * reading.clues.sigma:
        found = _roofs(reading, clues, wanted, parameters)
    kept: dict[tuple[str, int], Composition] = {}
    for roof in sorted(found, key=lambda c: c.cost):
        kept.setdefault((roof.type.value, len(roof.parts)), roof)
    best, *others = _with_dormers(reading, clues, list(kept.values()), parameters)
    return [lifted(clues, best), *others]


def _with_dormers(
    reading: Reading, clues: Clues, roofs: list[Composition], parameters: RoofTypesParameters
) -> list[Composition]:
    """The best roofs with their dormers, the cheapest first: what dormers explain must not make another type."""
    done = []
    for roof in roofs:
        if roof.cost <= roofs[0].cost + DORMERS_WITHIN:
            found, gain = with_dormers(clues, roof.parts, reading.segments, reading.fitted, parameters.dormers)
            roof = replace(roof, dormers=found, cost=roof.cost - gain)
        done.append(roof)
    return sorted(done, key=lambda c: c.cost)


def _roofs(reading: Reading, clues: Clues, wanted: str, parameters: RoofTypesParameters) -> list[Composition]:
    sides = sides_of(reading.fitted, parameters.straighten_m)
    roofs = parameters.roofs
    if reading.fitted is not reading.outline:
        roofs = roofs.model_copy(update={"rare_cost": roofs.rare_cost + parameters.regular.doubt_cost})
    quad = whole_quad(reading.fitted, sides)
    if is_round(reading.fitted, sides):
        rounded = hypotheses_of.round_roofs(clues, quad, sides.lines(), roofs)
        return simple_roofs([h for h in rounded if not wanted or h.skeleton.type == wanted])
    found: list[Composition] = []
    if fills(reading.fitted, quad) >= parameters.least_fill:
        tried = hypotheses_of.hypotheses(clues, quad, roofs)
        found = simple_roofs([h for h in tried if not wanted or h.skeleton.type == wanted])
    # Outlines that are drawn very badly have no exact parts; a rough decomposition is better than none.
    rough = parameters.parts.model_copy(update={"inside_wing": ROUGH_INSIDE})
    for parts, most_rest in ((parameters.parts, parameters.most_rest), (rough, max(ROUGH_REST, parameters.most_rest))):
        if len(sides) > 4 or not found:
            found += [
                roof
                for layout in layouts(reading.fitted, sides, parts)
                if layout.rest <= most_rest and (layout.wings or not found)
                for roof in composed_roofs(clues, layout, wanted, roofs)
            ]
        if found:
            break
    if not found and fills(reading.fitted, quad) >= ROUGH_FILL:
        tried = hypotheses_of.hypotheses(clues, quad, roofs)
        found = simple_roofs([h for h in tried if not wanted or h.skeleton.type == wanted])
    return found


def _share_off(reading: Reading, model: RoofModel) -> float:
    z = model.heights(reading.cells.xy)
    mean = np.bincount(reading.cells.cell, weights=z) / np.bincount(reading.cells.cell)
    return float(np.mean(np.abs(mean - reading.cells.z) > 3 * max(reading.clues.sigma, 0.25)))


def _candidate(
    evidence: Evidence, reading: Reading, roof: Composition, parameters: RoofTypesParameters
) -> tuple[Candidate, str]:
    """The solid of a roof, and its first fault."""
    model = roof_model(roof.standing)
    partition = partition_of(model, reading.outline)
    solid = assemble(partition, model.planes, evidence.ground_height, reading.origin, evidence.outline)
    faults = check_polyhedron(solid)
    if faults:
        return _none("faults"), f"{roof.type} {faults[0].code} {faults[0].name}"
    blocks = block_levels(
        partition, model.planes, evidence.ground_height, reading.origin, evidence.outline, parameters.levels
    )
    notes: dict[str, Scalar] = {
        "lines": len(reading.lines.lines),
        "parts": "+".join(p.skeleton.type.value for p in roof.parts),
        "cost": round(roof.cost, 3),
        "dormers": len(roof.dormers),
        "noise": round(reading.clues.sigma, 3),
    }
    planes = _roof_planes(reading, model)
    numbers = PART_NUMBERS * len(roof.standing)
    return Candidate(METHOD, solid, planes, blocks, notes=notes, roof_type=roof.type.value, numbers=numbers), ""


def _roof_planes(reading: Reading, model: RoofModel) -> tuple[RoofPlane, ...]:
    cells, (x0, y0, z0) = reading.cells, reading.origin
    n = np.bincount(cells.cell)
    centre = np.column_stack([np.bincount(cells.cell, weights=v) / n for v in cells.xy.T])
    label = model.labels(centre)
    off = cells.z - np.sum(model.planes[label, :2] * centre, axis=1) - model.planes[label, 2]
    count = np.bincount(label, minlength=len(model.planes))
    rmse = np.sqrt(np.bincount(label, weights=off**2, minlength=len(model.planes)) / np.maximum(count, 1))
    return tuple(
        RoofPlane(float(a), float(b), float(c) + z0, (x0, y0), int(k), float(r))
        for (a, b, c), k, r in zip(model.planes, count, rmse, strict=True)
    )

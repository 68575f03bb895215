"""Roofs by their types, from an ortho, a surface model of any resolution and the outline (Hron 2020, section 3).

Straight lines found in the orthos are joined and sorted into ridges, hips, valleys and eaves; the outline is cut into parts; for
each part a skeleton of every type is constructed, fitted to heights and lines, and the cheapest is kept. Then every height is
determined anew from the surface model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cityflow.core.building import RoofPlane, Scalar, Status
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.core.roof_type_names import RoofType
from cityflow.geometry.validity import check_polyhedron
from cityflow.reconstruction.roof_types_parts import hypotheses as hypotheses_of
from cityflow.reconstruction.roof_types_parts.composition import Composition, composed_roofs, lifted, simple_roofs
from cityflow.reconstruction.roof_types_parts.decomposition import INSIDE_WING, layouts
from cityflow.reconstruction.roof_types_parts.dormers import with_dormers
from cityflow.reconstruction.roof_types_parts.outline_sides import fills, is_round, sides_of, whole_quad
from cityflow.reconstruction.roof_types_parts.regular_outline import DOUBT_COST
from cityflow.reconstruction.roof_types_parts.roof_evidence import (
    LEAST_CELLS,
    LEAST_FILL,
    MOST_OFF,
    MOST_REST,
    STRAIGHTEN_M,
    Reading,
    RoofTypesParameters,
    read,
)
from cityflow.reconstruction.roof_types_parts.roof_model import RoofModel, partition_of, roof_model
from cityflow.reconstruction.roof_types_parts.shape_fit import Clues, with_noise_of
from cityflow.reconstruction.solids.assemble import assemble
from cityflow.reconstruction.solids.levels import block_levels

METHOD = "roof_types"
PART_NUMBERS = 3
"""Eave, rise, and what is free besides in the usual case."""
LADDER = 4
"""So many roofs are tried until one gives a valid solid."""
DORMERS_WITHIN = 6.0
"""Dormers are sought on roofs that cost so little more than the best; set by hand, as are those below."""
ROUGH_INSIDE, ROUGH_REST, ROUGH_FILL = 0.7, 0.4, 0.5
"""Where an outline has no other decomposition: share of wings inside it, share that parts leave uncovered, how far it fills its
four sides as a whole."""


def reconstruct(evidence: Evidence, parameters: RoofTypesParameters) -> Candidate:
    """The method. No solid, and why, where there are too few heights or no type fits."""
    reading = read(evidence, parameters)
    if len(reading.cells) < LEAST_CELLS:
        return _none(f"{len(reading.cells)} heights inside the outline, {LEAST_CELLS} needed")
    roofs = best_roofs(reading, evidence.wanted_type, parameters)
    if not roofs:
        return _none("no roof type fits the outline")
    off = _share_off(reading, roof_model(roofs[0].standing))
    if off > MOST_OFF:
        return _none(
            f"{100 * off:.0f} % of the heights lie beyond three sigma of the best roof ({roofs[0].type}): type unknown"
        )
    return _first_valid(evidence, reading, roofs)


def _first_valid(evidence: Evidence, reading: Reading, roofs: list[Composition]) -> Candidate:
    """The best roof; where its solid has faults, the next one, marked."""
    tried = 0
    faults = "none tried"
    while faults and tried < min(len(roofs), LADDER):
        candidate, faults = _candidate(evidence, reading, roofs[tried])
        if faults and roofs[tried].dormers:
            candidate, faults = _candidate(evidence, reading, replace(roofs[tried], dormers=()))
        tried += 1
    if faults:
        return _none(f"no valid solid of the best {min(len(roofs), LADDER)} roofs: {faults}")
    margin = roofs[tried].cost - roofs[tried - 1].cost if len(roofs) > tried else 0.0
    notes = {**candidate.notes, "margin": round(float(margin), 3)}
    if tried == 1:
        return replace(candidate, notes=notes)
    return replace(
        candidate, notes=notes, status=Status.DEGRADED, reason=f"{tried - 1} roofs that fit better gave no valid solid"
    )


def _none(reason: str) -> Candidate:
    return Candidate(METHOD, None, status=Status.FAILED, reason=reason, roof_type=RoofType.UNKNOWN.value)


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
    sides = sides_of(reading.fitted, STRAIGHTEN_M)
    roofs = parameters.roofs
    if reading.fitted is not reading.outline:
        roofs = roofs.model_copy(update={"rare_cost": roofs.rare_cost + DOUBT_COST})
    quad = whole_quad(reading.fitted, sides)
    if is_round(reading.fitted, sides):
        rounded = hypotheses_of.round_roofs(clues, quad, sides.lines())
        return simple_roofs([h for h in rounded if not wanted or h.skeleton.type == wanted])
    found: list[Composition] = []
    if fills(reading.fitted, quad) >= LEAST_FILL:
        tried = hypotheses_of.hypotheses(clues, quad, roofs)
        found = simple_roofs([h for h in tried if not wanted or h.skeleton.type == wanted])
    # Outlines that are drawn very badly have no exact parts; a rough decomposition is better than none.
    for inside, most_rest in ((INSIDE_WING, MOST_REST), (ROUGH_INSIDE, ROUGH_REST)):
        if len(sides) > 4 or not found:
            found += [
                roof
                for layout in layouts(reading.fitted, sides, parameters.parts, inside)
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


def _candidate(evidence: Evidence, reading: Reading, roof: Composition) -> tuple[Candidate, str]:
    """The solid of a roof, and its first fault."""
    model = roof_model(roof.standing)
    partition = partition_of(model, reading.outline)
    solid = assemble(partition, model.planes, evidence.ground_height, reading.origin, evidence.outline)
    faults = check_polyhedron(solid)
    if faults:
        return _none("faults"), f"{roof.type} {faults[0].code} {faults[0].name}"
    blocks = block_levels(partition, model.planes, evidence.ground_height, reading.origin, evidence.outline)
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

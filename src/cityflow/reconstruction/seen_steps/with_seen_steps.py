"""The model of a unit, its steps where photographs show them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Polyhedron, Scalar
from cityflow.core.colour_image import ColourImage
from cityflow.core.parameters import Parameters
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.edges.edge_line import EdgeLine
from cityflow.edges.edge_places import EdgePlace, place_of_votes, places_across, votes_of
from cityflow.edges.image_window import window_over
from cityflow.reconstruction.seen_steps.edge_lines import RoofStep, roof_steps
from cityflow.reconstruction.seen_steps.moved_steps import StepPlan


class SeenStepParameters(Parameters):
    """When a step of a roof moves to where photographs show it."""

    wanted: bool = Field(True, description="steps of roofs move to where photographs show their edges")
    significance: float = Field(
        2.0,
        ge=0,
        le=10,
        description="a step moves to a place that is more of an edge than any other near it, by so many standard deviations of the images' votes",
    )


@dataclass(frozen=True, slots=True)
class SeenStep:
    """A step and where it is seen: metres in the direction of its normal, and by how many standard deviations it is no other place."""

    step: RoofStep
    by_m: float
    sigmas: float


def with_seen_steps(best: Candidate, evidence: Evidence, parameters: SeenStepParameters) -> Candidate:
    """The candidate, its steps moved as far as photographs show them elsewhere and the solid stays valid."""
    heights, solid = evidence.heights, best.solid
    if not parameters.wanted or solid is None or heights is None or not evidence.photographs:
        return best
    steps = roof_steps(solid, evidence.outline)
    if not steps:
        return best
    seen = seen_steps(steps, evidence.photographs, heights.grid.cell, parameters.significance)
    made, moved = moved_to(solid, evidence.outline, seen)
    notes: dict[str, Scalar] = {"steps": len(steps), "steps_seen": len(seen), "steps_moved": moved}
    return replace(best, solid=made, notes={**best.notes, **notes})


def seen_steps(
    steps: Sequence[RoofStep], images: Sequence[ColourImage], cell: float, significance: float
) -> list[SeenStep]:
    """Those that photographs show, the surest first.

    Parameters
    ----------
    cell : of the matched surface, metres
    """
    if not steps:
        return []
    places = iter(edge_places([e for s in steps for e in s.edges], images, cell))
    found = [_seen(s, [next(places) for _ in s.edges], significance) for s in steps]
    return sorted((s for s in found if s is not None), key=lambda s: -s.sigmas)


def edge_places(edges: Sequence[EdgeLine], images: Sequence[ColourImage], cell: float) -> list[EdgePlace | None]:
    """Where the images show each edge; None where they do not tell. One image is looked at after the other."""
    off = places_across(cell)
    ends = [e.places(np.array([0.0, e.length]), off[[0, -1]]).reshape(-1, 3) for e in edges]
    votes: list[list[FloatArray]] = [[] for _ in edges]
    for image in images:
        window = window_over(image, np.concatenate(ends), cell)
        if window is None:
            continue
        for edge, known in zip(edges, votes, strict=True):
            own = votes_of(edge, window, off, cell)
            if own is not None:
                known.append(own)
    return [place_of_votes(known, cell) for known in votes]


def _seen(step: RoofStep, places: Sequence[EdgePlace | None], significance: float) -> SeenStep | None:
    """By the edges of its walls together; None where none is seen, or they contradict each other."""
    rows = [
        (turned * place.off_m, place.sigma_m, place.sigmas)
        for turned, place in zip(step.turned, places, strict=True)
        if place is not None and place.sigmas >= significance
    ]
    if not rows:
        return None
    off, sigma, sigmas = np.array(rows).T
    by, total = float(np.average(off, weights=sigma**-2)), float((sigma**-2).sum() ** -0.5)
    if len(rows) > 1 and (np.abs(off - by) > significance * np.hypot(sigma, total)).any():
        return None
    return SeenStep(step, by, float(sigmas.max()))


def moved_to(solid: Polyhedron, outline: Polygon, seen: Sequence[SeenStep]) -> tuple[Polyhedron, int]:
    """The solid with as many steps moved as it stays valid with, the first of them first, and their number."""
    if not seen:
        return solid, 0
    plan, kept, made = StepPlan.of(solid, outline), list[tuple[RoofStep, float]](), solid
    for s in seen:
        tried = plan.moved([*kept, (s.step, s.by_m)])
        if tried is not None:
            made, kept = tried, [*kept, (s.step, s.by_m)]
    return made, len(kept)

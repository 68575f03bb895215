"""What is wrong in the models of matched flights, by cause.

    python benchmarks/wrong_roofs.py RUN TRUTH RUN TRUTH …     # TRUTH: what `cityflow synth` made

Models of all units away from the edge of the survey are made again from the outlines and surfaces that the runs have. Places of the true roofs that a
model misses by more than 20 cm are counted under the first cause that fits; per cause: share of the roofs in the mean over units, units that would be right
over 95 % if it alone were gone, and wrong units whose largest cause it is.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree
from shapely import MultiPolygon, Polygon

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.reconstruction import Evidence
from cityflow.errors import RefusedUnit
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.verdicts.judge import judged_model
from cityflow.stages.reconstruct import UnitInputs
from cityflow.stages.reconstruct.evidence import read_evidence
from cityflow.surface.sample import sample
from cityflow.synthetic.roofs import DORMER
from cityflow.synthetic.town_units import Unit
from verdict_cases import GOOD_SHARE, INSIDE_RIM_M, WITHIN_M, height_of
from verdict_flights import tasks_of
from verdicts_run import places_of, units_of

CAUSES = (
    "the outline misses the building", "the outline is beyond the building", "the border takes a neighbour's roof", "no points near",
    "dormer", "within 1 m of a shared wall", "within 0.6 m of a free side", "step within the unit", "the surface is wrong", "the surface is right",
)  # fmt: skip
NEAR_M, SHARED_M, FREE_M, STEP_M, HOLE_M, DORMER_M = 0.75, 1.0, 0.6, 1.3, 0.8, 0.5


class Wrong(NamedTuple):
    """A unit: the share of its roof that is right, and the share of each cause that is wrong."""

    name: str
    right: float
    shares: FloatArray


def wrong_units(run: str, truth: Path) -> Iterator[Wrong]:
    store, tasks = tasks_of(run)
    made: list[tuple[str, Evidence, ModelParameters]] = []
    for task in tasks:
        given, parameters = task.arguments_as(UnitInputs), task.parameters_as(ModelParameters)
        outline = given.outline.read(store)
        try:
            made.append(
                (
                    task.unit,
                    read_evidence(store, given.evidence, outline),
                    parameters.model_copy(update={"with_overhangs": False}),
                )
            )
        except RefusedUnit:
            continue
    units = units_of(truth)
    tree = shapely.STRtree([u.wall_outline for u in units])
    for number, (name, evidence, parameters) in enumerate(made):
        judged = judged_model(evidence, parameters)
        solid = judged.choice.candidate.solid
        if judged.survey_end or solid is None:
            continue
        others = shapely.union_all([e.outline for k, (_, e, _) in enumerate(made) if k != number])
        near, own, places = places_of(evidence.outline, others, units, tree)
        off = distances_to_roof(solid, _on_outline(places, evidence.outline))
        wrong = ~(np.hypot(off, _beyond(places, evidence.outline)) <= WITHIN_M)
        cause = _causes(places, evidence, near, own)
        yield Wrong(name, 1 - float(wrong.mean()), np.bincount(cause[wrong], minlength=len(CAUSES)) / len(places))


def _on_outline(places: FloatArray, outline: Polygon) -> FloatArray:
    """The places; those beside the outline at the nearest place of its rim."""
    lines = shapely.shortest_line(shapely.points(places[:, :2]), shapely.buffer(outline, -INSIDE_RIM_M))
    nearest = shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 1]
    inside = shapely.contains_xy(outline, places[:, 0], places[:, 1])
    return np.column_stack([np.where(inside[:, None], places[:, :2], nearest), places[:, 2]])


def _beyond(places: FloatArray, outline: Polygon) -> FloatArray:
    inside = shapely.contains_xy(outline, places[:, 0], places[:, 1])
    return np.where(inside, 0.0, shapely.distance(shapely.points(places[:, :2]), outline))


def _causes(places: FloatArray, evidence: Evidence, near: list[Unit], own: list[Unit]) -> IntArray:
    """(P,) number of the first cause in `CAUSES` that fits each place."""
    x, y, z = places.T
    points, heights, outline = shapely.points(x, y), evidence.heights, evidence.outline
    if heights is None:
        raise ValueError("matched units have heights")
    walls = shapely.union_all([u.wall_outline for u in own])
    beside = shapely.union_all([*evidence.party, *(u.wall_outline for u in near if not any(u is o for o in own))])
    to_shared = np.nan_to_num(shapely.distance(points, beside), nan=np.inf)
    dormers = shapely.union_all([f.polygon for u in own for f in u.prisms if f.kind == DORMER])
    to_dormer = np.nan_to_num(shapely.distance(points, dormers), nan=np.inf)
    found = evidence.points.xyz
    to_point = cKDTree(found[:, :2]).query(places[:, :2])[0] if len(found) else np.full(len(x), np.inf)
    inside = shapely.contains_xy(outline, x, y)
    fits = (
        ~inside, np.isnan(z), ~shapely.contains_xy(walls, x, y), to_point > HOLE_M,
        (to_dormer <= DORMER_M) & (to_shared > DORMER_M), to_shared <= SHARED_M, shapely.distance(points, outline.boundary) <= FREE_M,
        _beside_step(x, y, z, own, walls), ~(np.abs(sample(heights.grid, heights.dsm, x, y) - z) <= WITHIN_M), np.ones(len(x), bool),
    )  # fmt: skip
    return np.asarray(np.argmax(np.column_stack(fits), axis=1))


def _beside_step(
    x: FloatArray, y: FloatArray, z: FloatArray, own: list[Unit], walls: Polygon | MultiPolygon
) -> BoolArray:
    """(P,) where the true roof of the unit differs by more than `STEP_M` within `NEAR_M`: more than a slope."""
    step = np.zeros(len(x), bool)
    for angle in np.arange(8) * np.pi / 4:
        for away in (NEAR_M / 2, NEAR_M):
            a, b = x + away * np.cos(angle), y + away * np.sin(angle)
            there = np.fmax.reduce([height_of(u, a, b) for u in own]) if own else np.full(len(x), np.nan)
            step |= shapely.contains_xy(walls, a, b) & (np.abs(there - z) > STEP_M)
    return step


def main() -> None:
    rows: list[Wrong] = []
    for run, truth in zip(sys.argv[1::2], sys.argv[2::2], strict=True):
        rows += wrong_units(run, Path(truth))
    right, shares = np.array([r.right for r in rows]), np.array([r.shares for r in rows])
    for row in sorted(rows):
        told = sorted(((s, c) for s, c in zip(row.shares, CAUSES, strict=True) if s >= 0.005), reverse=True)
        print(f"{row.name:32} {100 * row.right:5.1f} %  " + ", ".join(f"{c} {100 * s:.1f}" for s, c in told))
    bad = right < GOOD_SHARE
    print(f"{len(rows)} units, {(~bad).sum()} right over 95 %; wrong in the mean {100 * (1 - right.mean()):.2f} %")
    for k in np.argsort(-shares.sum(axis=0)):
        without, largest = right + shares[:, k] >= GOOD_SHARE, shares.argmax(axis=1) == k
        print(f"{100 * shares[:, k].mean():6.2f} %  {CAUSES[k]:36} {(bad & without).sum():3} {(bad & largest).sum():3}")


if __name__ == "__main__":
    main()

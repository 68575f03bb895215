"""Stage ``reconstruct``: one building, from outline, points and terrain to a hull at every level of detail."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from math import isfinite
from typing import NoReturn

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Outline, Scalar, Status
from cityflow.core.grid import Bounds, Grid
from cityflow.core.points import BUILDING, HIGH_NOISE, HIGH_VEGETATION, LOW_NOISE, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.errors import CityflowError, RefusedUnit
from cityflow.flow.task import Json, Outcome, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.io.cityjson import feature_line
from cityflow.reconstruction.choose import Choice, ReconstructParameters, choose
from cityflow.reconstruction.measures import measure
from cityflow.stages.outline_lines import decode
from cityflow.stages.pieces import read_points, read_surface, read_text
from cityflow.stages.survey import UNREAD, WALL_MARGIN_M, Survey, UnitEntry
from cityflow.surface.sample import sample

STAGE = "reconstruct"
VERSION = 3
HULL = "hull.city.jsonl"
GROUND_SAMPLING_M = 0.5
LOWEST_ROOF_M = 1.5


def task(survey: Survey, unit: UnitEntry) -> Task:
    """One building."""
    pieces, unread = survey.pieces(_grown(unit.bounds)), survey.unread(_grown(unit.bounds))
    under = survey.tiles_under(unit)
    surfaces = {f"surface {t}": survey.digest_of_result("surface", t) for t in under}
    source = survey.source_attributes(_grown(unit.bounds))
    classified = survey.has_building_class
    return Task(
        STAGE, unit.id, "cityflow.stages.reconstruct:run", VERSION,
        parameters=survey.parameters_for(STAGE, unit.id, survey.parameters.reconstruct),
        inputs={
            "outline": unit.digest, **surfaces, **pieces, **{f"unread {f}": "missing" for f in unread},
            "source": digest_of(source), "building class": str(classified),
        },
        arguments={
            "outline": [unit.path, unit.start, unit.length], "pieces": list(pieces), "unread": list(unread),
            "city": list(survey.grid.bounds), "cell_m": survey.cell_m, "zarr": survey.zarr,
            "source": source, "classified": classified,
            "failed_surfaces": [t for t in under if survey.records["surface", t].status is Status.FAILED],
        },
        limits=survey.limits(STAGE),
    )  # fmt: skip


def refused_task(survey: Survey, unit: str, reason: str) -> Task:
    """A record for an outline that cannot be a building."""
    return Task(
        STAGE, unit, "cityflow.stages.reconstruct:refuse", VERSION,
        inputs={"reason": reason}, arguments={"reason": reason}, limits=survey.limits(STAGE),
    )  # fmt: skip


def refuse(_: Workspace, task: Task) -> NoReturn:
    """Say why."""
    raise RefusedUnit(task.arguments["reason"])


def run(workspace: Workspace, task: Task) -> Outcome:
    """The best candidate of the methods that the workflow names, with its measures."""
    parameters = ReconstructParameters.model_validate(task.parameters)
    path, start, length = task.arguments["outline"]
    outline = decode(read_text(workspace.store, path)[start : start + length]).outline
    evidence = gather(workspace, task, outline)
    choice = _admitting(choose(evidence, parameters), task.arguments["unread"])
    measures = measure(choice, evidence)
    result = {**measures, "notes": dict(choice.candidate.notes), "scores": scores_of(choice)}
    if choice.candidate.solid is None or choice.status is Status.FAILED:
        return workspace.outcome(choice.status, choice.reason, result)
    workspace.write(HULL, feature_line(_building(outline, evidence, choice, {**task.arguments["source"], **measures})))
    return workspace.outcome(choice.status, choice.reason, result)


def _admitting(choice: Choice, unread: list[str]) -> Choice:
    """A choice made without the points of a broken file says so."""
    if not unread:
        return choice
    status = Status.DEGRADED if choice.status is Status.DONE else choice.status
    return replace(
        choice, status=status, reason="; ".join(filter(None, [choice.reason, UNREAD.format(", ".join(unread))]))
    )


def _building(outline: Outline, evidence: Evidence, choice: Choice, attributes: Mapping[str, Scalar]) -> Building:
    candidate = choice.candidate
    assert candidate.solid is not None
    lower = {lod: candidate.blocks.get(lod, candidate.solid) for lod in (Lod.LOD12, Lod.LOD13)}
    remark = {"outline_remark": outline.remark} if outline.remark else {}
    return Building(
        outline.id, outline.polygon, evidence.ground_height, {**lower, Lod.LOD22: candidate.solid}, candidate.planes,
        with_source(outline.attributes, {**attributes, **remark}), choice.status, choice.reason,
    )  # fmt: skip


def with_source(source: Mapping[str, Scalar], own: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """All attributes of the source and our own; one of the source's that bears our name becomes ``source_…``.

    >>> with_source({"lod": "3", "street": "Oude Delft"}, {"lod": "2.2"})
    {'source_lod': '3', 'street': 'Oude Delft', 'lod': '2.2'}
    """
    return {**{f"source_{k}" if k in own else k: v for k, v in source.items()}, **own}


def scores_of(choice: Choice) -> list[dict[str, Json]]:
    """Every candidate's score, for `explain`; what is not a number becomes null."""
    return [
        {k: None if isinstance(v, float) and not isfinite(v) else v for k, v in asdict(s).items()}
        for s in choice.scores
    ]


def gather(workspace: Workspace, task: Task, outline: Outline) -> Evidence:
    """Roof points inside the outline, and the floor below it."""
    bounds = _grown(outline.polygon.bounds)
    city = Grid.covering(tuple(task.arguments["city"]), task.arguments["cell_m"])
    grid, layers = read_surface(workspace.store, task.arguments["zarr"], city, bounds)
    points = read_points(workspace.store, task.arguments["pieces"], bounds)
    inside = points.take(shapely.contains_xy(outline.polygon, points.xyz[:, 0], points.xyz[:, 1]))
    ground = sample(grid, layers["dtm"], *_along(outline.polygon))
    if not np.isfinite(ground).any():
        _complain(task, len(inside))
    roof = _roof_points(inside, grid, layers, task.arguments["classified"])
    return Evidence(outline.id, outline.polygon, roof, _floor(ground), outline.aspects, outline.slopes)


def _complain(task: Task, points: int) -> NoReturn:
    """No terrain: the survey's fault where something before this failed, else the outline's."""
    problem = f"no terrain height along the outline ({points} points inside)"
    unread, failed = task.arguments["unread"], task.arguments["failed_surfaces"]
    if failed:
        raise CityflowError(
            f"{problem}: the surface of tile {', '.join(failed)} failed", remedy="rerun --failed mends both"
        )
    if unread:
        raise CityflowError(
            f"{problem}: {UNREAD.format(', '.join(unread))}", remedy="mend the file, then rerun --failed"
        )
    raise RefusedUnit(problem)


def _floor(ground: FloatArray) -> float:
    """Whole centimetres below the lowest height: floors of neighbours are equal, or differ by more than a sliver."""
    return float(np.floor(np.nanmin(ground) * 100)) / 100


def _roof_points(points: PointCloud, grid: Grid, layers: Mapping[str, np.ndarray], classified: bool) -> PointCloud:
    """Points of the building class; where the survey has no such class, high points that are not vegetation."""
    usable = points.take(np.isfinite(points.xyz[:, 2]))
    if classified:
        return usable.of_class(BUILDING)
    x, y, z = usable.xyz.T
    row, col = (np.clip(i, 0, n - 1) for i, n in zip(grid.indices(x, y), grid.shape, strict=True))
    high = z - sample(grid, layers["dtm"], x, y) > LOWEST_ROOF_M
    noise = np.isin(usable.classification, (LOW_NOISE, HIGH_NOISE))
    return usable.take(high & (layers["class"][row, col] != HIGH_VEGETATION) & ~noise)


def _along(polygon: shapely.Polygon) -> tuple[np.ndarray, np.ndarray]:
    xy = shapely.get_coordinates(shapely.segmentize(polygon, GROUND_SAMPLING_M))
    return xy[:, 0], xy[:, 1]


def _grown(bounds: Bounds) -> Bounds:
    x_min, y_min, x_max, y_max = bounds
    return x_min - WALL_MARGIN_M, y_min - WALL_MARGIN_M, x_max + WALL_MARGIN_M, y_max + WALL_MARGIN_M

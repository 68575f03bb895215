"""Stage ``outline``: the units of a ground tile, from given outlines or found in the surface."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from cityflow.core.building import Outline, Status
from cityflow.core.edits import Edits, edits_digest
from cityflow.core.grid import Grid, Tile
from cityflow.flow.stage import Cost, Node, Stage
from cityflow.flow.task import Outcome, Task
from cityflow.flow.workspace import Workspace
from cityflow.handover.outline_lines import decode_all, entries, lines, owned
from cityflow.handover.refused_outlines import REFUSED, encode_refused
from cityflow.handover.wall_points import read_walls
from cityflow.io.rasters.surface_zarr import read_layers
from cityflow.outlines.find import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.given.edited import apply_to_outlines
from cityflow.outlines.under_eaves.facades_inside import SeenHouses
from cityflow.outlines.under_eaves.found_walls import found_walls_in, seen_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.stages.outline import walls as outline_walls
from cityflow.survey.city import INGEST, City
from cityflow.survey.city import OUTLINES as OUTLINES_GIVEN
from cityflow.survey.given_outlines import ACCURACY
from cityflow.survey.parameters import OutlineParameters
from cityflow.survey.source import LIDAR
from cityflow.survey.survey import Survey

NAME = "outline"
VERSION = 8
OUTLINES = "outlines.jsonl"


def task(survey: Survey, name: str) -> Task:
    """The units of one tile."""
    return _given_task(survey, name) if survey.outlines_given else _found_task(survey, name)


def _given_task(survey: Survey, name: str) -> Task:
    mine = survey.given.of(name)
    if not mine or not outline_walls.are_looked_for(survey):
        return Task(
            NAME, name, "cityflow.stages.outline:run_given", VERSION,
            inputs=mine, arguments={"pieces": list(mine)}, limits=survey.limits(NAME),
        )  # fmt: skip
    others = survey.given.beside(name)
    parameters: Any = survey.parameters_for(NAME, name, survey.outline_parameters)
    return Task(
        NAME, name, "cityflow.stages.outline:run_walled", VERSION,
        parameters={"walls_in": parameters["walls_in"], "outline_sigma_m": survey.outline_sigma_m},
        inputs={**mine, **others, **outline_walls.inputs_of(survey, name)},
        arguments={"pieces": list(mine), "others": list(others), **outline_walls.arguments_of(survey, name)},
        limits=survey.limits(NAME),
    )  # fmt: skip


def run_given(workspace: Workspace, task: Task) -> Outcome:
    """An index of the tile's given outlines: they were cleaned and noded with the whole city in view."""
    units = [entry for path in task.arguments["pieces"] for entry in entries(workspace.read(path), path)]
    return workspace.outcome(result={"units": units})


def run_walled(workspace: Workspace, task: Task) -> Outcome:
    """The tile's given outlines, with walls moved in where they are rims of roofs and façades are known inside."""
    own, others = (
        [s for path in task.arguments[k] for s in decode_all(workspace.read(path))] for k in ("pieces", "others")
    )
    moved = outline_walls.moved_in(
        workspace.store,
        task.arguments,
        own,
        others,
        WallsInParameters.model_validate(task.parameters["walls_in"]),
        task.parameters["outline_sigma_m"],
    )
    text = lines(moved)
    workspace.write(OUTLINES, text)
    count = sum(
        a.outline.polygon is not b.outline.polygon and b.outline.roof is not None
        for a, b in zip(own, moved, strict=True)
    )
    return workspace.outcome(result={"units": entries(text, workspace.path(OUTLINES)), "walls_moved_in": count})


def _found_task(survey: Survey, name: str) -> Task:
    parameters: Any = survey.parameters_for(NAME, name, survey.outline_parameters)
    seen = survey.lattice.near(name, survey.parameters.outline.found.halo_m)
    walls = {p: d for t in seen for p, d in survey.results.outputs_of("walls", t).items()} if survey.sees_walls else {}
    blind = {
        f"walls {t}": survey.results.reason_of("walls", t)
        for t in seen
        if survey.sees_walls and survey.results.reason_of("walls", t)
    }
    around = survey.lattice.tiles[name].buffered(survey.parameters.outline.found.halo_m)
    reach = outline_walls.reach_of_found(survey, name)
    points = survey.index.over(reach) if reach else {}
    unread = {f"unread {f}": "missing" for f in survey.unread(reach)} if reach else {}
    edits = edits_digest(survey.edits, around)
    return Task(
        NAME, name, "cityflow.stages.outline:run_found", VERSION,
        parameters={"found": parameters["found"], "walls_in": parameters["walls_in"]},
        inputs={**{t: survey.results.digest_of("surface", t) for t in seen}, **walls, **blind, **points, **unread, **({"edits": edits} if edits else {})},
        arguments={"bounds": list(survey.lattice.tiles[name].bounds), "tile_m": survey.parameters.tiles.tile_m,
                   "city": list(survey.lattice.grid.bounds), "cell_m": survey.lattice.cell_m, "zarr": survey.source.zarr, "tiles": seen,
                   "walls": list(walls), "sees_walls": survey.sees_walls, "blind": blind,
                   "points": list(points), "index_cell_m": survey.parameters.tiles.index_cell_m,
                   "edits": survey.edits.within(around).lines()},
        limits=survey.limits(NAME),
    )  # fmt: skip


def run_found(workspace: Workspace, task: Task) -> Outcome:
    """Outlines of the building regions whose representative point the tile owns."""
    parameters = FindParameters.model_validate(task.parameters["found"])
    x_min, y_min = task.arguments["bounds"][:2]
    size, cell = task.arguments["tile_m"], task.arguments["cell_m"]
    tile = Tile(round(x_min / size), round(y_min / size), size)
    city = Grid.covering(tuple(task.arguments["city"]), cell)
    grid, layers = read_layers(
        workspace.store.zarr_store(task.arguments["zarr"]), city, tile.buffered(parameters.halo_m)
    )
    walls = read_walls(workspace.store, task.arguments["walls"], grid.bounds) if task.arguments["sees_walls"] else None
    region = RegionSurface(
        grid,
        layers["ndsm"],
        layers["class"],
        layers["holes"],
        tile.bounds,
        layers["count"],
        walls,
        layers["dtm"],
        highest=not task.arguments["sees_walls"],
    )
    walls_in = WallsInParameters.model_validate(task.parameters["walls_in"])
    roofs = find_outlines(region, parameters)
    found = found_walls_in(roofs, _seen(workspace, task, roofs, region), walls_in)
    kept, refused = apply_to_outlines(found, Edits.from_lines(task.arguments["edits"]))
    mine = owned(kept, size, task.arguments["tiles"]).get(tile.name, [])
    own = {s.outline.id for s in owned(found, size, task.arguments["tiles"]).get(tile.name, [])}
    text = lines(mine)
    workspace.write(OUTLINES, text)
    refused = [r for r in refused if r.id in own]
    if refused:
        workspace.write(REFUSED, encode_refused((r.id, r.shape) for r in refused))
    without = "; ".join(f"without the {t}: {why}" for t, why in task.arguments["blind"].items())
    return workspace.outcome(
        Status.DEGRADED if without else Status.DONE, without,
        {
            "units": entries(text, workspace.path(OUTLINES)),
            "refused": [[r.id, r.reason] for r in refused],
        },
    )  # fmt: skip


def _seen(workspace: Workspace, task: Task, outlines: Sequence[Outline], surface: RegionSurface) -> SeenHouses | None:
    """What shows walls: façades of images, or a laser's points."""
    a = task.arguments
    if a["sees_walls"]:
        return seen_in(surface)
    assert surface.dtm is not None
    terrain = surface.grid, surface.dtm.astype(np.float64)
    return outline_walls.scanned_houses(workspace.store, a["points"], a["index_cell_m"], outlines, terrain)


def _sources(city: City, name: str) -> Iterable[Node]:
    """Given outlines and what may show their walls, or the surfaces and façades that outlines are found in."""
    survey = city.survey
    if survey.outlines_given:
        return [(INGEST, OUTLINES_GIVEN), *_walls_of_given(survey, name)]
    near = survey.lattice.near(name, survey.parameters.outline.found.halo_m)
    seen = [("walls", t) for t in near] if survey.sees_walls else []
    reach = outline_walls.reach_of_found(survey, name)
    files = survey.lidar.assets_over(reach) if reach else []
    return [*(("surface", t) for t in near), *seen, *((INGEST, f.name) for f in files)]


def _walls_of_given(survey: Survey, name: str) -> list[Node]:
    """Where façades may tell that given outlines are rims of roofs: the points and façades around them."""
    if not outline_walls.are_looked_for(survey):
        return []
    if survey.source.kind == LIDAR:
        around = survey.lattice.tiles[name].buffered(outline_walls.REACH_M)
        return [(INGEST, ACCURACY), *((INGEST, f.name) for f in survey.lidar.assets_over(around))]
    near = survey.lattice.near(name, outline_walls.REACH_M)
    return [*(("surface", t) for t in near), *(("walls", t) for t in near)]


STAGE = Stage(
    name=NAME,
    unit="ground tile",
    text=(
        "given outlines, or nDSM, classes and façades → found ones; a laser's points around them. Walls move in from rims of roofs where façades are "
        "known inside. Outlines of the tile: those whose representative point it holds"
    ),
    needs=(_sources,),
    task=lambda city, name: task(city.survey, name),
    parameters=(OutlineParameters,),
    cost=Cost(0.2, 400.0, 0.2),
)

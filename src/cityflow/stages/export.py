"""Stage ``export``: the buildings of a ground tile, their party walls cut, and the terrain they stand on, in every format."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt

from cityflow.core.building import Building, Lod, RoofPlane, Scalar, Status
from cityflow.core.grid import Bounds, Grid
from cityflow.flow.task import Outcome, Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.geometry.validity import check_polyhedron
from cityflow.io.cityjson import read_feature
from cityflow.io.reference import resolve
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.party_walls import cut_party_walls, wall_areas
from cityflow.stages.formats import WRITERS, CityTile
from cityflow.stages.outline_lines import Standing, decode_all
from cityflow.stages.parameters import ExportParameters
from cityflow.stages.pieces import read_surface
from cityflow.stages.survey import Survey
from cityflow.surface.tin import Tin, terrain_tin

STAGE = "export"
CITY = "city"
VERSION = 1
BLOCK_PERCENTILE = 70.0
MARGIN_CELLS = 4


def task(survey: Survey, name: str, own: Sequence[str], units: Sequence[str]) -> Task:
    """Export the units `own` of a tile; `units` are these and the neighbours that share walls with them."""
    ring = survey.ring(name)
    outlines = {p: d for t in ring for p, d in survey.outline_files(t).items()}
    surfaces = {f"surface {t}": survey.digest_of_result("surface", t) for t in ring}
    return Task(
        STAGE, name, "cityflow.stages.export:run", VERSION,
        parameters=survey.parameters_for(STAGE, name, survey.parameters.export),
        inputs={**{f"hull {u}": survey.digest_of_hull(u) for u in units}, **outlines, **surfaces, "own": ",".join(sorted(own))},
        arguments={
            "own": sorted(own), "hulls": {u: survey.hull(u) for u in sorted(units)}, "outlines": list(outlines),
            "bounds": list(survey.tiles[name].bounds), "city": list(survey.grid.bounds),
            "cell_m": survey.parameters.surface.cell_m, "crs": survey.catalog.reference.code,
            "title": survey.catalog.title, "date": survey.date,
        },
        limits=survey.limits(STAGE),
        in_place=True,
    )  # fmt: skip


def is_made_alike(survey: Survey, record: Record, surface: Record) -> bool:
    """Whether an earlier export has the version and parameters that it would have now, and stands on that surface."""
    parameters = survey.parameters_for(STAGE, record.unit, survey.parameters.export)
    stood_on = record.inputs.get(f"surface {record.unit}")
    return (record.version, dict(record.parameters), stood_on) == (VERSION, parameters, surface.result.get("digest"))


def run(workspace: Workspace, task: Task) -> Outcome:
    """Write the tile in every format that is asked for; the measures of its units are the result."""
    parameters = ExportParameters.model_validate(task.parameters)
    standings = {s.outline.id: s for p in task.arguments["outlines"] for s in decode_all(workspace.read(p))}
    grid, dsm, dtm = _heights(workspace, task)
    buildings = {
        unit: _building(workspace, standings[unit], hull, (grid, dsm, dtm))
        for unit, hull in task.arguments["hulls"].items()
        if unit in standings and hull["status"] != Status.REFUSED
    }
    finished = with_party_walls({u: b for u, b in buildings.items() if b is not None})
    own = tuple(finished[u] for u in task.arguments["own"] if u in finished)
    bare = {u: _fate(task.arguments["hulls"][u]) for u in task.arguments["own"] if u not in finished}
    tile = CityTile(
        task.unit, tuple(task.arguments["bounds"]), own, _terrain(task, standings.values(), grid, dtm, parameters),
        resolve(task.arguments["crs"]), task.arguments["title"], task.arguments["date"],
    )  # fmt: skip
    for form in parameters.formats:
        for path, data in WRITERS[form](tile):
            workspace.publish(path, data)
    return workspace.outcome(
        result={
            "units": {b.id: _measures(b) for b in own}, "bare": bare, "terrain_triangles": len(tile.terrain.triangles)
        }
    )  # fmt: skip


def _fate(hull: Mapping[str, Any]) -> dict[str, str]:
    """What the status map says of a unit that leaves no building, not even a block."""
    return {"status": str(hull["status"]), "reason": str(hull["reason"])}


def _heights(workspace: Workspace, task: Task) -> tuple[Grid, np.ndarray, np.ndarray]:
    """DSM and DTM of the tile, with the margin that lets both tiles beside a border see the same profile."""
    city = Grid.covering(tuple(task.arguments["city"]), task.arguments["cell_m"])
    margin = MARGIN_CELLS * city.cell
    x_min, y_min, x_max, y_max = task.arguments["bounds"]
    grid, layers = read_surface(workspace.store, city, (x_min - margin, y_min - margin, x_max + margin, y_max + margin))
    return grid, layers["dsm"], layers["dtm"]


def _building(
    workspace: Workspace, standing: Standing, hull: Mapping[str, Any], heights: tuple[Grid, np.ndarray, np.ndarray]
) -> Building | None:
    """The reconstructed hull; of a unit without one a block, marked as failed; None where not even a height is known."""
    if hull["path"] is not None:
        return read_feature(workspace.read(hull["path"]))
    return _block(standing, str(hull["reason"]), heights)


def _block(standing: Standing, reason: str, heights: tuple[Grid, np.ndarray, np.ndarray]) -> Building | None:
    grid, dsm, dtm = heights
    outline = standing.outline
    x, y = np.meshgrid(grid.x_centres(), grid.y_centres())
    inside = shapely.contains_xy(outline.polygon, x, y)
    roof, ground = dsm[inside & np.isfinite(dsm)], dtm[inside & np.isfinite(dtm)]
    if not len(roof) or not len(ground):
        return None
    floor, top = round(float(ground.min()), 4), round(float(np.percentile(roof, BLOCK_PERCENTILE)), 4)
    solid = extrude(outline.polygon, floor, max(top, floor + 1.0))
    if check_polyhedron(solid):
        return None
    plane = RoofPlane(
        0.0, 0.0, top, (round(outline.polygon.bounds[0], 4), round(outline.polygon.bounds[1], 4)), len(roof)
    )
    solids = dict.fromkeys((Lod.LOD12, Lod.LOD13, Lod.LOD22), solid)
    marks: dict[str, Scalar] = {"lod": "1.2", "method": "block from the DSM", "is_fallback": True}
    return Building(
        outline.id, outline.polygon, floor, solids, (plane,), {**outline.attributes, **marks}, Status.FAILED, reason
    )


def with_party_walls(buildings: Mapping[str, Building]) -> dict[str, Building]:
    """Buildings whose LoD2.2 walls are cut where they touch a neighbour's, with the areas of both kinds of wall."""
    cut = cut_party_walls({u: b.solids[Lod.LOD22] for u, b in buildings.items()})
    finished = {}
    for unit, building in buildings.items():
        areas = wall_areas(cut[unit])
        solids = {**building.solids, Lod.LOD22: cut[unit]}
        finished[unit] = replace(building, solids=solids).with_attributes(
            {"outer_wall_area_m2": round(areas.outer, 2), "shared_wall_area_m2": round(areas.shared, 2)}
        )
    return finished


def _terrain(
    task: Task, standings: Iterable[Standing], grid: Grid, dtm: np.ndarray, parameters: ExportParameters
) -> Tin:
    bounds: Bounds = tuple(task.arguments["bounds"])
    frame = shapely.box(*bounds)
    outlines = sorted((s.outline for s in standings), key=lambda o: o.id)
    inside = [o.polygon for o in outlines if o.polygon.intersects(frame)]
    return _known_terrain(grid, dtm, lambda whole: terrain_tin(grid, whole, inside, parameters.terrain, bounds))


def _known_terrain(grid: Grid, dtm: np.ndarray, triangulated: Callable[[np.ndarray], Tin]) -> Tin:
    """The terrain where it is known: holes are filled to triangulate, and left out again."""
    unknown = ~np.isfinite(dtm)
    if unknown.all():
        return Tin(np.empty((0, 3)), np.empty((0, 3), np.int64))
    if not unknown.any():
        return triangulated(dtm)
    nearest = distance_transform_edt(unknown, return_distances=False, return_indices=True)
    tin = triangulated(dtm[tuple(nearest)])
    x, y = tin.vertices[tin.triangles].mean(axis=1)[:, :2].T
    row, col = (np.clip(i, 0, n - 1) for i, n in zip(grid.indices(x, y), grid.shape, strict=True))
    triangles = tin.triangles[~unknown[row, col]]
    used, renumbered = np.unique(triangles, return_inverse=True)
    return Tin(tin.vertices[used], renumbered.reshape(-1, 3))


def _measures(building: Building) -> dict[str, Any]:
    """What the report and the status map say of a unit."""
    return {"status": str(building.status), "reason": building.reason, **building.attributes}

"""Stage ``split``: an outline becomes single units (Dahlke 2017)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
import shapely

from cityflow.core.building import Outline, Status
from cityflow.core.edits import Edits, edits_digest
from cityflow.core.grid import Bounds, Grid, bounds_meet, grown
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import FrameRasters, SplitEvidence, Splitting
from cityflow.flow.stage import Cost, Node, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Json, Limits, Outcome, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.handover.outline_lines import decode
from cityflow.handover.pieces import read_points, read_text
from cityflow.handover.split_lines import encode_splitting
from cityflow.io.rasters.surface_zarr import read_layers
from cityflow.splitting.edits import is_locked, with_edits
from cityflow.splitting.split import SplitParameters, split
from cityflow.surface.sample import sample
from cityflow.survey.city import City
from cityflow.survey.source import FRAMES, IMAGES, LIDAR, ZARR
from cityflow.survey.survey import Survey
from cityflow.survey.unit_entry import UnitEntry

NAME = "split"
VERSION = 2
SPLIT = "split.json"
NADIR = LocalFrame("nadir", np.eye(3), np.zeros(3))
AROUND_M = 2.0
GROUND_SAMPLING_M = 1.0
GIVEN = "a unit as it is"
NO_SURFACE = "no surface along the outline"


def task(survey: Survey, outline: UnitEntry) -> Task:
    """One outline."""
    parameters: Any = survey.parameters_for(NAME, outline.id, survey.parameters.split)
    under = survey.lattice.tiles_under(outline)
    frames = frame_units(survey, outline)
    place = shapely.box(*outline.bounds)
    edits = edits_digest(survey.edits, place)
    read = [("surface", t) for t in under]
    if survey.source.kind == IMAGES:
        read += [("ortho", t) for t in under] + [("frame", u) for u in frames]
    pieces = survey.index.over(grown(outline.bounds, AROUND_M)) if survey.source.kind == LIDAR else {}
    return Task(
        NAME, outline.id, "cityflow.stages.split:run", VERSION,
        parameters=parameters["method"],
        inputs={
            "outline": outline.digest, **{f"{stage} {unit}": survey.results.digest_of(stage, unit) for stage, unit in read}, **pieces,
            **({"edits": edits} if edits else {}), **({} if survey.looks_for_borders else {"borders": "drawn ones only"}),
            "frames": digest_of(sorted({survey.images.frame_tile(u).frame.name for u in frames})),
        },
        arguments={
            "outline": [outline.path, outline.start, outline.length], "pieces": list(pieces),
            "product_grid": list(survey.lattice.product_grid.bounds), "product_cell_m": survey.lattice.product_grid.cell,
            "city": list(survey.lattice.grid.bounds), "cell_m": survey.lattice.cell_m, "zarr": survey.source.zarr,
            "pictures": survey.source.kind == IMAGES, "frames": _frames(survey, frames),
            "edits": survey.edits.near(place).lines(), "looks": survey.looks_for_borders,
        },
        limits=survey.limits(NAME),
    )  # fmt: skip


def frame_units(survey: Survey, outline: UnitEntry) -> list[str]:
    """Frame tiles that show something of the tiles under the outline."""
    return survey.images.frame_units_over(survey.lattice.tiles_under(outline)) if survey.source.kind == IMAGES else []


def _frames(survey: Survey, units: list[str]) -> list[Json]:
    """Each frame once, in the order of the survey."""
    images = survey.images
    found = {images.frame_tile(u).frame.name: images.frame_tile(u).frame for u in units}
    return [
        {
            "name": frame.name, "rotation": frame.frame_from_world.tolist(), "origin": frame.origin.tolist(),
            "grid": list(images.frame_grid(frame).bounds), "cell_m": images.frame_cell_m(frame),
        }
        for _, frame in sorted(found.items())
    ]  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Split, and write units, cut lines and directions."""
    path, start, length = task.arguments["outline"]
    outline = decode(read_text(workspace.store, path)[start : start + length]).outline
    parameters = SplitParameters.model_validate(task.parameters)
    edits = Edits.from_lines(task.arguments["edits"])
    found = _found(workspace, task, outline, parameters, edits)
    found = with_edits(found, outline.polygon, edits, parameters.minimum_area_m2)
    workspace.write(SPLIT, encode_splitting(found))
    figures: dict[str, Json] = {name: value for name, value in found.notes if np.isfinite(value)}
    return workspace.outcome(
        Status.DONE, found.reason,
        {"units": len(found.units), "cut_lines": len(found.cut_lines), "rejected": len(found.rejected), **figures},
    )  # fmt: skip


def _found(workspace: Workspace, task: Task, outline: Outline, parameters: SplitParameters, edits: Edits) -> Splitting:
    """What the method finds; nothing is looked for where nobody wants to know."""
    if not task.arguments["looks"] or is_locked(outline.polygon, edits):
        return Splitting((outline.polygon,), reason=GIVEN)
    evidence = gather(workspace.store, task.arguments, outline)
    return Splitting((outline.polygon,), reason=NO_SURFACE) if evidence is None else split(evidence, parameters)


def gather(store: Store, arguments: Mapping[str, Any], outline: Outline) -> SplitEvidence | None:
    """Rasters of every look direction over the outline, and the points where LiDAR has some; None where nothing was surveyed."""
    a = arguments
    bounds = grown(outline.polygon.bounds, AROUND_M)
    grid, layers = read_layers(
        store.zarr_store(a["zarr"]), Grid.covering(tuple(a["city"]), a["cell_m"]), bounds, ("dsm", "dtm")
    )
    xy = shapely.get_coordinates(shapely.segmentize(outline.polygon, GROUND_SAMPLING_M))
    ground = sample(grid, layers["dtm"], xy[:, 0], xy[:, 1])
    if not np.isfinite(ground).any():
        return None
    low = float(np.nanmin(ground))
    high = float(np.nanmax(layers["dsm"], initial=low))
    frames = [_nadir(store, a, bounds), *_oblique(store, a, outline, (low - 1.0, high + 1.0))]
    points = read_points(store, a["pieces"], bounds) if a["pieces"] else None
    return SplitEvidence(outline.id, outline.polygon, tuple(frames), low, points, outline.inner_edges)


def _nadir(store: Store, a: Mapping[str, Any], bounds: Bounds) -> FrameRasters:
    names = ("dsm", "ortho", "ortho_seen") if a["pictures"] else ("dsm",)
    grid, layers = read_layers(
        store.zarr_store(ZARR), Grid.covering(tuple(a["product_grid"]), a["product_cell_m"]), bounds, names
    )
    return FrameRasters(NADIR, grid, layers["dsm"], layers.get("ortho"), layers.get("ortho_seen"))


def _oblique(
    store: Store, a: Mapping[str, Any], outline: Outline, heights: tuple[float, float]
) -> Iterator[FrameRasters]:
    """The part of each frame that shows what stands on the outline."""
    xy = shapely.get_coordinates(outline.polygon)
    corners = np.concatenate([np.column_stack([xy, np.full(len(xy), z)]) for z in heights])
    for tree in a["frames"]:
        frame = LocalFrame(tree["name"], np.array(tree["rotation"]), np.array(tree["origin"]))
        seen = frame.from_world(corners)[:, :2]
        bounds = grown((*seen.min(axis=0).tolist(), *seen.max(axis=0).tolist()), AROUND_M)
        if not bounds_meet(tuple(tree["grid"]), bounds):
            continue
        whole = Grid.covering(tuple(tree["grid"]), tree["cell_m"])
        grid, layers = read_layers(
            store.zarr_store(f"{FRAMES}/{frame.name}"), whole, bounds, ("dsm", "ortho", "ortho_seen")
        )
        if np.isfinite(layers["dsm"]).any():
            yield FrameRasters(frame, grid, layers["dsm"], layers["ortho"], layers["ortho_seen"])


def _rasters(city: City, name: str) -> Iterable[Node]:
    """Surfaces, orthos and frames that show the outline."""
    survey, outline = city.survey, city.outlines[name]
    under = survey.lattice.tiles_under(outline)
    pictures = [("ortho", t) for t in under] if survey.source.kind == IMAGES else []
    return [*(("surface", t) for t in under), *pictures, *(("frame", u) for u in frame_units(survey, outline))]


def _count(city: City) -> int | None:
    if not city.survey.splits:
        return 0
    known = all(t in city.outlines_of for t in city.tiles)
    return sum(len(city.outlines_of[t]) for t in city.tiles) if known else None


STAGE = Stage(
    name=NAME,
    unit="outline",
    text="outline, orthos and surfaces of every look direction (or LiDAR) → cut lines, single units, principal directions",
    needs=(_rasters,),
    task=lambda city, name: task(city.survey, city.outlines[name]),
    count=_count,
    parameters=(SplitParameters,),
    cost=Cost(0.5, 600.0, 0.01),
    limits=Limits(300, 6000),
)

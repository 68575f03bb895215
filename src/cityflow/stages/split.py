"""Stage ``split``: an outline becomes single units (Dahlke 2017)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import shapely

from cityflow.core.building import Outline, Status
from cityflow.core.colour_image import ColourImage
from cityflow.core.edits import edits_digest
from cityflow.core.grid import Bounds, Grid, bounds_meet, grown
from cityflow.core.local_frame import LocalFrame
from cityflow.core.splitting import CUT, FrameRasters, SplitEvidence, Splitting
from cityflow.flow.json_writers import SHARED
from cityflow.flow.stage import Cost, Node, Nodes, Place, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Json, Limits, Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.cached_reads import read_points
from cityflow.handover.field_types import EditsField, FrameField
from cityflow.handover.outline_lines import OutlineAt
from cityflow.handover.photograph_inputs import PhotographInputs, opened
from cityflow.handover.split_lines import encode_splitting
from cityflow.handover.surface_windows import read_windows
from cityflow.handover.surfaces import Surfaces
from cityflow.splitting.cuts.edited_cuts import is_locked, with_edits
from cityflow.splitting.cuts.moved_cuts import with_moved_cuts
from cityflow.splitting.cuts.seen_borders import border_shifts
from cityflow.splitting.split import SplitParameters, split
from cityflow.surface.sample import sample
from cityflow.survey.city import City
from cityflow.survey.kept_by_survey import kept_by_survey, kept_until
from cityflow.survey.surface_source import FRAMES, IMAGES, LIDAR, ZARR
from cityflow.survey.survey import Survey
from cityflow.survey.unit_entry import UnitEntry
from cityflow.survey.unit_images import images_of_outlines
from cityflow.survey.unit_photographs import Photographs, needed, photographs_of

NAME = "split"
VERSION = 13
SPLIT = "split.json"
NADIR = LocalFrame("nadir", np.eye(3), np.zeros(3))
AROUND_M = 2.0
"""What is read around an outline, m; set by hand."""
GROUND_SAMPLING_M = 1.0
"""Spacing of the places along an outline whose terrain is the ground."""
GIVEN = "a single unit already"
NO_SURFACE = "no surface along the outline"


@dataclass(frozen=True, slots=True)
class FrameRaster(TaskInputs):
    """A local reference frame, and the grid of all its rasters."""

    frame: FrameField
    grid: Grid


@dataclass(frozen=True, slots=True)
class SplitInputs(TaskInputs):
    """An outline and what shows it.

    Attributes
    ----------
    pieces : RUN-relative paths of index pieces, of a laser
    pictures : whether the run has true orthos
    frames : local reference frames that may show it, by name
    edits : those that act here
    looks : whether borders are looked for, and not only taken from the edits
    photographs : that show the outline, of a matched surface
    """

    outline: OutlineAt
    surfaces: Annotated[Surfaces, SHARED]
    pieces: tuple[str, ...]
    pictures: bool
    frames: Annotated[tuple[FrameRaster, ...], SHARED]
    edits: EditsField
    looks: bool
    photographs: PhotographInputs | None = None


def task(survey: Survey, outline: UnitEntry, photographs: Photographs) -> Task:
    """One outline."""
    parameters = survey.parameters_of(NAME, outline.id, survey.parameters.split).method
    under = survey.lattice.tiles_under(outline)
    shown = _shown(survey, under)
    drawn = survey.edits.of_splits
    edits = edits_digest(drawn, outline.bounds)
    pieces = survey.index.over(grown(outline.bounds, AROUND_M)) if survey.source.kind == LIDAR else {}
    return KIND.task(
        outline.id, parameters=as_json(parameters),
        inputs={
            "outline": outline.digest, **_digests(survey, under), **pieces,
            **({"edits": edits} if edits else {}), **({} if survey.looks_for_borders else {"borders": "drawn ones only"}),
            "frames": shown.digest, **photographs.inputs,
        },
        given=SplitInputs(
            outline.at, survey.surfaces, tuple(pieces), survey.source.kind == IMAGES, shown.frames, drawn.within(outline.bounds),
            survey.looks_for_borders, photographs.given,
        ),
        limits=survey.limits(NAME), shared=photographs.shared,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Shown:
    """What shows the outlines over the same tiles.

    Attributes
    ----------
    nodes : surfaces, orthos and tiles of local frames;  named : the same, each with its name in the inputs
    frames : each local frame once, by name;  digest : of their names
    """

    nodes: Nodes
    named: tuple[tuple[str, Node], ...]
    frames: tuple[FrameRaster, ...]
    digest: str


@kept_by_survey
def _shown(survey: Survey, under: tuple[str, ...]) -> _Shown:
    nodes, frames = Nodes(("surface", under)), dict[str, FrameRaster]()
    if survey.source.kind == IMAGES:
        tilted = survey.images.tilted
        units = tilted.units_over(under)
        nodes = Nodes(("surface", under), ("ortho", under), ("frame", units))
        found = {frame.name: frame for frame in (tilted.tiles[u].frame for u in units)}
        frames = {name: FrameRaster(found[name], tilted.grid(found[name])) for name in sorted(found)}
    named = tuple((f"{stage} {unit}", (stage, unit)) for stage, unit in nodes)
    return _Shown(nodes, named, tuple(frames.values()), digest_of(list(frames)))


@kept_until("surface", "ortho", "frame")
def _digests(survey: Survey, under: tuple[str, ...]) -> dict[str, str]:
    """Name → digest of what shows an outline: the same for most outlines of a tile, which become ready together."""
    return {name: survey.results.digest_of(*node) for name, node in _shown(survey, under).named}


def run(workspace: Workspace, task: Task) -> Outcome:
    """Split, and write units, cut lines and directions."""
    given, parameters = task.arguments_as(SplitInputs), task.parameters_as(SplitParameters)
    outline = given.outline.read(workspace.store)
    found = _found(workspace.store, given, outline, parameters)
    least_m2 = parameters.where(given.pictures).minimum_area_m2
    found = with_edits(found, outline.polygon, given.edits, least_m2)
    workspace.write(SPLIT, encode_splitting(found))
    figures: dict[str, Json] = {name: value for name, value in found.notes if np.isfinite(value)}
    return workspace.outcome(
        Status.DONE, found.reason,
        {"units": len(found.units), "cut_lines": len(found.cut_lines), "rejected": len(found.rejected), **figures},
    )  # fmt: skip


def _found(store: Store, given: SplitInputs, outline: Outline, parameters: SplitParameters) -> Splitting:
    """What the method finds; nothing is looked for if not requested."""
    if not given.looks or is_locked(outline.polygon, given.edits):
        return Splitting((outline.polygon,), reason=GIVEN)
    evidence = read_evidence(store, given, outline)
    if evidence is None:
        return Splitting((outline.polygon,), reason=NO_SURFACE)
    found = split(evidence, parameters)
    return _where_seen(found, evidence, opened(store, given.photographs), parameters) if len(found.units) > 1 else found


def _where_seen(
    found: Splitting, evidence: SplitEvidence, images: Sequence[ColourImage], parameters: SplitParameters
) -> Splitting:
    """Borders where photographs show the edge of the higher roof, or the change of colour from one roof to the other."""
    if not images:
        return found
    nadir, cuts = evidence.frames[0], [c.line for c in found.cut_lines if c.kind == CUT]
    shifts = border_shifts(cuts, nadir.grid, nadir.dsm, images)
    return with_moved_cuts(found, evidence.outline, shifts, parameters.where(True).minimum_area_m2)


def read_evidence(store: Store, given: SplitInputs, outline: Outline) -> SplitEvidence | None:
    """Rasters of every look direction over the outline, and the points where LiDAR has some; None where nothing was surveyed."""
    bounds, surfaces = grown(outline.polygon.bounds, AROUND_M), given.surfaces
    grid, layers = read_windows(store, surfaces.group, surfaces.working, bounds, ("dsm", "dtm"))
    xy = shapely.get_coordinates(shapely.segmentize(outline.polygon, GROUND_SAMPLING_M))
    ground = sample(grid, layers["dtm"], xy[:, 0], xy[:, 1])
    if not np.isfinite(ground).any():
        return None
    low = float(np.nanmin(ground))
    high = float(np.nanmax(layers["dsm"], initial=low))
    frames = [_nadir(store, given, bounds), *_oblique(store, given.frames, outline, (low - 1.0, high + 1.0))]
    points = read_points(store, given.pieces, bounds) if given.pieces else None
    return SplitEvidence(outline.id, outline.polygon, tuple(frames), low, points, outline.inner_edges)


def _nadir(store: Store, given: SplitInputs, bounds: Bounds) -> FrameRasters:
    names = ("dsm", "ortho", "ortho_seen") if given.pictures else ("dsm",)
    grid, layers = read_windows(store, ZARR, given.surfaces.fine, bounds, names)
    return FrameRasters(NADIR, grid, layers["dsm"], layers.get("ortho"), layers.get("ortho_seen"))


def _oblique(
    store: Store, frames: Iterable[FrameRaster], outline: Outline, heights: tuple[float, float]
) -> Iterator[FrameRasters]:
    """The part of each local frame that shows what stands on the outline."""
    xy = shapely.get_coordinates(outline.polygon)
    corners = np.concatenate([np.column_stack([xy, np.full(len(xy), z)]) for z in heights])
    for raster in frames:
        frame = raster.frame
        seen = frame.from_world(corners)[:, :2]
        bounds = grown((*seen.min(axis=0).tolist(), *seen.max(axis=0).tolist()), AROUND_M)
        if not bounds_meet(raster.grid.bounds, bounds):
            continue
        grid, layers = read_windows(
            store, f"{FRAMES}/{frame.name}", raster.grid, bounds, ("dsm", "ortho", "ortho_seen")
        )
        if np.isfinite(layers["dsm"]).any():
            yield FrameRasters(frame, grid, layers["dsm"], layers["ortho"], layers["ortho_seen"])


def _rasters(city: City, name: str) -> Iterable[Node]:
    """Surfaces, orthos and local frames that show the outline."""
    return _shown(city.survey, city.survey.lattice.tiles_under(city.outlines[name])).nodes


def _photographs(city: City, name: str) -> Iterable[Node]:
    """Images that show the outlines of its tile."""
    return needed(city, city.outlines[name], images_of_outlines)


def _count(city: City) -> int | None:
    if not city.survey.splits:
        return 0
    known = all(t in city.count_outlines for t in city.tiles)
    return sum(city.count_outlines[t] for t in city.tiles) if known else None


KIND = TaskKind(NAME, VERSION, run, SplitInputs)

STAGE = Stage(
    name=NAME,
    unit="outline",
    place=Place.OUTLINE,
    text="outline, images, orthos and surfaces of every look direction (or LiDAR) → cut lines, single units, principal directions",
    kinds=(KIND,),
    needs=(_rasters, _photographs),
    task=lambda city, name: task(
        city.survey, city.outlines[name], photographs_of(city, city.outlines[name], images_of_outlines)
    ),
    asked=lambda city, _: city.survey.splits,
    count=_count,
    parameters=(SplitParameters,),
    cost=Cost(0.5, 600.0, 0.01),
    limits=Limits(300, 6000),
)

"""Stage ``ingest``: each LiDAR file streamed once into an index of small pieces; given outlines cleaned, noded and dealt out to tiles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from cityflow.core.grid import Bounds
from cityflow.flow.stage import START, Cost, Node, Stage
from cityflow.flow.task import Json, Limits, Outcome, Task, digest_of
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import EditsField
from cityflow.handover.outline_lines import Standing, lines, owned
from cityflow.handover.refused_outlines import REFUSED, encode_refused
from cityflow.handover.source_file import SourceFile
from cityflow.io.crs import resolve
from cityflow.io.fetch import local_file
from cityflow.io.points.point_index import split_file
from cityflow.io.tables.vector import read_outlines
from cityflow.outlines.given.edited import apply_to_outlines
from cityflow.outlines.given.given import Refusal, clean_outlines
from cityflow.outlines.noded.noding import node_outlines, vanished
from cityflow.stages.ingest import camera_corrections as calibration
from cityflow.stages.ingest import images as ingest_image
from cityflow.stages.ingest import outline_accuracy
from cityflow.stages.ingest.outline_sample import SAMPLE, sampled
from cityflow.survey.city import INGEST, OUTLINES, City
from cityflow.survey.given_outlines import ACCURACY
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import TileParameters

NAME = INGEST
VERSION = 1
OUTLINES_VERSION = 2
OUTSIDE = "stands outside the survey: nothing was measured there"


@dataclass(frozen=True, slots=True)
class IndexParameters(TaskInputs):
    """Edge of a cell of the index, metres."""

    index_cell_m: float


@dataclass(frozen=True, slots=True)
class OutlinesInputs(TaskInputs):
    """The file of given outlines, the names of all tiles of the survey, and what a person has drawn."""

    file: SourceFile
    tiles: tuple[str, ...]
    edits: EditsField


@dataclass(frozen=True, slots=True)
class OutlinesParameters(TaskInputs):
    """How given outlines are read, noded and dealt out.

    Attributes
    ----------
    tile_m : edge of a ground tile;  noding_tolerance_m : gaps and overlaps below this are closed, metres
    id_column, id_format, layer : as in `OutlineAsset`
    crs : code of the survey's CRS
    files : LiDAR file → its bounds, metres
    """

    tile_m: float
    noding_tolerance_m: float
    id_column: str | None
    id_format: str | None
    layer: str | None
    crs: str
    files: Mapping[str, Bounds]


def points_task(survey: Survey, name: str) -> Task:
    """Index one LiDAR file."""
    asset = survey.lidar.files[name]
    return Task(
        NAME, name, "cityflow.stages.ingest:run_points", VERSION,
        parameters=as_json(IndexParameters(survey.parameters.tiles.index_cell_m)),
        inputs={"file": asset.checksum},
        arguments=as_json(SourceFile(asset.href, asset.size, asset.checksum)),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run_points(workspace: Workspace, task: Task) -> Outcome:
    """One LAZ piece per index cell that the file touches."""
    given, parameters = task.arguments_as(SourceFile), task.parameters_as(IndexParameters)
    with local_file(given.href) as path:
        index = split_file(path, parameters.index_cell_m, lambda cell, data: workspace.write(f"{cell}.laz", data))
        given.refuse_other(path)
    return workspace.outcome(
        result={
            "points": index.points,
            "dropped": index.dropped,
            "classes": {str(k): v for k, v in index.classes.items()},
        }
    )


def outlines_task(survey: Survey) -> Task:
    """Clean, node and deal out the given outlines of the whole city: duplicates and shared walls know no tiles."""
    asset = survey.catalog.outlines
    assert asset is not None
    return Task(
        NAME, OUTLINES, "cityflow.stages.ingest:run_outlines", OUTLINES_VERSION,
        parameters=as_json(OutlinesParameters(
            survey.parameters.tiles.tile_m, survey.parameters.outline.noding_tolerance_m, asset.id_column, asset.id_format, asset.layer,
            survey.catalog.reference.code, {f.name: f.bounds for f in survey.lidar.files.values()},
        )),
        inputs={
            "file": asset.checksum, "tiles": digest_of(list(survey.lattice.tiles)),
            **({"edits": digest_of(survey.edits.lines())} if len(survey.edits) else {}),
        },
        arguments=as_json(OutlinesInputs(
            SourceFile(asset.href, asset.size, asset.checksum), tuple(survey.lattice.tiles), survey.edits
        )),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run_outlines(workspace: Workspace, task: Task) -> Outcome:
    """One file of outline lines per tile, and those refused with their reasons and places."""
    given, p = task.arguments_as(OutlinesInputs), task.parameters_as(OutlinesParameters)
    with local_file(given.file.href) as path:
        given.file.refuse_other(path)
        raw, notes = read_outlines(path, p.id_column, p.id_format, resolve(p.crs), p.layer)
    clean, refused = clean_outlines(raw)
    clean, rejected = apply_to_outlines(clean, given.edits)
    noded = node_outlines(clean, p.noding_tolerance_m)
    known = set(given.tiles)
    by_tile = owned(noded, p.tile_m, known)
    for tile in sorted(known & by_tile.keys()):
        workspace.write(f"{tile}.jsonl", lines(by_tile[tile]))
    sampled_from, sample = sampled([s for t in sorted(known & by_tile.keys()) for s in by_tile[t]], p.files)
    if sample:
        workspace.write(SAMPLE, sample)
    far = [s.outline for tile in sorted(by_tile.keys() - known) for s in by_tile[tile]]
    outside = [Refusal(o.id, OUTSIDE, o.polygon) for o in far]
    named = _unique_names(
        [*refused, *rejected, *vanished(clean, noded), *outside], {o.id for o in noded} - {r.id for r in outside}
    )
    if named:
        workspace.write(REFUSED, encode_refused((r.id, r.shape) for r in named))
    return workspace.outcome(
        reason="; ".join(notes),
        result={
            "refused": [[r.id, r.reason] for r in named],
            "notes": notes,
            "outlines": len(raw),
            "beside": _beside(by_tile, known),
            "sampled_from": sampled_from,
        },
    )


def _beside(by_tile: Mapping[str, Sequence[Standing]], known: set[str]) -> dict[str, Json]:
    """Tiles whose outlines touch ones of a tile, where there are any."""
    near = {t: sorted({n for s in by_tile[t] for n in s.neighbour_tiles} - {t}) for t in sorted(known & by_tile.keys())}
    return {t: list(others) for t, others in near.items() if others}


def _unique_names(refusals: list[Refusal], taken: set[str]) -> list[Refusal]:
    """Refused outlines under names of their own: a duplicate must not hide the unit whose id it bears."""
    named = []
    for refusal in refusals:
        name, n = refusal.id, 1
        while name in taken:
            n += 1
            name = f"{refusal.id}~{n}"
        taken.add(name)
        named.append(replace(refusal, id=name))
    return named


def _starts(city: City, ended: Node) -> Iterable[str]:
    return [OUTLINES] if ended == START and city.survey.outlines_given else []


def _known_before(city: City, name: str) -> Iterable[Node]:
    """Raw frames wait for the calibration of their camera; how exact outlines are is asked when they are known."""
    if name == ACCURACY:
        return [(NAME, OUTLINES)]
    camera = calibration.unit_of(city.survey, name) if name in city.survey.images.assets else None
    return [(NAME, camera)] if camera else []


def _sampled_file(city: City, name: str) -> Iterable[Node]:
    """The one LiDAR file that tells how exact outlines are: they have named it."""
    file = city.survey.given.sample[0] if name == ACCURACY else ""
    return [(NAME, file)] if file else []


def _task(city: City, name: str) -> Task:
    survey = city.survey
    if name == OUTLINES:
        return outlines_task(survey)
    if name == ACCURACY:
        return outline_accuracy.task(survey)
    if name in survey.images.assets:
        return ingest_image.image_task(survey, name)
    return calibration.task(survey, name) if name.startswith(calibration.UNIT) else points_task(survey, name)


STAGE = Stage(
    name=NAME,
    unit="LiDAR file; image; camera with calibration frames; the outlines' file",
    text=(
        "points, streamed once → one LAZ piece per index cell that the file touches. Images, decoded once, raw frames corrected → tiled TIFF with a "
        "pyramid. Outlines → cleaned and noded with the whole city in view (duplicates and shared walls know no tiles), dealt out to tiles; how exact "
        "they are, by the façades in one LiDAR file"
    ),
    needs=(_known_before, _sampled_file),
    task=_task,
    starts=_starts,
    parameters=(TileParameters,),
    cost=Cost(1.0, 400.0, 4.0),
    limits=Limits(7200, 6000),
)

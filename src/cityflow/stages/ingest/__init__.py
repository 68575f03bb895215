"""Stage ``ingest``: each LiDAR file streamed once into an index of small pieces; given outlines cleaned, dealt out to tiles and noded there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from cityflow.flow.stage import START, Cost, Node, Place, Stage
from cityflow.flow.task import Limits, Outcome, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.source_file import SourceFile
from cityflow.io.fetch import local_file
from cityflow.io.points.point_index import split_file
from cityflow.stages.ingest import camera_corrections as calibration
from cityflow.stages.ingest import images as ingest_image
from cityflow.stages.ingest import outline_accuracy, outlines_dealt, outlines_noded
from cityflow.survey.city import INGEST, OUTLINES, City
from cityflow.survey.given_outlines import ACCURACY, noded_tile
from cityflow.survey.survey import Survey
from cityflow.survey.survey_parameters import TileParameters

NAME = INGEST
VERSION = 1


@dataclass(frozen=True, slots=True)
class IndexParameters(TaskInputs):
    """Edge of a cell of the index, metres."""

    index_cell_m: float


def points_task(survey: Survey, name: str) -> Task:
    """Index one LiDAR file."""
    asset = survey.lidar.files[name]
    return KIND.task(
        name, parameters=as_json(IndexParameters(survey.parameters.tiles.index_cell_m)),
        inputs={"file": asset.checksum},
        given=SourceFile(asset.href, asset.size, asset.checksum),
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


def _begins(city: City, turn: Node) -> Iterable[str]:
    return [OUTLINES] if turn == START and city.survey.outlines_given else []


def _known_before(city: City, name: str) -> Iterable[Node]:
    """Raw frames wait for the calibration of their camera; how exact outlines are is asked when they are known."""
    if name == ACCURACY or noded_tile(name) is not None:
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
        return outlines_dealt.task(survey)
    if (tile := noded_tile(name)) is not None:
        return outlines_noded.task(survey, tile)
    if name == ACCURACY:
        return outline_accuracy.task(survey)
    if name in survey.images.assets:
        return ingest_image.image_task(survey, name)
    return calibration.task(survey, name) if name.startswith(calibration.UNIT) else points_task(survey, name)


KIND = TaskKind(NAME, VERSION, run_points, SourceFile)

STAGE = Stage(
    name=NAME,
    unit="LiDAR file; image; camera with calibration frames; the outlines' file; the outlines assigned to a ground tile",
    place=Place.FILE,
    text=(
        "points, streamed once → one LAZ piece per index cell that the file touches. Images, decoded once, raw frames corrected → tiled TIFF with a "
        "pyramid. Outlines → cleaned and named, their chains of neighbours assigned to tiles; chains → noded outlines for the tiles that own them; their "
        "accuracy, by the façades in one LiDAR file"
    ),
    kinds=(KIND, ingest_image.KIND, calibration.KIND, outlines_dealt.KIND, outlines_noded.KIND, outline_accuracy.KIND),
    needs=(_known_before, _sampled_file),
    task=_task,
    begins=_begins,
    parameters=(TileParameters,),
    cost=Cost(1.0, 400.0, 4.0),
    limits=Limits(7200, 6000),
)

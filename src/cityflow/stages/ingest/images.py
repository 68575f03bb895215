"""Stage ``ingest``, for images: each is decoded once into a tiled pyramid; raw images are developed."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from cityflow.core.building import Status
from cityflow.errors import CatalogError
from cityflow.flow.store import Store
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import OrientedField
from cityflow.handover.oriented import to_json
from cityflow.handover.source_file import SourceFile
from cityflow.io.fetch import local_file
from cityflow.io.images.image_tiles import tile_image
from cityflow.io.images.tiled_images import check_against, image_header
from cityflow.stages.ingest.camera_corrections import placed, stamp, unit_of
from cityflow.stages.ingest.develop import Corrections, Frame, develop
from cityflow.survey.city import INGEST as NAME
from cityflow.survey.raw_parameters import RawInput
from cityflow.survey.survey import Survey

VERSION = 2
TILED = "image.tif"


@dataclass(frozen=True, slots=True)
class ImageInputs(TaskInputs):
    """An image and what corrects it.

    Attributes
    ----------
    image : as it was taken
    corrections : RUN-relative paths of what the calibration of its camera has left;  uncalibrated : why there is nothing, else empty
    infrared : address of its near-infrared picture; None where there is none
    """

    file: SourceFile
    image: OrientedField
    corrections: tuple[str, ...] = ()
    uncalibrated: str = ""
    infrared: str | None = None


def image_task(survey: Survey, name: str) -> Task:
    """Tile one image; a raw frame is developed with what the calibration of its camera has left."""
    asset, raw = survey.images.assets[name], survey.parameters.raw
    file, infrared = SourceFile(asset.href, asset.size, asset.checksum), infrared_of(survey, name)
    inputs = {"file": asset.checksum}
    if raw.undistort:
        inputs["camera"] = digest_of(to_json(asset.oriented)["camera"])
    if raw.calibration is not None:
        unit = unit_of(survey, name)
        inputs["calibration"] = survey.results.digest_of(NAME, unit) if unit else "no camera"
    if infrared is not None:
        # size and date stand for the contents: reading the pictures of a whole flight in advance would take too long
        inputs["near infrared"] = digest_of(stamp(infrared))
    folders = ("calibration.folder", "near_infrared.folder")
    return KIND.task(
        name, parameters={} if raw.is_nothing else as_json(raw, without=folders), inputs=inputs,
        given=ImageInputs(file, asset.oriented, *_corrections(survey, name), infrared), limits=survey.limits(NAME),
    )  # fmt: skip


def _corrections(survey: Survey, name: str) -> tuple[tuple[str, ...], str]:
    """What the calibration of an image's camera has left, or why there is nothing."""
    if survey.parameters.raw.calibration is None:
        return (), ""
    unit = unit_of(survey, name)
    left = survey.results.of(NAME, unit) if unit else None
    if left is not None and left.status is not Status.FAILED:
        return left.paths, ""
    return (), f"{unit} has failed: {left.reason}" if left else "the image's name tells no camera"


def infrared_of(survey: Survey, name: str) -> str | None:
    """Address of the near-infrared picture of an image; None where none is asked for."""
    asked = survey.parameters.raw.near_infrared
    if asked is None:
        return None
    return f"{placed(survey, asked.folder).rstrip('/')}/{asked.file.replace('{image}', name)}"


def run(workspace: Workspace, task: Task) -> Outcome:
    """The image as a tiled TIFF with its pyramid.

    Raises
    ------
    CatalogError
        The file is another than when the catalog was made, damaged, turned, of another size than its camera's images, or, as a raw frame, not what
        the workflow says of it.
    """
    given, raw = task.arguments_as(ImageInputs), task.parameters_as(RawInput)
    with local_file(given.file.href) as path, tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        given.file.refuse_other(path)
        header = image_header(path)
        check_against(header, given.image.camera)
        tiled = Path(folder) / TILED
        if raw.is_nothing:
            tile_image(path, tiled)
            size = header.width, header.height, header.bands
        else:
            size = _develop(workspace.store, given, raw, path, tiled)
        workspace.write_file(TILED, tiled)
    digest = digest_of(list(workspace.outputs.values()))
    return workspace.outcome(result={"digest": digest, **dict(zip(("width", "height", "bands"), size, strict=True))})


def _develop(store: Store, given: ImageInputs, raw: RawInput, path: Path, target: Path) -> tuple[int, int, int]:
    href = given.file.href
    if given.uncalibrated:
        raise CatalogError(
            f"it cannot be calibrated: {given.uncalibrated}", where=href,
            remedy="fix the calibration frames, see raw.calibration, or leave raw.calibration out",
        )  # fmt: skip
    corrections = Corrections.of(store, given.corrections) if raw.calibration is not None else None
    with ExitStack() as stack:
        infrared = None if given.infrared is None else stack.enter_context(local_file(given.infrared))
        frame = Frame(path, href, given.image.camera, corrections, infrared, given.infrared or "")
        return develop(frame, raw, target, target.parent)


KIND = TaskKind(NAME, VERSION, run, ImageInputs)

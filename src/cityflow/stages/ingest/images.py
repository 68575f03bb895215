"""Stage ``ingest``, for images: each one decoded once into a tiled pyramid that is read by window ever after, raw frames developed on the way."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path

from cityflow.core.building import Status
from cityflow.errors import CatalogError
from cityflow.flow.task import Json, Outcome, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.handover.oriented import of_json, to_json
from cityflow.handover.pieces import refuse_other_file
from cityflow.io.fetch import local_file
from cityflow.io.images.image_tiles import tile_image
from cityflow.io.images.tiled_images import check_against, image_header
from cityflow.stages.ingest.calibration import placed, stamp, unit_of
from cityflow.stages.ingest.develop import Corrections, Frame, develop
from cityflow.survey.city import INGEST as NAME
from cityflow.survey.raw_parameters import RawInput
from cityflow.survey.survey import Survey

VERSION = 2
TILED = "image.tif"


def image_task(survey: Survey, name: str) -> Task:
    """Tile one image; a raw frame is developed with what the calibration of its camera has left."""
    asset, raw = survey.images.assets[name], survey.parameters.raw
    inputs = {"file": asset.checksum}
    arguments: dict[str, Json] = {"href": asset.href, "size": asset.size, "image": to_json(asset.oriented)}
    parameters: dict[str, Json] = {}
    if not raw.is_nothing:
        parameters = raw.model_dump(mode="json")
        for place in ("calibration", "near_infrared"):
            if parameters[place] is not None:
                arguments[place + "_folder"] = placed(survey, parameters[place].pop("folder"))
        if raw.undistort:
            inputs["camera"] = digest_of(arguments["image"]["camera"])
        _add_calibration(survey, name, inputs, arguments)
        _add_infrared(raw, name, inputs, arguments)
    return Task(
        NAME, name, "cityflow.stages.ingest.images:run", VERSION,
        parameters=parameters, inputs=inputs, arguments=arguments, limits=survey.limits(NAME),
    )  # fmt: skip


def _add_calibration(survey: Survey, name: str, inputs: dict[str, str], arguments: dict[str, Json]) -> None:
    if survey.parameters.raw.calibration is None:
        return
    unit = unit_of(survey, name)
    record = survey.results.records.get((NAME, unit)) if unit else None
    inputs["calibration"] = survey.results.digest_of(NAME, unit) if unit else "no camera"
    if record is not None and record.status is not Status.FAILED:
        arguments["calibration"] = list(record.outputs)
    else:
        what = f"{unit} has failed: {record.reason}" if record else "the image's name tells no camera"
        arguments["uncalibrated"] = what


def _add_infrared(raw: RawInput, name: str, inputs: dict[str, str], arguments: dict[str, Json]) -> None:
    """Size and date stand for the contents: reading the pictures of a whole flight in advance would take too long."""
    if raw.near_infrared is not None:
        href = f"{arguments['near_infrared_folder'].rstrip('/')}/{raw.near_infrared.file.replace('{image}', name)}"
        inputs["near infrared"] = digest_of(stamp(href))
        arguments["infrared"] = href


def run(workspace: Workspace, task: Task) -> Outcome:
    """The image as a tiled TIFF with its pyramid.

    Raises
    ------
    CatalogError
        The file is another than when the catalog was made, damaged, turned, of another size than its camera's images, or, as a raw frame, not what
        the workflow says of it.
    """
    image = of_json(task.arguments["image"])
    with local_file(task.arguments["href"]) as path, tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        refuse_other_file(path, task)
        header = image_header(path)
        check_against(header, image.camera)
        tiled = Path(folder) / TILED
        if task.parameters:
            size = _develop(workspace, task, path, tiled)
        else:
            tile_image(path, tiled)
            size = header.width, header.height, header.bands
        workspace.write_file(TILED, tiled)
    digest = digest_of(list(workspace.outputs.values()))
    return workspace.outcome(result={"digest": digest, **dict(zip(("width", "height", "bands"), size, strict=True))})


def _develop(workspace: Workspace, task: Task, path: Path, target: Path) -> tuple[int, int, int]:
    a = task.arguments
    raw = _raw_of(task)
    if "uncalibrated" in a:
        raise CatalogError(
            f"it cannot be calibrated: {a['uncalibrated']}", where=a["href"],
            remedy="mend the calibration frames, see raw.calibration, or leave raw.calibration out",
        )  # fmt: skip
    corrections = None
    if raw.calibration is not None:
        corrections = Corrections.of(workspace.store, a["calibration"])
    with ExitStack() as stack:
        infrared = stack.enter_context(local_file(a["infrared"])) if "infrared" in a else None
        camera = of_json(a["image"]).camera
        frame = Frame(path, a["href"], camera, corrections, infrared, a.get("infrared", ""))
        return develop(frame, raw, target, target.parent)


def _raw_of(task: Task) -> RawInput:
    """The parameters, with the folders put back that are no part of a digest."""
    tree = dict(task.parameters)
    for place in ("calibration", "near_infrared"):
        if tree[place] is not None:
            tree[place] = {**tree[place], "folder": task.arguments[place + "_folder"]}
    return RawInput.model_validate(tree)

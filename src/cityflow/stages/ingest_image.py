"""Stage ``ingest``, for images: each one decoded once into a tiled pyramid that is read by window ever after."""

from __future__ import annotations

import tempfile
from pathlib import Path

from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.io.fetch import local_file
from cityflow.io.image_tiles import tile_image
from cityflow.io.images import check_against, image_header
from cityflow.stages.ingest import STAGE, refuse_other_file
from cityflow.stages.oriented import of_json, to_json
from cityflow.stages.survey import Survey

VERSION = 1
TILED = "image.tif"


def image_task(survey: Survey, name: str) -> Task:
    """Tile one image."""
    asset = survey.images.assets[name]
    return Task(
        STAGE, name, "cityflow.stages.ingest_image:run", VERSION,
        inputs={"file": asset.checksum},
        arguments={"href": asset.href, "size": asset.size, "image": to_json(asset.oriented)},
        limits=survey.limits(STAGE),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """The image as a tiled TIFF with its pyramid.

    Raises
    ------
    CatalogError
        The file is another than when the catalog was made, damaged, turned, or of another size than its camera's images.
    """
    image = of_json(task.arguments["image"])
    with local_file(task.arguments["href"]) as path, tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        refuse_other_file(path, task)
        header = image_header(path)
        check_against(header, image.camera)
        tiled = Path(folder) / TILED
        tile_image(path, tiled)
        workspace.write_file(TILED, tiled)
    digest = digest_of(list(workspace.outputs.values()))
    return workspace.outcome(
        result={"digest": digest, "width": header.width, "height": header.height, "bands": header.bands}
    )

"""Stages ``patches`` and ``crops`` of ``cityflow orient --onto``: planes of a scan, and what each picture shows around them."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cityflow.adjustment.block import Block
from cityflow.adjustment.bundle import pixel_on_ground
from cityflow.adjustment.patch_matching import CELLS, Crop, Sides, crops_of, sides_of
from cityflow.adjustment.registration import REACH_M
from cityflow.adjustment.survey_patches import Heights, Patches, patches_of
from cityflow.core.arrays import FloatArray
from cityflow.flow.task import Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.geometry.similarity import Similarity
from cityflow.handover.field_types import OrientedField
from cityflow.handover.oriented import to_json
from cityflow.handover.patch_files import decode_sides, encode_crops, encode_sides
from cityflow.handover.refined_block import decode_block_ties, decode_points
from cityflow.handover.registration_file import RegistrationResult, decode_registration
from cityflow.handover.source_file import SourceFile
from cityflow.io.fetch import local_file
from cityflow.io.images.image_tiles import tile_image
from cityflow.io.images.tiled_images import check_size, image_header, open_image
from cityflow.stages.orient import BLOCK, ONE_IMAGE, WHOLE_BLOCK
from cityflow.stages.orient.register import SurveyFile, survey_points

PATCHES, CROPS = "patches", "crops"
VERSION = 1
PATCHES_FILE, CROPS_FILE = "patches.bin", "crops.bin"
LEAST_EDGE_M = 1.5
"""Of a patch: a scan of some points per square metre fills it; set by hand, as are those below."""
MARGIN_M = 30.0
"""The survey is read so far around the tie points."""
SIGNIFICANT = 3.0
"""Standard deviations by which the registration must contradict the size of the given block to leave it."""


@dataclass(frozen=True, slots=True)
class PatchInputs(TaskInputs):
    """Adjusted images of the block, in its order; RUN-relative paths of its tie points, of their observations, and of the registration; files of the scan
    and their CRS."""

    images: tuple[OrientedField, ...]
    points: str
    ties: str
    registration: str
    survey: tuple[SurveyFile, ...]
    crs: str


@dataclass(frozen=True, slots=True)
class CropInputs(TaskInputs):
    """An adjusted image and its number in the block; its file, and the value that is shown as white; RUN-relative paths of patches and registration."""

    number: int
    image: OrientedField
    file: SourceFile
    white: float
    patches: str
    registration: str


@dataclass(frozen=True, slots=True)
class ToSurvey:
    """From where a block was given to the survey less `origin`; `scale_free`: whether the registration contradicts the size that it was given."""

    move: Similarity
    origin: FloatArray
    scale_free: bool

    @classmethod
    def of(cls, by: RegistrationResult) -> ToSurvey:
        """With the size that the block was given unless that is contradicted."""
        origin, whole = np.floor(by.middle), by.similarity
        if abs(whole.scale - 1.0) > SIGNIFICANT * float(np.sqrt(by.covariance[6, 6])):
            return cls(Similarity(whole.scale, whole.rotation, whole.shift - origin), origin, True)
        before = np.linalg.solve(whole.scale * whole.rotation, by.middle - whole.shift)
        move = Similarity(1.0, whole.rotation, np.asarray(by.middle - origin - whole.rotation @ before))
        return cls(move, origin, False)


def to_survey(workspace: Workspace, registration: str) -> ToSurvey:
    """As a registration has it whose RUN-relative path this is."""
    return ToSurvey.of(decode_registration(json.loads(workspace.read(registration))))


def patches_task(given: PatchInputs, digests: Mapping[str, str]) -> Task:
    """The task; `digests`: of the contents of the inputs that are paths."""
    return PATCHES_KIND.task(
        BLOCK,
        inputs={
            **digests,
            "crs": digest_of(given.crs), **{f"image {i.name}": digest_of(to_json(i)) for i in given.images},
            **{f"survey {k}": digest_of([f.kind, f.file.checksum, f.cell, f.layer]) for k, f in enumerate(given.survey)},
        },
        given=given, limits=WHOLE_BLOCK,
    )  # fmt: skip


def run_patches(workspace: Workspace, task: Task) -> Outcome:
    """Patches of the scan, and which pictures are looked at for each.

    Raises
    ------
    CatalogError
        A file cannot be read.
    """
    given = task.arguments_as(PatchInputs)
    there = to_survey(workspace, given.registration)
    xyz, ties = decode_points(workspace.read(given.points))[:, :3], decode_block_ties(workspace.read(given.ties))
    places = there.move.moved(xyz)
    survey = survey_points(given.survey, given.crs, _around(places + there.origin)) - there.origin
    images = [there.move.moved_image(i) for i in given.images]
    cell_m = max(LEAST_EDGE_M / CELLS, pixel_on_ground(replace(Block.of(images, np.zeros(3)), xyz=places), ties))
    if len(survey) < CELLS:
        sides = sides_of(Patches.none(), Heights(places), images)
    else:
        sides = sides_of(patches_of(survey, places, REACH_M, CELLS * cell_m), Heights(survey), images)
    workspace.write(PATCHES_FILE, encode_sides(sides, cell_m))
    looked_at = len(np.unique(sides.seen[:, 1]))
    return workspace.outcome(result={"patches": len(np.unique(sides.patch)), "pictures": looked_at})


def crops_task(given: CropInputs, digests: Mapping[str, str]) -> Task:
    """The task of one picture; `digests`: of the contents of the inputs that are paths."""
    return CROPS_KIND.task(
        given.image.name,
        inputs={
            **digests,
            "file": given.file.checksum, "white": digest_of(given.white), "image": digest_of([given.number, to_json(given.image)]),
        },
        given=given, limits=ONE_IMAGE,
    )  # fmt: skip


def run_crops(workspace: Workspace, task: Task) -> Outcome:
    """What one picture shows around the patches that it is looked at for; one that shows none is not read.

    Raises
    ------
    CatalogError
        The file is another than when the catalog was made, damaged, or of another size than its camera's images.
    """
    given = task.arguments_as(CropInputs)
    sides, cell_m = decode_sides(workspace.read(given.patches))
    wanted = sides.of(given.number)
    crops = _crops(given, to_survey(workspace, given.registration), sides, cell_m) if len(wanted) else {}
    workspace.write(CROPS_FILE, encode_crops(crops))
    return workspace.outcome(result={"patches": len(crops)})


def _crops(given: CropInputs, there: ToSurvey, sides: Sides, cell_m: float) -> dict[int, Crop]:
    camera = given.image.camera
    with local_file(given.file.href) as path, tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        given.file.refuse_other(path)
        check_size(image_header(path), (camera.width, camera.height))
        tiled = Path(folder) / "image.tif"
        tile_image(path, tiled)
        pixels = open_image(tiled)
        image = there.move.moved_image(given.image)
        crops = crops_of(sides, sides.of(given.number), image, pixels, given.white, cell_m)
        pixels.close()
    return crops


def _around(places: FloatArray) -> tuple[float, float, float, float]:
    low, high = np.percentile(places[:, :2], [0.5, 99.5], axis=0)
    return float(low[0] - MARGIN_M), float(low[1] - MARGIN_M), float(high[0] + MARGIN_M), float(high[1] + MARGIN_M)


PATCHES_KIND = TaskKind(PATCHES, VERSION, run_patches, PatchInputs)
CROPS_KIND = TaskKind(CROPS, VERSION, run_crops, CropInputs)

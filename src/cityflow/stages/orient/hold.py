"""Stage ``hold`` of ``cityflow orient --onto``: after the registration, planes of the scan hold the adjustment of the block."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cityflow.adjustment.block import Block
from cityflow.adjustment.bundle import pixel_on_ground
from cityflow.adjustment.patch_matching import CELLS, patch_ties
from cityflow.adjustment.registration import REACH_M
from cityflow.adjustment.survey_hold import Planes, Sigmas, contradicts, held_by_survey
from cityflow.adjustment.survey_patches import Heights, patches_of
from cityflow.core.arrays import FloatArray
from cityflow.core.pixels import Pixels
from cityflow.flow.task import Limits, Outcome, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.geometry.similarity import Similarity
from cityflow.handover.field_types import OrientedField
from cityflow.handover.held_block import encode_held, whole_move
from cityflow.handover.oriented import to_json
from cityflow.handover.refined_block import decode_block_ties, decode_points
from cityflow.handover.registration_file import RegistrationResult, decode_registration
from cityflow.handover.source_file import SourceFile
from cityflow.io.fetch import local_file
from cityflow.io.images.image_tiles import tile_image
from cityflow.io.images.tiled_images import check_size, image_header, open_image
from cityflow.stages.orient import BLOCK
from cityflow.stages.orient.register import SurveyFile, survey_points

HOLD = "hold"
VERSION = 1
HELD_FILE = "held.json"
LIMITS = Limits(time_s=6 * 3600, memory_mb=16000)
LEAST_EDGE_M = 1.5
"""Of a patch: a scan of some points per square metre fills it; set by hand, as is the next."""
MARGIN_M = 30.0
"""The survey is read so far around the tie points."""
SIGNIFICANT = 3.0
"""Standard deviations by which the registration must contradict the size of the given block to leave it."""
TOO_FEW = "too few planes of the scan are found in the pictures"


@dataclass(frozen=True, slots=True)
class HoldImage(TaskInputs):
    """An image of the block: as given and as adjusted; its file, and the value that is shown as white."""

    given: OrientedField
    adjusted: OrientedField
    file: SourceFile
    white: float


@dataclass(frozen=True, slots=True)
class HoldInputs(TaskInputs):
    """Images in the order of the block; RUN-relative paths of its tie points, of their observations, and of the registration; files of the scan and their
    CRS; how exact image coordinates (pixels), given positions (metres) and rotations (degrees) are."""

    images: tuple[HoldImage, ...]
    points: str
    ties: str
    registration: str
    survey: tuple[SurveyFile, ...]
    crs: str
    sigma_px: float
    position_sigma_m: float
    angle_sigma_deg: float


def hold_task(given: HoldInputs, digests: Mapping[str, str]) -> Task:
    """The task; `digests`: of the contents of the inputs that are paths."""
    return HOLD_KIND.task(
        BLOCK, parameters={},
        inputs={
            **digests,
            "sigmas": digest_of([given.sigma_px, given.position_sigma_m, given.angle_sigma_deg]), "crs": digest_of(given.crs),
            **{f"image {i.given.name}": digest_of([i.file.checksum, i.white, to_json(i.given), to_json(i.adjusted)]) for i in given.images},
            **{f"survey {k}": digest_of([f.kind, f.file.checksum, f.cell, f.layer]) for k, f in enumerate(given.survey)},
        },
        given=given, limits=LIMITS,
    )  # fmt: skip


def run_hold(workspace: Workspace, task: Task) -> Outcome:
    """Poses of the block as the planes of the scan have it, or as given where these do not contradict it; an empty file where they are too few.

    Raises
    ------
    CatalogError
        A file cannot be read.
    """
    given = task.arguments_as(HoldInputs)
    by = decode_registration(json.loads(workspace.read(given.registration)))
    xyz, ties = decode_points(workspace.read(given.points))[:, :3], decode_block_ties(workspace.read(given.ties))
    origin = np.floor(by.middle)
    scale_free = abs(by.similarity.scale - 1.0) > SIGNIFICANT * float(np.sqrt(by.covariance[6, 6]))
    before = _of_size(by, scale_free, origin)
    places = before.moved(xyz)
    survey = survey_points(given.survey, given.crs, _around(places + origin)) - origin
    names = [i.given.name for i in given.images]
    adjusted = [before.moved_image(i.adjusted) for i in given.images]
    start = replace(Block.of(adjusted, np.zeros(3)), xyz=places)
    cell_m = max(LEAST_EDGE_M / CELLS, pixel_on_ground(start, ties))
    if len(survey) < CELLS:
        return _nothing(workspace)
    patches = patches_of(survey, places, REACH_M, CELLS * cell_m)
    if not len(patches.xyz):
        return _nothing(workspace)
    with _Pictures(given.images) as pictures:
        white = [i.white for i in given.images]
        shown = patch_ties(patches, Heights(survey), adjusted, pictures.open, white, cell_m)
    planes = Planes(shown.ties, patches.xyz[shown.patch], shown.normals, patches.kind[shown.patch])
    poses = Block.of([before.moved_image(i.given) for i in given.images], np.zeros(3))
    sigmas = Sigmas(given.sigma_px, given.position_sigma_m, float(np.radians(given.angle_sigma_deg)))
    found = held_by_survey(poses, start, ties, planes, sigmas, scale_free=scale_free)
    if found is None:
        return _nothing(workspace)
    own = whole_move(found, before)
    # both in the frame of `found`
    stays = not contradicts(found, Similarity(own.scale, own.rotation, own.moved(origin[None])[0]))
    if stays:
        there = Block.of([replace(i.adjusted, centre=i.adjusted.centre - origin) for i in given.images], np.zeros(3))
        still = Similarity(1.0, np.eye(3), np.zeros(3))
        found = replace(found, block=replace(there, xyz=xyz - origin), move=still)
        before = Similarity(1.0, np.eye(3), -origin)
    tree = encode_held(found, names, before, origin, stays=stays)
    workspace.write(HELD_FILE, json.dumps(tree, sort_keys=True, separators=(",", ":"), allow_nan=False).encode())
    return workspace.outcome(result=tree["figures"])


def _nothing(workspace: Workspace) -> Outcome:
    workspace.write(HELD_FILE, b"{}")
    return workspace.outcome(result={"problem": TOO_FEW})


def _of_size(by: RegistrationResult, scale_free: bool, origin: FloatArray) -> Similarity:
    """The registration, to the survey less `origin`; with the size that the block was given unless that is contradicted."""
    whole = by.similarity
    if scale_free:
        return Similarity(whole.scale, whole.rotation, whole.shift - origin)
    before = np.linalg.solve(whole.scale * whole.rotation, by.middle - whole.shift)
    return Similarity(1.0, whole.rotation, np.asarray(by.middle - origin - whole.rotation @ before))


def _around(places: FloatArray) -> tuple[float, float, float, float]:
    low, high = np.percentile(places[:, :2], [0.5, 99.5], axis=0)
    return float(low[0] - MARGIN_M), float(low[1] - MARGIN_M), float(high[0] + MARGIN_M), float(high[1] + MARGIN_M)


class _Pictures(ExitStack):
    """Opens one image after the other."""

    def __init__(self, images: Sequence[HoldImage]) -> None:
        super().__init__()
        self._images = images

    def open(self, number: int) -> Pixels:
        """Its pixels; those of the one before are closed."""
        self.close()
        each, camera = self._images[number], self._images[number].given.camera
        folder = self.enter_context(tempfile.TemporaryDirectory(prefix="cityflow-"))
        path = self.enter_context(local_file(each.file.href))
        each.file.refuse_other(path)
        check_size(image_header(path), (camera.width, camera.height))
        tiled = Path(folder) / "image.tif"
        tile_image(path, tiled)
        pixels = open_image(tiled)
        self.callback(pixels.close)
        return pixels


HOLD_KIND = TaskKind(HOLD, VERSION, run_hold, HoldInputs)

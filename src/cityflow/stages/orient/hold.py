"""Stage ``hold`` of ``cityflow orient --onto``: after the registration, planes of the scan hold the adjustment of the block; and what it waits for."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from cityflow.adjustment.block import Block
from cityflow.adjustment.patch_matching import Crop, patch_ties
from cityflow.adjustment.survey_hold import Planes, Sigmas, contradicts, held_by_survey
from cityflow.core.building import Status
from cityflow.flow.task import Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs
from cityflow.flow.workspace import Workspace
from cityflow.geometry.similarity import Similarity
from cityflow.handover.field_types import OrientedField
from cityflow.handover.held_block import encode_held, whole_move
from cityflow.handover.oriented import to_json
from cityflow.handover.patch_files import decode_crops, decode_sides
from cityflow.handover.refined_block import decode_block_ties, decode_points
from cityflow.handover.source_file import SourceFile
from cityflow.stages.orient import BLOCK, WHOLE_BLOCK
from cityflow.stages.orient.register import SurveyFile
from cityflow.stages.orient.scan_patches import (
    CROPS,
    PATCHES,
    CropInputs,
    PatchInputs,
    crops_task,
    patches_task,
    to_survey,
)  # fmt: skip

HOLD = "hold"
HOLD_STAGES = (PATCHES, CROPS, HOLD)
VERSION = 2
HELD_FILE = "held.json"
TOO_FEW = "too few planes of the scan are found in the pictures"


@dataclass(frozen=True, slots=True)
class GivenImage:
    """An image of the block: as given and as adjusted; its file, and the value that is shown as white."""

    given: OrientedField
    adjusted: OrientedField
    file: SourceFile
    white: float


@dataclass(frozen=True, slots=True)
class GivenBlock:
    """Images in the order of the block; RUN-relative paths of its tie points, of their observations, and of the registration, and digests of their
    contents; files of the scan and their CRS; how exact image coordinates (pixels), given positions (metres) and rotations (degrees) are."""

    images: tuple[GivenImage, ...]
    points: str
    ties: str
    registration: str
    digests: Mapping[str, str]
    survey: tuple[SurveyFile, ...]
    crs: str
    sigmas: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class HoldImage(TaskInputs):
    """An image of the block: as given and as adjusted; RUN-relative path of its crops, None where it could not be read."""

    given: OrientedField
    adjusted: OrientedField
    crops: str | None


@dataclass(frozen=True, slots=True)
class HoldInputs(TaskInputs):
    """Images in the order of the block; RUN-relative paths of its tie points, of their observations, of the registration, and of the patches; how exact image
    coordinates (pixels), given positions (metres) and rotations (degrees) are."""

    images: tuple[HoldImage, ...]
    points: str
    ties: str
    registration: str
    patches: str
    sigmas: tuple[float, float, float]


@dataclass
class HoldSource:
    """Patches of the scan first, then what each picture shows of them, the adjustment last."""

    block: GivenBlock
    _patches: Record | None = field(default=None, init=False)
    _crops: dict[str, Record] = field(default_factory=dict, init=False)

    def initial(self) -> Iterator[Task]:
        """The patches."""
        b = self.block
        given = PatchInputs(tuple(i.adjusted for i in b.images), b.points, b.ties, b.registration, b.survey, b.crs)
        yield patches_task(given, self._digests(b.points, b.ties, b.registration))

    def after(self, task: Task, record: Record) -> Iterable[Task]:
        """Crops of all pictures when the patches are there, the adjustment when all crops are."""
        if task.stage == PATCHES:
            self._patches = record
            return [] if record.status is Status.FAILED else [self._crop(k) for k in range(len(self.block.images))]
        if task.stage == CROPS:
            self._crops[task.unit] = record
            return [self._hold()] if len(self._crops) == len(self.block.images) else []
        return []

    def _digests(self, *paths: str) -> dict[str, str]:
        return {name: self.block.digests[path] for path in paths for name in (path.rsplit("/", 1)[-1],)}

    def _crop(self, number: int) -> Task:
        each, (path, digest) = self.block.images[number], self._patches_file()
        given = CropInputs(number, each.adjusted, each.file, each.white, path, self.block.registration)
        return crops_task(given, {"patches": digest, **self._digests(self.block.registration)})

    def _hold(self) -> Task:
        b, (path, digest) = self.block, self._patches_file()
        read = {n: next(iter(r.outputs.items())) for n, r in self._crops.items() if r.status is not Status.FAILED}
        images = tuple(HoldImage(i.given, i.adjusted, read.get(i.given.name, (None, ""))[0]) for i in b.images)
        return HOLD_KIND.task(
            BLOCK,
            inputs={
                **self._digests(b.points, b.ties, b.registration),
                "patches": digest, "sigmas": digest_of(list(b.sigmas)),
                **{f"image {i.given.name}": digest_of([to_json(i.given), to_json(i.adjusted)]) for i in b.images},
                **{f"crops {name}": found for name, (_, found) in sorted(read.items())},
            },
            given=HoldInputs(images, b.points, b.ties, b.registration, path, b.sigmas), limits=WHOLE_BLOCK,
        )  # fmt: skip

    def _patches_file(self) -> tuple[str, str]:
        """Its path and digest."""
        assert self._patches is not None
        return next(iter(self._patches.outputs.items()))


def run_hold(workspace: Workspace, task: Task) -> Outcome:
    """Poses of the block as the planes of the scan have it, or as given where these do not contradict it; an empty file where they are too few."""
    given = task.arguments_as(HoldInputs)
    there = to_survey(workspace, given.registration)
    before, origin = there.move, there.origin
    xyz, ties = decode_points(workspace.read(given.points))[:, :3], decode_block_ties(workspace.read(given.ties))
    names = [i.given.name for i in given.images]
    adjusted = [before.moved_image(i.adjusted) for i in given.images]
    start = replace(Block.of(adjusted, np.zeros(3)), xyz=before.moved(xyz))
    sides, cell_m = decode_sides(workspace.read(given.patches))
    shown = patch_ties(sides, [_crops(workspace, i.crops) for i in given.images], adjusted, cell_m)
    planes = Planes(shown.ties, sides.xyz[shown.side], sides.normals[shown.side], sides.kind[shown.side])
    poses = Block.of([before.moved_image(i.given) for i in given.images], np.zeros(3))
    image_px, position_m, angle_deg = given.sigmas
    sigmas = Sigmas(image_px, position_m, float(np.radians(angle_deg)))
    found = held_by_survey(poses, start, ties, planes, sigmas, scale_free=there.scale_free)
    if found is None:
        workspace.write(HELD_FILE, b"{}")
        return workspace.outcome(result={"problem": TOO_FEW})
    own = whole_move(found, before)
    # both in the frame of `found`
    stays = not contradicts(found, Similarity(own.scale, own.rotation, own.moved(origin[None])[0]))
    if stays:
        unmoved = Block.of([replace(i.adjusted, centre=i.adjusted.centre - origin) for i in given.images], np.zeros(3))
        still = Similarity(1.0, np.eye(3), np.zeros(3))
        found = replace(found, block=replace(unmoved, xyz=xyz - origin), move=still)
        before = Similarity(1.0, np.eye(3), -origin)
    tree = encode_held(found, names, before, origin, stays=stays)
    workspace.write(HELD_FILE, json.dumps(tree, sort_keys=True, separators=(",", ":"), allow_nan=False).encode())
    return workspace.outcome(result=tree["figures"])


def _crops(workspace: Workspace, path: str | None) -> dict[int, Crop]:
    return {} if path is None else decode_crops(workspace.read(path))


HOLD_KIND = TaskKind(HOLD, VERSION, run_hold, HoldInputs)

"""Stages of ``cityflow orient``: features of each image, ties of each image with its partners, the adjustment of the block."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cityflow.adjustment.bundle import AdjustmentParameters
from cityflow.adjustment.control_check import ContradictionError
from cityflow.adjustment.features import FeatureParameters, Features, find_features
from cityflow.adjustment.guided_matching import guided_matches
from cityflow.adjustment.pair_check import agreeing
from cityflow.adjustment.refinement import refined
from cityflow.adjustment.tracks import tied
from cityflow.core.building import Status
from cityflow.core.control_points import ControlPoint
from cityflow.core.pixels import ArrayPixels
from cityflow.errors import CatalogError
from cityflow.flow.task import Json, Limits, Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.field_types import OrientedField
from cityflow.handover.known_points import KnownPoint, control_points, known_points
from cityflow.handover.oriented import to_json
from cityflow.handover.refined_block import encode_block_ties, encode_points, encode_refinement
from cityflow.handover.source_file import SourceFile
from cityflow.handover.tie_files import decode_features, decode_matches, encode_features, encode_matches
from cityflow.io.catalog.stac_assets import ImageAsset
from cityflow.io.fetch import local_file
from cityflow.io.images.image_tiles import picture_strips, tile_image
from cityflow.io.images.tiled_images import check_size, image_header, open_image
from cityflow.orientation.tie_pairs import tie_pairs
from cityflow.orientation.views import View
from cityflow.survey.orient_parameters import OrientParameters, TieParameters

FEATURES, TIES, ADJUST = "features", "ties", "adjust"
STAGES = (FEATURES, TIES, ADJUST)
VERSION, ADJUST_VERSION = 3, 10
BLOCK = "block"
"""The one unit of the adjustment."""
FEATURES_FILE, TIES_FILE, BLOCK_FILE = "features.bin", "ties.bin", "block.json"
POINTS_FILE, BLOCK_TIES_FILE = "points.npy", "block_ties.npy"
LEAST_TIES, LEAST_SHARE = 15, 0.35
"""Matches of a pair that agree, and their share of all: fewer may agree by chance; set by hand on synthetic flights."""
ROWS, WHOLE_PX = 512, 12_000_000
"""Rows that are decoded at once; images of no more pixels are held whole while points are looked for."""
ONE_IMAGE, WHOLE_BLOCK = Limits(time_s=3600, memory_mb=6000), Limits(time_s=6 * 3600, memory_mb=16000)


@dataclass(frozen=True, slots=True)
class FeatureInputs(TaskInputs):
    """An image; `size`: width and height in pixels that it must have; `white`: the value that is shown as white."""

    file: SourceFile
    size: tuple[int, int]
    white: float


@dataclass(frozen=True, slots=True)
class TieImage(TaskInputs):
    """An image whose features are known: where they are, and lowest ground and highest object, metres."""

    image: OrientedField
    heights: tuple[float, float]
    features: str


@dataclass(frozen=True, slots=True)
class TieInputs(TaskInputs):
    """The first image is matched with each of the others."""

    images: tuple[TieImage, ...]


@dataclass(frozen=True, slots=True)
class BlockInputs(TaskInputs):
    """All images, RUN-relative paths of the ties of those that have partners, and points whose places are known."""

    images: tuple[TieImage, ...]
    ties: Mapping[str, str]
    points: tuple[KnownPoint, ...]


@dataclass
class OrientSource:
    """The tasks of one adjustment: features first, ties of an image when its partners have theirs, the block last.

    Parameters
    ----------
    assets : images of the catalog
    points : control and check points in its CRS, whose marks name its images
    """

    assets: tuple[ImageAsset, ...]
    parameters: OrientParameters
    points: tuple[ControlPoint, ...] = ()
    _ended: dict[str, dict[str, Record]] = field(default_factory=lambda: {FEATURES: {}, TIES: {}}, init=False)

    def __post_init__(self) -> None:
        views = [View(a.oriented, a.heights) for a in self.assets]
        names = [a.name for a in self.assets]
        self._asset = dict(zip(names, self.assets, strict=True))
        self.partners: dict[str, list[str]] = {name: [] for name in names}
        for one, other in tie_pairs(views, self.parameters.pairs):
            self.partners[names[one]].append(names[other])
        self._waiting = {name for name, others in self.partners.items() if others}
        self._uses: dict[str, set[str]] = {name: set() for name in names}
        for name in self._waiting:
            for each in (name, *self.partners[name]):
                self._uses[each].add(name)
        self.pairs = sum(len(others) for others in self.partners.values())

    def initial(self) -> Iterator[Task]:
        """Features of all images."""
        for asset in self.assets:
            camera = asset.oriented.camera
            yield feature_task(
                asset.name,
                SourceFile(asset.href, asset.size, asset.checksum),
                (camera.width, camera.height),
                asset.white or float(np.iinfo(asset.dtype).max),
                self.parameters.features,
            )

    def after(self, task: Task, record: Record) -> Iterable[Task]:
        """Ties whose features are all there, and the block when all ties are."""
        if task.stage == ADJUST:
            return []
        self._ended[task.stage][task.unit] = record
        if task.stage == TIES:
            return (
                [self._block()] if len(self._ended[TIES]) == len([n for n in self.partners if self.partners[n]]) else []
            )
        known = self._ended[FEATURES]
        ready = [
            name
            for name in sorted(self._uses[task.unit] & self._waiting)
            if all(each in known for each in (name, *self.partners[name]))
        ]
        self._waiting -= set(ready)
        return [self._ties(name) for name in ready]

    def _ties(self, name: str) -> Task:
        names = [n for n in (name, *self.partners[name]) if self._has_features(n)]
        images = tuple(self._tie_image(n) for n in names) if self._has_features(name) else ()
        asked = TieParameters(matching=self.parameters.matching, bound_px=self.parameters.bound_px)
        return TIES_KIND.task(
            name, parameters=as_json(asked),
            inputs={f"image {n}": self._digest(n) for n in names}, given=TieInputs(images), limits=ONE_IMAGE,
        )  # fmt: skip

    def _block(self) -> Task:
        names = [n for n in sorted(self.partners) if self._has_features(n)]
        ties = {n: r for n, r in sorted(self._ended[TIES].items()) if r.status is not Status.FAILED}
        points = known_points(self.points)
        given = BlockInputs(
            tuple(map(self._tie_image, names)), {n: next(iter(r.outputs)) for n, r in ties.items()}, points
        )
        return ADJUST_KIND.task(
            BLOCK, parameters=as_json(self.parameters.adjustment),
            inputs={
                **{f"image {n}": self._digest(n) for n in names},
                **{f"ties {n}": digest_of(list(r.outputs.values())) for n, r in ties.items()},
                **({"points": digest_of([as_json(p) for p in points])} if points else {}),
            },
            given=given, limits=WHOLE_BLOCK,
        )  # fmt: skip

    def _has_features(self, name: str) -> bool:
        return self._ended[FEATURES][name].status is not Status.FAILED

    def _tie_image(self, name: str) -> TieImage:
        asset = self._asset[name]
        return TieImage(asset.oriented, asset.heights, next(iter(self._ended[FEATURES][name].outputs)))

    def _digest(self, name: str) -> str:
        """Of features, pose and heights."""
        asset = self._asset[name]
        features = list(self._ended[FEATURES][name].outputs.values())
        return digest_of([features, to_json(asset.oriented), list(asset.heights)])


def feature_task(
    name: str, file: SourceFile, size: tuple[int, int], white: float, parameters: FeatureParameters
) -> Task:
    """The task of one image's points; `size` and `white` as in `FeatureInputs`."""
    return FEATURES_KIND.task(
        name, parameters=as_json(parameters), inputs={"file": file.checksum, "white": digest_of(white)},
        given=FeatureInputs(file, size, white), limits=ONE_IMAGE,
    )  # fmt: skip


def run_features(workspace: Workspace, task: Task) -> Outcome:
    """Points of one image.

    Raises
    ------
    CatalogError
        The file is another than when the catalog was made, damaged, or of another size than its camera's images.
    """
    given = task.arguments_as(FeatureInputs)
    with local_file(given.file.href) as path:
        given.file.refuse_other(path)
        check_size(image_header(path), given.size)
        found = _features_in(Path(path), given, task.parameters_as(FeatureParameters))
    workspace.write(FEATURES_FILE, encode_features(found))
    return workspace.outcome(result={"points": len(found)})


def _features_in(path: Path, given: FeatureInputs, parameters: FeatureParameters) -> Features:
    """From all pixels in memory where these are few, else from tiles on disc."""
    if parameters.level == 0 and math.prod(given.size) <= WHOLE_PX:
        with picture_strips(path, ROWS) as picture:
            whole = np.concatenate([strip for _, strip in picture.strips])
        return find_features(ArrayPixels(whole), given.white, parameters)
    with tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        tiled = Path(folder) / "image.tif"
        tile_image(path, tiled)
        pixels = open_image(tiled)
        found = find_features(pixels, given.white, parameters)
        pixels.close()
    return found


def run_ties(workspace: Workspace, task: Task) -> Outcome:
    """Matches of one image with its partners that agree with one relative orientation."""
    given, parameters = task.arguments_as(TieInputs), task.parameters_as(TieParameters)
    bound = parameters.bound_px
    agreed, found = {}, 0
    features = [decode_features(workspace.read(each.features)) for each in given.images]
    for other, theirs in list(zip(given.images, features, strict=True))[1:]:
        one = given.images[0]
        heights = min(one.heights[0], other.heights[0]), max(one.heights[1], other.heights[1])
        pair = one.image, other.image
        matches = guided_matches(pair, (features[0], theirs), heights, bound, parameters.matching)
        good = agreeing(pair, (features[0].uv[matches[:, 0]], theirs.uv[matches[:, 1]]), bound)
        found += len(matches)
        if good.sum() >= max(LEAST_TIES, LEAST_SHARE * len(matches)):
            agreed[other.image.name] = matches[good]
    workspace.write(TIES_FILE, encode_matches(agreed))
    result: dict[str, Json] = {
        "pairs": max(len(given.images) - 1, 0), "tied": len(agreed), "matches": found, "agreed": sum(map(len, agreed.values())),
    }  # fmt: skip
    return workspace.outcome(result=result)


def run_adjust(workspace: Workspace, task: Task) -> Outcome:
    """The block, refined where that is significant.

    Raises
    ------
    CatalogError
        The images show nothing in common where their poses have it, or control points contradict one another.
    """
    given = task.arguments_as(BlockInputs)
    number = {each.image.name: k for k, each in enumerate(given.images)}
    features = [decode_features(workspace.read(each.features)) for each in given.images]
    matches = {
        (number[name], number[other]): pairs
        for name, path in given.ties.items()
        for other, pairs in decode_matches(workspace.read(path)).items()
    }
    ties = tied(matches, [f.uv for f in features], [f.scale for f in features])
    images, points = [each.image for each in given.images], control_points(given.points)
    try:
        found = refined(images, ties, task.parameters_as(AdjustmentParameters), points)
    except ContradictionError as error:
        remedy = "check names, coordinates, their CRS, and marks; one point is wrong where the others agree"
        raise CatalogError(str(error), where="the control points", remedy=remedy) from error
    except ValueError as error:
        remedy = "check the orientation (cityflow catalog check), or give more room with --set bound_px=…"
        raise CatalogError(str(error), where="the images' ties", remedy=remedy) from error
    text, summary = encode_refinement(found)
    workspace.write(POINTS_FILE, encode_points(found))
    workspace.write(BLOCK_TIES_FILE, encode_block_ties(found))
    workspace.write(BLOCK_FILE, json.dumps(text, sort_keys=True, separators=(",", ":"), allow_nan=False).encode())
    return workspace.outcome(result=summary)


TIES_KIND = TaskKind(TIES, VERSION, run_ties, TieInputs)
ADJUST_KIND = TaskKind(ADJUST, ADJUST_VERSION, run_adjust, BlockInputs)
FEATURES_KIND = TaskKind(FEATURES, VERSION, run_features, FeatureInputs)

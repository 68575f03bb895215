"""Stages of ``cityflow orient`` for photographs without poses: features of each image, pairs of the survey, matches of each image with its partners, the
mapping of all."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from pydantic import Field

from cityflow.adjustment.coarse_registration import RegistrationParameters
from cityflow.adjustment.descriptor_matching import MatchingParameters, mutual_matches, unit_descriptors
from cityflow.adjustment.features import FeatureParameters
from cityflow.adjustment.frame_choice import FrameParameters
from cityflow.adjustment.mapping import MappingInput, mapped
from cityflow.adjustment.mapping_process import GLOBAL, INCREMENTAL
from cityflow.adjustment.pair_geometry import pair_geometry, pycolmap_camera
from cityflow.adjustment.vocabulary import sampled, similarity, vocabulary, word_counts
from cityflow.core.building import Status
from cityflow.core.camera import Camera
from cityflow.core.json_values import rounded
from cityflow.core.parameters import Parameters
from cityflow.errors import CatalogError
from cityflow.flow.task import Json, Limits, Outcome, Record, Task, digest_of
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.mapped_models import encode_models
from cityflow.handover.source_file import SourceFile
from cityflow.handover.tie_files import decode_features, decode_geometries, encode_geometries
from cityflow.orientation.photo_pairs import PhotoPairParameters, photo_pairs
from cityflow.stages.orient import BLOCK, FEATURES, ONE_IMAGE, feature_task

PAIRS, MATCHES, MAP = "pairs", "matches", "map"
PHOTO_STAGES = (FEATURES, PAIRS, MATCHES, MAP)
VERSION, MAP_VERSION = 1, 3
PAIRS_FILE, MATCHES_FILE, MODELS_FILE = "pairs.json", "matches.bin", "models.bin"
WHOLE_SURVEY = Limits(time_s=24 * 3600, memory_mb=16000)


class MapParameters(Parameters):
    """How all are mapped."""

    calibration: Literal["radial", "full"] = Field(
        "radial",
        description="of each camera: focal length and two radial terms; or also principal point and decentring",
    )


class PhotoParameters(MapParameters):
    """How photographs without poses are oriented."""

    features: FeatureParameters = FeatureParameters()
    pairs: PhotoPairParameters = PhotoPairParameters()
    frames: FrameParameters = FrameParameters()
    sequence: bool = Field(False, description="photographs follow one another by name: some are chosen, as of a video")
    matching: MatchingParameters = MatchingParameters()
    registration: RegistrationParameters = RegistrationParameters()


@dataclass(frozen=True, slots=True)
class PhotoCamera(TaskInputs):
    """What files say of a camera; `is_known`: whether the focal length (pixels) is more than a guess."""

    width: int
    height: int
    focal_px: float
    is_known: bool

    @property
    def start(self) -> tuple[Camera, bool]:
        """The camera from which the mapping starts."""
        return (
            Camera(self.width, self.height, self.focal_px, self.focal_px, self.width / 2, self.height / 2),
            self.is_known,
        )


@dataclass(frozen=True, slots=True)
class Photo(TaskInputs):
    """A photograph; `camera`: its number; `place`: where it looks, or was taken, metres in any frame; `white`: the value that is shown as white."""

    name: str
    file: SourceFile
    camera: int
    place: tuple[float, float, float] | None = None
    white: float = 255.0


@dataclass(frozen=True, slots=True)
class PairInputs(TaskInputs):
    """Photographs with RUN-relative paths of their features; `in_sequence`: they are chosen frames."""

    photos: tuple[Photo, ...]
    features: tuple[str, ...]
    in_sequence: bool = False


@dataclass(frozen=True, slots=True)
class MatchInputs(TaskInputs):
    """The first photograph is matched with each of the others."""

    photos: tuple[Photo, ...]
    features: tuple[str, ...]
    cameras: tuple[PhotoCamera, ...]


@dataclass(frozen=True, slots=True)
class MapInputs(TaskInputs):
    """All photographs with points; names of those with partners, and RUN-relative paths of their matches; `in_sequence` as in `PairInputs`."""

    photos: tuple[Photo, ...]
    features: tuple[str, ...]
    cameras: tuple[PhotoCamera, ...]
    matched: tuple[str, ...]
    matches: tuple[str, ...]
    in_sequence: bool = False


@dataclass
class PhotoSource:
    """The tasks of one mapping: features of all, pairs, matches of each image, the map.

    Parameters
    ----------
    photos : in the order of their names;  cameras : by their number
    in_sequence : the photographs are chosen frames, in the order of their names
    read : contents of a file by its RUN-relative path
    """

    photos: tuple[Photo, ...]
    cameras: tuple[PhotoCamera, ...]
    parameters: PhotoParameters
    read: Callable[[str], bytes]
    in_sequence: bool = False
    partners: dict[str, list[str]] = field(default_factory=dict, init=False)
    _features: dict[str, Record] = field(default_factory=dict, init=False)
    _matches: dict[str, Record] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self._photo = {p.name: p for p in self.photos}

    def initial(self) -> Iterator[Task]:
        """Features of all photographs."""
        for photo in self.photos:
            camera = self.cameras[photo.camera]
            size = camera.width, camera.height
            yield feature_task(photo.name, photo.file, size, photo.white, self.parameters.features)

    def after(self, task: Task, record: Record) -> Iterable[Task]:
        """The pairs when all features are there, matches of all images when the pairs are, the map when all matches are."""
        if task.stage == FEATURES:
            self._features[task.unit] = record
            return [self._pairs()] if len(self._features) == len(self.photos) else []
        if task.stage == PAIRS:
            if record.status is not Status.FAILED:
                self.partners = json.loads(self.read(next(iter(record.outputs))))
            return [self._match(name) for name in self.partners] if self.partners else []
        if task.stage == MATCHES:
            self._matches[task.unit] = record
            return [self._map()] if len(self._matches) == len(self.partners) else []
        return []

    def _pairs(self) -> Task:
        names = self._with_points()
        photos = tuple(self._photo[n] for n in names)
        return PAIRS_KIND.task(
            BLOCK, parameters=as_json(self.parameters.pairs),
            inputs={
                **{f"photograph {p.name}": digest_of([self._features_digest(p.name), list(p.place or ())]) for p in photos},
                **({"sequence": digest_of(True)} if self.in_sequence else {}),
            }, given=PairInputs(photos, self._paths(names), self.in_sequence), limits=WHOLE_SURVEY,
        )  # fmt: skip

    def _match(self, name: str) -> Task:
        names = [name, *self.partners[name]]
        photos = tuple(self._photo[n] for n in names)
        return MATCHES_KIND.task(
            name, parameters=as_json(self.parameters.matching), inputs={f"photograph {n}": self._digest(n) for n in names},
            given=MatchInputs(photos, self._paths(names), self.cameras), limits=ONE_IMAGE,
        )  # fmt: skip

    def _map(self) -> Task:
        names = self._with_points()
        done = {n: r for n, r in sorted(self._matches.items()) if r.status is not Status.FAILED}
        photos = tuple(self._photo[n] for n in names)
        paths = tuple(next(iter(r.outputs)) for r in done.values())
        return MAP_KIND.task(
            BLOCK, parameters=as_json(MapParameters(calibration=self.parameters.calibration)),
            inputs={
                **{f"photograph {n}": self._digest(n) for n in names},
                **{f"matches {n}": digest_of(list(r.outputs.values())) for n, r in done.items()},
                **({"sequence": digest_of(True)} if self.in_sequence else {}),
            },
            given=MapInputs(photos, self._paths(names), self.cameras, tuple(done), paths, self.in_sequence), limits=WHOLE_SURVEY,
        )  # fmt: skip

    def _with_points(self) -> list[str]:
        return [p.name for p in self.photos if self._features[p.name].status is not Status.FAILED]

    def _paths(self, names: Iterable[str]) -> tuple[str, ...]:
        return tuple(next(iter(self._features[n].outputs)) for n in names)

    def _features_digest(self, name: str) -> str:
        return digest_of(list(self._features[name].outputs.values()))

    def _digest(self, name: str) -> str:
        """Of features and camera; cameras are equal where all their values and their number are."""
        number = self._photo[name].camera
        return digest_of([self._features_digest(name), number, as_json(self.cameras[number])])


def run_pairs(workspace: Workspace, task: Task) -> Outcome:
    """Partners of each photograph, each pair once.

    Raises
    ------
    CatalogError
        Fewer than two photographs have points.
    """
    given = task.arguments_as(PairInputs)
    count = len(given.photos)
    if count < 2:
        raise CatalogError("fewer than two photographs can be used", remedy="see what is reported of the others")
    sample = [sampled(unit_descriptors(decode_features(workspace.read(p))), count) for p in given.features]
    words = vocabulary(np.concatenate(sample))
    counts = [word_counts(unit_descriptors(decode_features(workspace.read(p))), words) for p in given.features]
    places = np.array([p.place or (np.nan,) * 3 for p in given.photos], np.float64)
    pairs = photo_pairs(
        similarity(np.array(counts)), places, task.parameters_as(PhotoPairParameters), given.in_sequence
    )
    partners: dict[str, list[str]] = {}
    for one, other in pairs:
        partners.setdefault(given.photos[one].name, []).append(given.photos[other].name)
    workspace.write(PAIRS_FILE, json.dumps(partners, sort_keys=True).encode())
    return workspace.outcome(result={"pairs": len(pairs), "possible": count * (count - 1) // 2})


def run_matches(workspace: Workspace, task: Task) -> Outcome:
    """Matches of one photograph with its partners that agree with one epipolar geometry."""
    given, parameters = task.arguments_as(MatchInputs), task.parameters_as(MatchingParameters)
    features = [decode_features(workspace.read(path)) for path in given.features]
    cameras = [pycolmap_camera(*given.cameras[p.camera].start) for p in given.photos]
    agreed, found = {}, 0
    for photo, theirs, camera in list(zip(given.photos, features, cameras, strict=True))[1:]:
        matches = mutual_matches(features[0], theirs, parameters)
        found += len(matches)
        geometry = pair_geometry((cameras[0], camera), (features[0].uv, theirs.uv), matches)
        if geometry is not None:
            agreed[photo.name] = geometry
    workspace.write(MATCHES_FILE, encode_geometries(agreed))
    total = sum(len(g.matches) for g in agreed.values())
    return workspace.outcome(
        result={"pairs": len(given.photos) - 1, "verified": len(agreed), "matches": found, "agreed": total}
    )


def run_map(workspace: Workspace, task: Task) -> Outcome:
    """Models of all photographs that hang together.

    Raises
    ------
    CatalogError
        The processes of all methods of mapping died.
    """
    given = task.arguments_as(MapInputs)
    number = {p.name: k for k, p in enumerate(given.photos)}
    pairs = {
        (number[name], number[other]): geometry
        for name, path in zip(given.matched, given.matches, strict=True)
        for other, geometry in decode_geometries(workspace.read(path)).items()
    }
    points = [decode_features(workspace.read(path)).uv for path in given.features]
    found = mapped(
        MappingInput([c.start for c in given.cameras], [p.camera for p in given.photos], points, pairs),
        task.parameters_as(MapParameters).calibration,
        # frames follow one another by small steps, of a camera that no file describes: one after the other is surer
        (INCREMENTAL, GLOBAL) if given.in_sequence else (GLOBAL, INCREMENTAL),
    )
    if found.failures and not found.models:
        raise CatalogError("; ".join(found.failures), remedy="try fewer photographs, or give the machine more memory")
    workspace.write(MODELS_FILE, encode_models(found.models))
    first = found.models[0] if found.models else None
    result: dict[str, Json] = {
        "models": [len(m.images) for m in found.models], "method": found.method, "failures": list(found.failures), "verified_pairs": len(pairs),
        "doubles": [[given.photos[k].name, given.photos[of].name] for k, of in sorted(found.doubles.items())],
        "photographs": [p.name for p in given.photos], "points": [len(p) for p in points],
        "pairs_of": np.bincount(np.array(list(pairs), np.int64).reshape(-1), minlength=len(points)).tolist(),
        "tie_points": len(first.xyz) if first else 0,
        "reprojection_px": rounded(first.reprojection_px, 4) if first else None,
    }  # fmt: skip
    return workspace.outcome(result=result)


PAIRS_KIND = TaskKind(PAIRS, VERSION, run_pairs, PairInputs)
MATCHES_KIND = TaskKind(MATCHES, VERSION, run_matches, MatchInputs)
MAP_KIND = TaskKind(MAP, MAP_VERSION, run_map, MapInputs)

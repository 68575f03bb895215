"""Poses from verified pairs alone: a database for COLMAP, and its mapping in a process of its own, with one thread and fixed seeds."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cityflow.adjustment.mapping_process import CALIBRATED, GLOBAL, INCREMENTAL
from cityflow.adjustment.pair_geometry import PairGeometry, pycolmap_camera
from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.camera import Camera, OrientedImage

if TYPE_CHECKING:
    import pycolmap

DATABASE, MODELS = "database.db", "models"
ENOUGH = 0.95
"""Share of the images with verified pairs that a mapping must orient, else the other method is tried; set by hand, as are those below."""
MOST_ERROR_PX = 1.5
"""A mapping with a larger mean reprojection error has failed."""
SAME_PX, SAME_SHARE = 1.0, 0.5
"""Two images that have more than this share of their points in the same place are one picture."""
LAST_LINES = 4
"""Of a mapping that died, that are told."""


@dataclass(frozen=True, slots=True)
class MappedModel:
    """Images that hang together, in a frame of their own: no scale, no place, no direction.

    Attributes
    ----------
    numbers : of the images, ascending;  images : in the same order
    xyz : (P, 3) tie points;  lengths : (P,) images that show each;  errors_px : (P,) mean reprojection error of each
    observations : (N,) tie points of each image
    tracks : (M, 3) where they show them: number of the tie point, of the image, of the point among the image's points
    focal_sigmas : number of a camera → standard deviation of its focal length, pixels; None where the scene leaves it open, and it was held
    """

    numbers: tuple[int, ...]
    images: tuple[OrientedImage, ...]
    xyz: FloatArray
    lengths: IntArray
    errors_px: FloatArray
    observations: IntArray
    tracks: IntArray
    focal_sigmas: Mapping[int, float | None]

    @property
    def reprojection_px(self) -> float:
        """Mean over all tie points, as COLMAP counts it."""
        return float(np.mean(self.errors_px)) if len(self.errors_px) else 0.0


@dataclass(frozen=True, slots=True)
class MappingInput:
    """What a mapping starts from.

    Attributes
    ----------
    cameras : with whether the focal length is more than a guess;  camera_of : number of each image's camera
    points : of each image (N, 2) image coordinates, pixels
    pairs : (number of an image, of another) → what agrees
    """

    cameras: Sequence[tuple[Camera, bool]]
    camera_of: Sequence[int]
    points: Sequence[FloatArray]
    pairs: Mapping[tuple[int, int], PairGeometry]


@dataclass(frozen=True, slots=True)
class Mapped:
    """The outcome: models, the largest first; which method made them; image → the one that it is a double of; how processes of methods died."""

    models: tuple[MappedModel, ...]
    method: str
    doubles: Mapping[int, int]
    failures: tuple[str, ...] = ()


class MappingDiedError(RuntimeError):
    """The process of a mapping ended with an error; its message says how, with the last lines that it printed."""


def mapped(given: MappingInput, calibration: str, methods: Sequence[str] = (GLOBAL, INCREMENTAL)) -> Mapped:
    """Map all images by the first method, by the second where that fails, and keep what has more images.

    Parameters
    ----------
    methods : the first of them is tried first
    calibration : ``radial`` or ``full``, see `mapping_process`
    """
    doubles = doubles_of(given)
    pairs = {k: g for k, g in given.pairs.items() if not set(k) & set(doubles)}
    linked = len({n for pair in pairs for n in pair})
    if not linked:
        return Mapped((), methods[0], doubles)
    with tempfile.TemporaryDirectory(prefix="cityflow-") as folder:
        best: list[MappedModel] = []
        method, failures = methods[0], []
        for tried in methods:
            place = Path(folder) / tried
            place.mkdir()
            write_database(place / DATABASE, replace(given, pairs=pairs))
            try:
                models = map_database(place, tried, calibration)
            except MappingDiedError as error:
                failures.append(str(error))
                continue
            if not best or (models and len(models[0].images) > len(best[0].images)):
                best, method = models, tried
            if sum(len(m.images) for m in best) >= ENOUGH * linked and best[0].reprojection_px < MOST_ERROR_PX:
                break
    return Mapped(tuple(best), method, doubles, tuple(failures))


def doubles_of(given: MappingInput) -> dict[int, int]:
    """Images that show the same pixels as an earlier one: most points of either match, in the same place."""
    doubles: dict[int, int] = {}
    for (one, other), pair in sorted(given.pairs.items()):
        fewer = min(len(given.points[one]), len(given.points[other]))
        away = given.points[one][pair.matches[:, 0]] - given.points[other][pair.matches[:, 1]]
        same = np.linalg.norm(away, axis=1) < SAME_PX
        if same.sum() > SAME_SHARE * fewer and one not in doubles:
            doubles.setdefault(other, one)
    return doubles


def write_database(path: Path, given: MappingInput) -> None:
    """A database with points and verified pairs; image k has the id k + 1 and the name of its number."""
    import pycolmap

    database = pycolmap.Database.open(path)
    rigs = {}
    for number, (camera, is_known) in enumerate(given.cameras, 1):
        theirs = pycolmap_camera(camera, is_known)
        theirs.camera_id = number
        database.write_camera(theirs, use_camera_id=True)
        rig = pycolmap.Rig(rig_id=number)
        rig.add_ref_sensor(theirs.sensor_id)
        rigs[number] = database.write_rig(rig, use_rig_id=True)
    for number, (uv, camera_number) in enumerate(zip(given.points, given.camera_of, strict=True), 1):
        image = pycolmap.Image(name=f"{number:06d}", camera_id=camera_number + 1, image_id=number)
        database.write_image(image, use_image_id=True)
        frame = pycolmap.Frame(frame_id=number, rig_id=camera_number + 1)
        frame.add_data_id(image.data_id)
        database.write_frame(frame, use_frame_id=True)
        database.write_keypoints(number, np.asarray(uv, np.float32))
    for (one, other), pair in sorted(given.pairs.items()):
        database.write_matches(one + 1, other + 1, pair.matches.astype(np.uint32))
        database.write_two_view_geometry(one + 1, other + 1, _geometry(pair))
    database.close()


def _geometry(pair: PairGeometry) -> pycolmap.TwoViewGeometry:
    import pycolmap

    geometry = pycolmap.TwoViewGeometry()
    geometry.config = pycolmap.TwoViewGeometryConfiguration(pair.kind)
    geometry.inlier_matches = pair.matches.astype(np.uint32)
    for name, matrix in zip("EFH", pair.matrices, strict=True):
        if matrix.any():
            setattr(geometry, name, matrix)
    if pair.pose.any():
        geometry.cam2_from_cam1 = pycolmap.Rigid3d(pair.pose)
    return geometry


def map_database(folder: Path, method: str, calibration: str) -> list[MappedModel]:
    """The models of the database in a folder, the largest first; none where nothing hangs together.

    Parameters
    ----------
    method : ``global`` or ``incremental``

    Raises
    ------
    MappingDiedError
        The process of the mapping ended with an error, and left no model.
    """
    out = folder / MODELS
    out.mkdir(exist_ok=True)
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    command = [
        sys.executable,
        "-m",
        "cityflow.adjustment.mapping_process",
        str(folder / DATABASE),
        str(out),
        method,
        calibration,
    ]
    ended = subprocess.run(
        command, env={**os.environ, **one_thread}, capture_output=True, check=False, text=True, errors="replace"
    )
    models = [_model(place) for place in sorted(out.iterdir()) if (place / CALIBRATED).exists()]
    found = sorted((m for m in models if m.images), key=lambda m: (-len(m.images), m.numbers))
    if ended.returncode and not found:
        raise MappingDiedError(_last_words(method, ended.returncode, ended.stderr))
    return found


def _last_words(method: str, code: int, printed: str) -> str:
    """How a process ended: killed by a signal or with an exit code, and the last lines that it printed."""
    how = f"was killed by signal {-code} ({signal.Signals(-code).name})" if code < 0 else f"ended with exit code {code}"
    lines = [line.strip() for line in printed.splitlines() if line.strip()]
    # lines of a trace name places in files, the last line says what happened
    told = " / ".join(lines[-LAST_LINES:]) or "it printed nothing"
    memory = ": out of memory?" if code == -signal.SIGKILL else ""
    return f"the {method} mapping {how}{memory}; its last lines: {told}"


def _model(folder: Path) -> MappedModel:
    import pycolmap

    theirs = pycolmap.Reconstruction(folder)
    cameras = {number: _camera(camera) for number, camera in theirs.cameras.items()}
    numbers = sorted(n for n, image in theirs.images.items() if image.has_pose)
    images = []
    for number in numbers:
        image = theirs.images[number]
        matrix = np.asarray(image.cam_from_world().matrix())
        rotation = matrix[:, :3]
        images.append(OrientedImage(image.name, cameras[image.camera_id], rotation, -rotation.T @ matrix[:, 3]))
    points = [theirs.points3D[k] for k in sorted(theirs.points3D)]
    return MappedModel(
        tuple(n - 1 for n in numbers), tuple(images),
        np.array([p.xyz for p in points], np.float64).reshape(-1, 3),
        np.array([p.track.length() for p in points], np.int64),
        np.array([p.error for p in points], np.float64),
        np.array([theirs.images[n].num_points3D for n in numbers], np.int64),
        np.array(
            [(k, e.image_id - 1, e.point2D_idx) for k, p in enumerate(points) for e in p.track.elements], np.int64
        ).reshape(-1, 3),
        {int(n) - 1: None if c["held"] else c["sigma_px"] for n, c in json.loads((folder / CALIBRATED).read_text()).items()},
    )  # fmt: skip


def _camera(theirs: pycolmap.Camera) -> Camera:
    single = len(theirs.focal_length_idxs()) == 1
    fx, fy, cx, cy, *lens = (theirs.params[0], *theirs.params) if single else theirs.params
    distortion = (*lens, 0.0, 0.0, 0.0, 0.0)[:4] if any(lens) else ()
    return Camera(
        theirs.width, theirs.height, float(fx), float(fy), float(cx), float(cy), tuple(map(float, distortion))
    )

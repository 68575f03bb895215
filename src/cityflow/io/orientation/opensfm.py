"""``reconstruction.json`` of OpenSfM and OpenDroneMap: cameras in shares of the image's longer side, poses in metres east, north and up of a place.

A shot is camera_from_world as an axis times an angle, and a translation; x right, y down, z forward. Shares count from the middle of the image.
OpenDroneMap overwrites the file with coordinates of UTM less an offset, whose north is another, and keeps OpenSfM's own as `TOPOCENTRIC` beside
(``stages/run_opensfm.py``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from pyproj import CRS, Transformer
from scipy.spatial.transform import Rotation

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import FISHEYE, PERSPECTIVE, Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.io.given_files import MODEL_MB, check_plain, json_of
from cityflow.io.orientation.geocentric import geocentric_to_map, on_map
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile

TOPOCENTRIC = "reconstruction.topocentric.json"
AGAIN = "name the file reconstruction.json of the folder opensfm"
TERMS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "perspective": (PERSPECTIVE, ("k1", "k2")), "simple_radial": (PERSPECTIVE, ("k1",)), "radial": (PERSPECTIVE, ("k1", "k2")),
    "brown": (PERSPECTIVE, ("k1", "k2", "p1", "p2", "k3")),
    "fisheye": (FISHEYE, ("k1", "k2")), "fisheye_opencv": (FISHEYE, ("k1", "k2", "k3", "k4")),
}  # fmt: skip
"""Kind of camera and its terms, in OpenCV's order, by ``projection_type``."""


@dataclass(frozen=True, slots=True)
class _World:
    """From metres east, north and up of a place to the catalog's CRS; as they are where there is neither."""

    to_geocentric: Transformer | None = None
    to_map: Transformer | None = None

    @classmethod
    def of(cls, place: Mapping[str, float] | None, target: CRS | None) -> _World:
        if place is None or target is None:
            return cls()
        lat, lon, alt = (float(place[k]) for k in ("latitude", "longitude", "altitude"))
        ellipsoid = f"+ellps=WGS84 +lat_0={lat!r} +lon_0={lon!r} +h_0={alt!r}"
        pipeline = f"+proj=pipeline +step +inv +proj=topocentric {ellipsoid}"
        return cls(Transformer.from_pipeline(pipeline), geocentric_to_map(CRS.from_epsg(4979), target))

    def placed(self, centre: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """World centre and (3, 3) world_from_camera of a pose."""
        if self.to_geocentric is None or self.to_map is None:
            return centre, axes
        corners = np.stack(self.to_geocentric.transform(*np.vstack([np.zeros(3), np.eye(3), centre]).T), axis=1)
        return on_map(self.to_map, corners[4], (corners[1:4] - corners[0]).T @ axes)

    def points(self, xyz: FloatArray) -> FloatArray:
        if self.to_geocentric is None or self.to_map is None or not len(xyz):
            return xyz
        return np.stack(self.to_map.transform(*self.to_geocentric.transform(*xyz.T)), axis=1)


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`: all models of the file, or of `TOPOCENTRIC` beside it."""
    original = given.path.with_name(TOPOCENTRIC)
    if given.path.name != TOPOCENTRIC and original.is_file():
        given = replace(given, path=original)
    parts = _parts(given.path)
    images: list[OrientedImage] = []
    left_out: list[LeftOut] = []
    sparse, placed = [np.empty((0, 3))], True
    try:
        for part in parts:
            place = part.get("reference_lla") or _beside(given.path)
            placed &= place is not None
            world = _World.of(place, given.target)
            cameras = part.get("cameras", {})
            for name, shot in part.get("shots", {}).items():
                outcome = _image(name, shot, cameras, world)
                (images if isinstance(outcome, OrientedImage) else left_out).append(outcome)  # type: ignore[arg-type]
            points = [p["coordinates"] for p in part.get("points", {}).values()]
            sparse.append(world.points(np.array(points, np.float64).reshape(-1, 3)))
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        problem = f"the file is damaged ({type(error).__name__}: {error})"
        raise CatalogError(problem, where=str(given.path), remedy=AGAIN) from error
    kept, twice = in_order(images)
    return OrientationModel(
        kept, np.concatenate(sparse), (*left_out, *twice), _notes(given, parts, placed)
    )  # fmt: skip


def _notes(given: OrientationFile, parts: Sequence[Mapping[str, Any]], placed: bool) -> tuple[str, ...]:
    notes, shots = [], [len(p.get("shots", {})) for p in parts]
    if len(shots) > 1:
        listed = ", ".join(map(str, shots))
        notes.append(
            f"{given.path.name} has {len(shots)} separate models ({listed} images), which fit each other no better than their positions → "
            "check that the flights overlap"
        )
    if given.target is not None and not placed:
        notes.append(
            f"{given.path.name} has no reference_lla: its coordinates are taken as those of the CRS → check --crs"
        )
    elif given.target is not None:
        if given.path.name != TOPOCENTRIC and all((p.get("reference_lla") or {}).get("altitude") == 0 for p in parts):
            notes.append(
                f"{given.path.name} counts heights from 0, as OpenDroneMap does, which writes UTM less an offset into this file → if it did, "
                f"name {TOPOCENTRIC}, or leave it beside"
            )
        notes.append(
            "heights of OpenSfM are those of the images' GPS, taken as ellipsoidal; check them against known points"
        )
    return tuple(notes)


def _parts(path: Path) -> list[dict[str, Any]]:
    check_plain(path, MODEL_MB)
    try:
        tree = json_of(path.read_bytes())
    except (OSError, ValueError) as error:
        raise CatalogError(f"the file cannot be read ({error})", where=str(path), remedy=AGAIN) from error
    parts = tree if isinstance(tree, list) else [tree]
    if not parts or not all(isinstance(p, dict) and "shots" in p for p in parts):
        raise CatalogError("the file holds no reconstruction with shots", where=str(path), remedy=AGAIN)
    return parts


def _beside(path: Path) -> dict[str, float] | None:
    """The place of all models, where it is a file of its own."""
    other = path.with_name("reference_lla.json")
    return json_of(other.read_bytes()) if other.is_file() else None


def _image(name: str, shot: Mapping[str, Any], cameras: Mapping[str, Any], world: _World) -> OrientedImage | LeftOut:
    key = shot.get("camera", "")
    if key not in cameras:
        return LeftOut(name, f"the model has no camera {key!r}")
    try:
        camera = _camera(cameras[key])
        turn, move = (np.array([float(v) for v in shot[k]]) for k in ("rotation", "translation"))
        if turn.shape != (3,) or move.shape != (3,) or not np.isfinite([turn, move]).all():
            raise ValueError(f"rotation {shot['rotation']} and translation {shot['translation']} are no pose")
    except (KeyError, TypeError, ValueError) as error:
        return LeftOut(name, f"camera {key}: {error}" if not isinstance(error, KeyError) else f"it has no {error}")
    rotation = Rotation.from_rotvec(turn).as_matrix()
    centre, axes = world.placed(-rotation.T @ move, rotation.T)
    if not np.isfinite(centre).all():
        return LeftOut(name, "its place lies outside the CRS", "check --crs")
    return OrientedImage(name, camera, axes.T, centre, str(key))


def _camera(values: Mapping[str, Any]) -> Camera:
    kind = str(values.get("projection_type", ""))
    if kind not in TERMS:
        raise ValueError(f"a camera of the type {kind!r} cannot be undistorted here")
    width, height = int(values["width"]), int(values["height"])
    size = max(width, height)
    fx = float(values["focal_x"] if "focal_x" in values else values["focal"])
    fy = float(values["focal_y"]) if "focal_y" in values else fx * float(values.get("aspect_ratio", 1.0))
    cx, cy = (float(values.get(k, 0.0)) for k in ("c_x", "c_y"))
    if width <= 0 or height <= 0 or not fx > 0 or not fy > 0:
        raise ValueError(f"{width} × {height} pixels and a focal length of {fx:g} are no camera")
    model, names = TERMS[kind]
    terms = tuple(float(values.get(n, 0.0)) for n in names)
    if model == PERSPECTIVE:
        terms = (*terms, 0.0, 0.0, 0.0, 0.0)[: max(len(terms), 4)] if any(terms) else ()
    return Camera(width, height, fx * size, fy * size, width / 2 + cx * size, height / 2 + cy * size, terms, model)

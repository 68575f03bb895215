"""Cameras of a survey from a small file: JSON or YAML with a list of them, or CSV with a line for each.

Focal length, principal point and distortion may each be in pixels or in millimetres on the sensor.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import FISHEYE, Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import PHOTO_FLIP, from_omega_phi_kappa
from cityflow.io.given_files import json_of, read_small, yaml_of
from cityflow.io.orientation.camera_calibration import (
    australis_camera,
    metashape_camera,
    metashape_fisheye,
    with_distortion,
)

TERMS = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "b1", "b2")
REMEDY = "see docs/catalog.md for the keys of a camera"


class CameraEntry(BaseModel):
    """One camera as people write it down."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, coerce_numbers_to_str=True)

    id: str
    width: int = Field(gt=0, description="pixels")
    height: int = Field(gt=0, description="pixels")
    focal_px: float | None = Field(default=None, gt=0)
    focal_mm: float | None = Field(default=None, gt=0)
    pixel_mm: float | None = Field(default=None, gt=0, lt=1, description="size of a pixel on the sensor")
    cx: float | None = Field(default=None, description="principal point, pixels from the corner of the first pixel")
    cy: float | None = None
    offset_x_mm: float | None = Field(default=None, description="principal point right of the image's centre")
    offset_y_mm: float | None = Field(default=None, description="principal point above the image's centre")
    offset_x_px: float | None = Field(default=None, description="principal point right of the image's centre")
    offset_y_px: float | None = Field(default=None, description="principal point below the image's centre")
    distortion: Literal["none", "opencv", "fisheye", "metashape", "metashape-fisheye", "australis"] = "opencv"
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    b1: float = 0.0
    b2: float = 0.0
    mount_omega: float = Field(
        default=0.0,
        description="degrees; the camera's axes against those that the angles turn: boresight, oblique heads",
    )
    mount_phi: float = 0.0
    mount_kappa: float = 0.0
    turn_deg: Literal[0, 90, 180, 270] = Field(default=0, description="pictures are stored turned clockwise by so much")
    images: str = Field(default="", description="pattern of its images' names, such as left_*; several with |")

    @model_validator(mode="after")
    def _complete(self) -> CameraEntry:
        if (self.focal_px is None) == (self.focal_mm is None):
            raise ValueError("give either focal_px, or focal_mm with pixel_mm")
        millimetres = self.focal_mm is not None or self.offset_x_mm is not None or self.distortion == "australis"
        if millimetres and self.pixel_mm is None:
            raise ValueError("lengths in mm need pixel_mm, the size of a pixel")
        pairs = (
            (self.cx, self.cy),
            (self.offset_x_mm, self.offset_y_mm),
            (self.offset_x_px, self.offset_y_px),
        )
        if any((a is None) != (b is None) for a, b in pairs):
            raise ValueError("a principal point has two coordinates")
        if sum(a is not None for a, _ in pairs) > 1:
            raise ValueError("give the principal point once: as cx, cy or as an offset from the image's centre")
        return self

    @property
    def camera(self) -> Camera:
        """The camera in pixels; raises ValueError where its distortion cannot be expressed."""
        focal = self.focal_px if self.focal_px is not None else (self.focal_mm or 0.0) / (self.pixel_mm or 1.0)
        plain = Camera(self.width, self.height, focal, focal, *self._principal_point())
        terms = {name: float(getattr(self, name)) for name in TERMS}
        if self.distortion == "metashape":
            return metashape_camera(plain, terms)
        if self.distortion == "metashape-fisheye":
            return metashape_fisheye(plain, terms)
        if self.distortion == "australis":
            return australis_camera(plain, self.pixel_mm or 1.0, terms)
        if self.distortion == "fisheye":
            k = (self.k1, self.k2, self.k3, self.k4)
            return Camera(plain.width, plain.height, plain.fx, plain.fy, plain.cx, plain.cy, k, FISHEYE)
        return plain if self.distortion == "none" else with_distortion(plain, self._opencv())

    @property
    def mount(self) -> FloatArray:
        """(3, 3) rotation from the axes that the table's angles turn to those of the camera with its pixels as stored."""
        angles = np.radians([self.mount_omega, self.mount_phi, self.mount_kappa])
        quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        return (
            np.linalg.matrix_power(quarter, self.turn_deg // 90) @ from_omega_phi_kappa(*angles.tolist()) @ PHOTO_FLIP
        )

    def _principal_point(self) -> tuple[float, float]:
        if self.cx is not None and self.cy is not None:
            return self.cx, self.cy
        x, y = self.width / 2, self.height / 2
        if self.offset_x_px is not None and self.offset_y_px is not None:
            return x + self.offset_x_px, y + self.offset_y_px
        if self.offset_x_mm is not None and self.offset_y_mm is not None and self.pixel_mm is not None:
            return x + self.offset_x_mm / self.pixel_mm, y - self.offset_y_mm / self.pixel_mm
        return x, y

    def _opencv(self) -> tuple[float, ...]:
        first, rational = (self.k1, self.k2, self.p1, self.p2), (self.k4, self.k5, self.k6)
        if any(rational):
            return (*first, self.k3, *rational)
        return (*first, self.k3) if self.k3 else first


@dataclass(frozen=True, slots=True)
class CameraTable:
    """Cameras by id, sizes of their pixels in mm, patterns of their images' names, those that cannot be used with the reason, `CameraEntry.mount`s."""

    cameras: Mapping[str, Camera]
    pixel_mm: Mapping[str, float]
    patterns: Mapping[str, str]
    refused: Mapping[str, str]
    mounts: Mapping[str, FloatArray] = field(default_factory=dict)

    def image(self, name: str, given: str, rotation: FloatArray, centre: FloatArray) -> tuple[OrientedImage, str]:
        """An image with its camera and mount, and the camera's id.

        Parameters
        ----------
        given : id of the camera, where the orientation names it
        rotation : (3, 3) camera_from_world of a camera without a mount;  centre : (3,) world metres

        Raises
        ------
        ValueError
            As `id_for`.
        """
        camera = self.id_for(name, given)
        mount = self.mounts.get(camera)
        turned = rotation if mount is None else mount @ rotation
        return OrientedImage(name, self.cameras[camera], turned, centre, camera), camera

    def id_for(self, image: str, given: str = "") -> str:
        """Id of an image's camera: the one given, else by its pattern, else the only one.

        Raises
        ------
        ValueError
            Where none is meant, or it cannot be used.
        """
        known = {**dict.fromkeys(self.cameras), **dict.fromkeys(self.refused)}
        chosen = [given] if given else self._by_pattern(image)
        if not chosen and len(known) == 1:
            chosen = list(known)
        if len(chosen) != 1 or chosen[0] not in known:
            listed = ", ".join(known)
            raise ValueError(
                f"no camera {given!r} among {listed}" if given else f"none or several of the cameras {listed} are meant"
            )
        if chosen[0] in self.refused:
            raise ValueError(f"camera {chosen[0]}: {self.refused[chosen[0]]}")
        return chosen[0]

    def _by_pattern(self, image: str) -> list[str]:
        plain = Path(image.replace("\\", "/"))
        forms = (image, plain.name, plain.stem)
        return [
            camera
            for camera, pattern in self.patterns.items()
            if any(fnmatchcase(form, part.strip()) for part in pattern.split("|") for form in forms)
        ]


def named_cameras(options: Mapping[str, str], path: Path) -> CameraTable:
    """The cameras that ``--cameras`` names, for orientations that have none of their own; raises CatalogError where it is missing."""
    if "cameras" not in options:
        raise CatalogError(
            "the orientation has no cameras",
            where=str(path),
            remedy="name them with --cameras FILE; see docs/catalog.md",
        )
    return read_camera_table(options["cameras"])


def read_camera_table(path: str | Path) -> CameraTable:
    """Cameras from JSON, YAML or CSV.

    Raises
    ------
    CatalogError
        Where the file is missing, or a camera lacks something or has a key that none has.
    """
    entries: dict[str, CameraEntry] = {}
    for number, tree in enumerate(_entries(Path(path)), 1):
        try:
            entry = CameraEntry.model_validate(tree)
        except ValidationError as error:
            first = error.errors()[0]
            key = ".".join(str(k) for k in first["loc"])
            problem = f"camera {tree.get('id', number)}: {key + ': ' if key else ''}{first['msg']}"
            raise CatalogError(problem, where=str(path), remedy=REMEDY) from error
        if entry.id in entries:
            raise CatalogError(f"camera {entry.id} is there twice", where=str(path), remedy="give each its own id")
        entries[entry.id] = entry
    if not entries:
        raise CatalogError("no camera in the file", where=str(path), remedy=REMEDY)
    return _table(entries)


def _table(entries: Mapping[str, CameraEntry]) -> CameraTable:
    cameras: dict[str, Camera] = {}
    refused: dict[str, str] = {}
    for name, entry in entries.items():
        try:
            cameras[name] = entry.camera
        except ValueError as error:
            refused[name] = str(error)
    sizes = {name: entry.pixel_mm for name, entry in entries.items() if entry.pixel_mm is not None}
    mounts = {n: e.mount for n, e in entries.items() if e.turn_deg or any((e.mount_omega, e.mount_phi, e.mount_kappa))}
    return CameraTable(cameras, sizes, {n: e.images for n, e in entries.items() if e.images}, refused, mounts)


def _entries(path: Path) -> list[dict[str, Any]]:
    try:
        text = read_small(path, encoding="utf-8-sig")
        if path.suffix.lower() in (".csv", ".txt"):
            return _of_csv(text)
        tree = json_of(text) if path.suffix.lower() == ".json" else yaml_of(text)
    except (OSError, ValueError, csv.Error) as error:
        raise CatalogError(f"the cameras cannot be read ({error})", where=str(path), remedy=REMEDY) from error
    if isinstance(tree, Mapping) and "cameras" in tree:
        tree = tree["cameras"]
    if isinstance(tree, Mapping):
        tree = [tree] if "width" in tree else [{"id": k, **v} for k, v in tree.items() if isinstance(v, Mapping)]
    if not isinstance(tree, list) or not all(isinstance(e, Mapping) for e in tree):
        raise CatalogError("the file holds no list of cameras", where=str(path), remedy=REMEDY)
    return [dict(e) for e in tree]


def _of_csv(text: str) -> list[dict[str, Any]]:
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    delimiter = max(",;\t", key=lambda d: lines[0].count(d)) if lines else ","
    rows = csv.DictReader(lines, delimiter=delimiter, skipinitialspace=True)
    return [{str(k).strip(): str(v).strip() for k, v in row.items() if v not in (None, "")} for row in rows]

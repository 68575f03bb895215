"""Calibrated cameras of Pix4Dmapper: the folder ``1_initial/params`` or one of its files.

Pix4D's camera is that of OpenCV: x right, y down, z forward, radial and tangential terms in the same order, (0, 0) the corner of the first pixel.
``…_calibrated_camera_parameters.txt`` has all of it for each image, in coordinates from ``…_offset.xyz``;
``…_calibrated_external_camera_parameters.txt`` has places and angles, its camera stands in ``….cam``; ``…_pmatrix.txt`` has a matrix of 3 × 4
numbers for each undistorted image, from the same offset.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import rq

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import from_omega_phi_kappa, nearest_rotation
from cityflow.io.orientation.camera_calibration import with_distortion
from cityflow.io.orientation.model_text import numbers, read_lines, stated_crs
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile, SizeOf

WHOLE, EXTERNAL, MATRICES = (
    "calibrated_camera_parameters.txt", "calibrated_external_camera_parameters.txt", "pmatrix.txt"
)  # fmt: skip
AGAIN = f"name the folder 1_initial/params, or its file …_{WHOLE}"
INTERNAL = "pix4d_calibrated_internal_camera_parameters.cam"
MOST_SKEW_PX = 0.05
"""A matrix whose axes of pixels are less square, within a thousand pixels, is no camera's; set by hand."""
Rows = Iterator[tuple[int, list[str]]]


@dataclass(frozen=True, slots=True)
class _Files:
    """The file that was chosen, and what stands beside it."""

    path: Path
    kind: str

    @property
    def project(self) -> str:
        return self.path.name[: -len(self.kind)]

    def beside(self, ending: str) -> Path:
        return self.path.with_name(self.project + ending)

    def offset(self) -> FloatArray:
        """(3,) metres that are added to local coordinates; none where the file is missing."""
        path = self.beside("offset.xyz")
        if not path.is_file():
            return np.zeros(3)
        try:
            return np.array(numbers(" ".join(read_lines(path, AGAIN)).split(), 3, "the offset"))
        except ValueError as error:
            raise CatalogError(str(error), where=str(path), remedy="export the parameters again") from error


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`."""
    files = _chosen(given.path)
    readers: dict[str, Callable[[_Files, SizeOf], list[OrientedImage | LeftOut]]] = {
        WHOLE: _whole, EXTERNAL: _external, MATRICES: _matrices,
    }  # fmt: skip
    outcomes = readers[files.kind](files, given.size_of)
    if not outcomes:
        raise CatalogError("no image in the file", where=str(files.path), remedy=AGAIN)
    kept, twice = in_order([o for o in outcomes if isinstance(o, OrientedImage)])
    wkt: str | None = None
    notes: tuple[str, ...] = ()
    if (prj := files.beside("wkt.prj")).is_file():
        wkt, notes = stated_crs(" ".join(read_lines(prj, AGAIN)), given.target)
    if files.kind != EXTERNAL and not files.beside("offset.xyz").is_file():
        notes += (
            f"{files.beside('offset.xyz').name} is missing: coordinates are taken as they are → name it, or give --origin",
        )
    return OrientationModel(
        kept, left_out=(*(o for o in outcomes if isinstance(o, LeftOut)), *twice), notes=notes, crs_wkt=wkt
    )


def _chosen(path: Path) -> _Files:
    """The file itself, or the best one of a folder."""
    kinds = (WHOLE, EXTERNAL, MATRICES)
    if not path.is_dir():
        kind = next((k for k in sorted(kinds, key=len, reverse=True) if path.name.endswith(k)), None)
        if kind is None:
            raise CatalogError("its name is none of Pix4D's", where=str(path), remedy=AGAIN)
        return _Files(path, kind)
    for kind in kinds:
        found = sorted(path.glob(f"*{kind}"))
        if len(found) > 1:
            listed = ", ".join(f.name for f in found)
            raise CatalogError(f"several projects: {listed}", where=str(path), remedy="name one of these files")
        if found:
            return _Files(found[0], kind)
    raise CatalogError("no calibrated cameras in the folder", where=str(path), remedy=AGAIN)


def _rows(path: Path) -> Rows:
    for number, line in enumerate(read_lines(path, AGAIN), 1):
        if line.strip() and not line.startswith("#"):
            yield number, line.split()


def _whole(files: _Files, _: SizeOf) -> list[OrientedImage | LeftOut]:
    """Ten lines for each image: name with size, K in three, radial, tangential, t, R in three."""
    rows, offset = _rows(files.path), files.offset()
    outcomes: list[OrientedImage | LeftOut] = []
    for line, head in rows:
        if len(head) < 3 or not (head[-2].isdigit() and head[-1].isdigit()):  # the explanation at the top
            continue
        block = [fields for _, (_, fields) in zip(range(9), rows, strict=False)]
        if len(block) < 9:
            raise CatalogError("the file ends within an image", where=f"{files.path}:{line}", remedy="export it again")
        name = " ".join(head[:-2])
        try:
            k, r = (np.array([numbers(f, 3, what) for f in block[i : i + 3]]) for i, what in ((0, "K"), (6, "R")))
            radial, tangential = (
                numbers(block[3], 3, "the radial distortion"),
                numbers(block[4], 2, "the tangential distortion"),
            )
            centre = np.array(numbers(block[5], 3, "t"))
            plain = Camera(int(head[-2]), int(head[-1]), k[0, 0], k[1, 1], k[0, 2], k[1, 2])
            camera = with_distortion(plain, (*radial[:2], *tangential, *((radial[2],) if radial[2] else ())))
            outcomes.append(OrientedImage(name, camera, nearest_rotation(r), centre + offset))
        except ValueError as error:
            outcomes.append(LeftOut(name, f"{files.path.name}, line {line}: {error}", "calibrate the image again"))
    return outcomes


def _external(files: _Files, size_of: SizeOf) -> list[OrientedImage | LeftOut]:
    """A line for each image: name, X, Y, Z, and omega, phi, kappa in degrees; one camera for all."""
    internal = _internal(files.beside(INTERNAL))
    outcomes: list[OrientedImage | LeftOut] = []
    for line, fields in _rows(files.path):
        if fields[0].lower() == "imagename":
            continue
        name, size = " ".join(fields[:-6]), None
        try:
            values = numbers(fields[-6:], 6, "the orientation")
            if not name or (size := size_of(name)) is None:
                raise ValueError("the image cannot be read, and the file does not state its size")
            rotation = from_omega_phi_kappa(*np.radians(values[3:]).tolist())
            outcomes.append(OrientedImage(name, internal.camera(*size), rotation, np.array(values[:3])))
        except ValueError as error:
            outcomes.append(LeftOut(name or f"line {line}", f"{files.path.name}, line {line}: {error}"))
    return outcomes


def _matrices(files: _Files, size_of: SizeOf) -> list[OrientedImage | LeftOut]:
    offset = files.offset()
    outcomes: list[OrientedImage | LeftOut] = []
    for line, fields in _rows(files.path):
        name = " ".join(fields[:-12]) or f"line {line}"
        try:
            matrix = np.array(numbers(fields[-12:], 12, "the matrix")).reshape(3, 4)
            if (size := size_of(name)) is None:
                raise ValueError("the undistorted image cannot be read, and the file does not state its size")
            outcomes.append(_of_matrix(name, matrix, size, offset))
        except ValueError as error:
            outcomes.append(LeftOut(name, f"{files.path.name}, line {line}: {error}"))
    return outcomes


def _of_matrix(name: str, matrix: FloatArray, size: tuple[int, int], offset: FloatArray) -> OrientedImage:
    """The image of a matrix K [R | -R t]."""
    upper, turn = rq(matrix[:, :3])
    signs = np.sign(np.diag(upper))
    k, rotation = upper * signs, signs[:, None] * turn
    if np.linalg.det(rotation) < 0 or not (np.diag(k) > 0).all():
        raise ValueError("the matrix is no camera's")
    k /= k[2, 2]
    if abs(k[0, 1] / k[1, 1]) * 500 > MOST_SKEW_PX:
        raise ValueError(f"the matrix has a skew of {k[0, 1]:.3g} pixels")
    centre = -np.linalg.solve(matrix[:, :3], matrix[:, 3])
    camera = Camera(*size, float(k[0, 0]), float(k[1, 1]), float(k[0, 2]), float(k[1, 2]))
    return OrientedImage(name, camera, nearest_rotation(rotation), centre + offset)


@dataclass(frozen=True, slots=True)
class _Internal:
    """Millimetres of the sensor, and OpenCV's terms."""

    width_mm: float
    focal_mm: float
    principal_mm: tuple[float, float]
    terms: tuple[float, ...]

    def camera(self, width: int, height: int) -> Camera:
        per_mm = width / self.width_mm
        (x, y), f = self.principal_mm, self.focal_mm * per_mm
        return with_distortion(Camera(width, height, f, f, x * per_mm, y * per_mm), self.terms)


def _internal(path: Path) -> _Internal:
    """The one camera of a file ``.cam``; raises CatalogError where it is missing, damaged, or there are several."""
    lines = read_lines(path, f"copy {path.name} beside the orientation, or {AGAIN}")
    values: dict[str, float] = {}
    try:
        sizes = [m[1] for line in lines if (m := re.search(r"sensor width of ([0-9.eE+-]+)x", line))]
        if len(sizes) != 1:
            raise ValueError(f"it has {len(sizes)} cameras, and does not say which images are whose")
        for line in lines:
            key, *rest = line.split() or [""]
            if key in ("F", "Px", "Py", "K1", "K2", "K3", "T1", "T2"):
                values[key] = numbers(rest, 1, key)[0]
        (width,) = numbers(sizes, 1, "the sensor's width")
        return _Internal(width, values["F"], (values["Px"], values["Py"]), _terms(values))
    except KeyError as error:
        raise CatalogError(f"it has no {error.args[0]}", where=str(path), remedy=AGAIN) from error
    except ValueError as error:
        raise CatalogError(str(error), where=str(path), remedy=AGAIN) from error


def _terms(values: dict[str, float]) -> tuple[float, ...]:
    k1, k2, k3, t1, t2 = (values.get(n, 0.0) for n in ("K1", "K2", "K3", "T1", "T2"))
    return (k1, k2, t1, t2, k3) if k3 else (k1, k2, t1, t2)

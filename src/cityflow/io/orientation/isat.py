"""Projects of Intergraph's ISAT and of programs that write its files (Pix4D's ``…_photo.ssk`` and ``…_camera.ssk``).

Both files have blocks ``begin NAME id … end NAME`` with lines ``key: value``. ``EO_parameters`` are X, Y, Z, omega, phi, kappa in degrees. Of a camera,
lengths are millimetres, pixels micrometres; sizes and the origin of the photograph's frame count rows before columns, from the centre of the first pixel.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import AngleUnit, RotationOrder, from_angles
from cityflow.io.orientation.camera_table import CameraTable, read_camera_table
from cityflow.io.orientation.model_text import file_name, numbers, read_lines
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile, SizeOf, choice

AGAIN = "name ISAT's photo file, with the camera file beside it"
OWN = "undistort the images, or describe the camera with --cameras"


@dataclass(slots=True)
class _Block:
    name: str
    line: int
    values: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _Cameras:
    """Blocks of the camera file by name, or cameras of a table."""

    blocks: Mapping[str, _Block]
    table: CameraTable | None

    def image(self, block: _Block, name: str, pose: OrientedImage, size_of: SizeOf) -> tuple[OrientedImage, float]:
        """The image with its camera, and its pixels' size in mm (0 where it is not known)."""
        key = block.values.get("camera_name", "")
        if self.table is not None:
            image, used = self.table.image(name, key if key in self.table.cameras else "", pose.rotation, pose.centre)
            return image, self.table.pixel_mm.get(used, 0.0)
        if key not in self.blocks:
            raise ValueError(f"no camera {key!r}; there are: {', '.join(self.blocks) or 'none'}")
        try:
            camera, pixel = _camera(self.blocks[key], size_of(name))
        except ValueError as error:
            raise ValueError(f"camera {key}: {error}") from error
        return OrientedImage(name, camera, pose.rotation, pose.centre, key), pixel


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`; options ``cameras``, ``angle_unit``, ``rotation_order``."""
    path = given.path
    unit = choice(AngleUnit, given.options, "angle_unit", AngleUnit.DEGREE)
    order = choice(RotationOrder, given.options, "rotation_order", RotationOrder.OMEGA_PHI_KAPPA)
    blocks = list(_blocks(path, "photo_parameters"))
    if not blocks:
        raise CatalogError("no photo_parameters in the file", where=str(path), remedy=AGAIN)
    cameras = _cameras(given)
    images, left_out = [], []
    pixel_mm: dict[str, float] = {}
    for block in blocks:
        name = file_name(block.values.get("image_id", "")) or block.name.split()[0]
        try:
            values = numbers(block.values.get("eo_parameters", "").split(), 6, "EO_parameters")
            first, second, third = (a * unit.radians for a in values[3:])
            rotation = from_angles(first, second, third, order)
            pose = OrientedImage(name, Camera(1, 1, 1.0, 1.0, 0.5, 0.5), rotation, np.array(values[:3]))
            image, pixel = cameras.image(block, name, pose, given.size_of)
        except ValueError as error:
            left_out.append(
                LeftOut(name, f"{path.name}, line {block.line}: {error}", "orient it, or describe its camera")
            )
            continue
        images.append(image)
        pixel_mm |= {name: pixel} if pixel else {}
    kept, twice = in_order(images)
    return OrientationModel(kept, left_out=(*left_out, *twice), pixel_mm=pixel_mm)


def _cameras(given: OrientationFile) -> _Cameras:
    if "cameras" in given.options:
        return _Cameras({}, read_camera_table(given.options["cameras"]))
    path = given.path
    stem = path.name.lower()
    choices = [path.with_name("camera"), path.with_name("camera.ssk")]
    if stem.endswith("photo.ssk"):
        choices.insert(0, path.with_name(path.name[: -len("photo.ssk")] + "camera.ssk"))
    found = next((c for c in choices if c.is_file()), None)
    if found is None:
        raise CatalogError(
            "the camera file is missing",
            where=str(choices[0]),
            remedy="copy it beside the photo file, or name --cameras FILE",
        )
    return _Cameras({b.name: b for b in _blocks(found, "camera_parameters")}, None)


def _camera(block: _Block, size: tuple[int, int] | None) -> tuple[Camera, float]:
    """The camera, and the size of its pixels in mm.

    Parameters
    ----------
    size : width and height of the image's file, where it can be read; it tells which number of a pair is which
    """

    def pair(key: str) -> tuple[float, float]:
        first, second = numbers(block.values.get(key, "").split(), 2, f"{key} (line {block.line})")
        return first, second

    if block.values.get("camera_type", "frame") != "frame":
        raise ValueError(f"a camera of the type {block.values['camera_type']} cannot be used")
    if block.values.get("lens_distortion_flag", "off").lower() == "on":
        raise ValueError(f"its table of lens distortion is not read → {OWN}")
    if (turned := block.values.get("photo_coord_sys_orientation", "1")) != "1":
        raise ValueError(
            f"photo_coord_sys_orientation is {turned}: its frame is turned → describe the camera with --cameras and turn_deg"
        )
    sizes, origin, pixels = pair("image_size_in_pixels"), pair("photo_coord_sys_origin"), pair("pixel_size")
    swapped = size is not None and size == (int(sizes[0]), int(sizes[1])) and sizes[0] != sizes[1]
    (rows, cols), (v, u) = (sizes[::-1], origin[::-1]) if swapped else (sizes, origin)
    if size is not None and size != (int(cols), int(rows)):
        raise ValueError(f"it has {cols:g} × {rows:g} pixels, the image {size[0]} × {size[1]}")
    if abs(pixels[0] - pixels[1]) > 1e-6 * pixels[0] or pixels[0] <= 0:
        raise ValueError(f"its pixels of {pixels[0]:g} × {pixels[1]:g} µm are not square")
    pixel = pixels[0] * 1e-3
    (focal,) = numbers(block.values.get("focal_length", "").split(), 1, f"focal_length (line {block.line})")
    x, y = pair("ppac") if "ppac" in block.values else (0.0, 0.0)
    return Camera(int(cols), int(rows), focal / pixel, focal / pixel, u + 0.5 + x / pixel, v + 0.5 - y / pixel), pixel


def _blocks(path: Path, kind: str) -> Iterator[_Block]:
    """Blocks of a kind, keys in small letters; raises CatalogError where one does not end."""
    block: _Block | None = None
    for number, line in enumerate(read_lines(path, AGAIN), 1):
        text = line.strip()
        low = text.lower()
        if low.startswith(f"begin {kind}"):
            rest = text[len(f"begin {kind}") :].strip()
            cut = rest.lower().find("strip_id")
            block = _Block((rest[:cut] if cut > 0 else rest).strip(), number)
        elif block is not None and low.startswith("end"):
            yield block
            block = None
        elif block is not None and ":" in text and not text.startswith("#"):
            key, _, value = text.partition(":")
            block.values.setdefault(key.strip().lower(), value.strip())
    if block is not None:
        raise CatalogError(f"{kind} {block.name} does not end", where=f"{path}:{block.line}", remedy=AGAIN)

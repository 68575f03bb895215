"""Projects of Inpho (Match-AT, Applications Master; ``.prj``): cameras with the affine from millimetres to pixels, and a matrix for each photograph.

Blocks ``$NAME … $END`` begin at the start of a line; within them stand items ``$KEY : value``, whose value may go on over lines. The nine numbers of
``$EXT_ORI`` are, row by row, the photograph's axes x right, y up, z backward in the world. Lever arms, ``$CAMERA_MOUNT_ROTATION`` and boresight belong to
the navigation and are part of these matrices already.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.io.orientation.model_text import MatrixRows, file_name, numbers, read_lines, stated_crs
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.photo_frame import LensTerms, PhotoCamera
from cityflow.io.orientation.readers import OrientationFile, choice

AGAIN = "export the project again, as an Inpho project file (.prj) with its cameras and orientations"
MM_OF_IMAGE = {"mm": 1.0, "um": 1e-3, "micron": 1e-3, "microns": 1e-3, "cm": 10.0, "m": 1000.0}
"""Units of lengths on the photograph, in mm."""
CORNERS = {"centertopleft": 0.5, "centerleftupper": 0.5, "topleft": 0.0, "cornertopleft": 0.0, "lefttop": 0.0}
"""What ``$PIXEL_REFERENCE`` says of the pixel with the coordinates (0, 0), and what leads to its corner."""


CAMERAS = ("CAMERA_DEFINITION", "CAMERA")
MOST_FOCAL = 1e-3
"""A photograph whose focal length is farther off its camera's, as a share, belongs to another calibration; set by hand."""


@dataclass(frozen=True, slots=True)
class _Item:
    text: str
    line: int


@dataclass(slots=True)
class _Block:
    """Items of a block; those of its calibration sets by set."""

    name: str
    line: int
    items: dict[str, _Item] = field(default_factory=dict)
    sets: list[dict[str, _Item]] = field(default_factory=list)


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`; options ``lens_terms``, ``matrix``."""
    rows = choice(MatrixRows, given.options, "matrix", MatrixRows.PHOTO_AXES)
    path, terms = given.path, choice(LensTerms, given.options, "lens_terms", LensTerms.SUBTRACTED)
    blocks = list(_blocks(read_lines(path, AGAIN), path))
    photos = [b for b in blocks if b.name == "PHOTO"]
    if not photos:
        raise CatalogError("no $PHOTO in the file", where=str(path), remedy=AGAIN)
    project = next((b.items for b in blocks if b.name == "PROJECT"), {})
    cameras = _cameras([b for b in blocks if b.name in CAMERAS], _mm_of_unit(project, path), terms)
    images, left_out, pixel_mm, stages = [], [], {}, set()
    for block in photos:
        name = _name(block)
        try:
            camera = _camera_of(block, cameras)
            images.append(_image(block, name, camera, rows))
        except ValueError as error:
            left_out.append(LeftOut(name, f"{path.name}, line {block.line}: {error}", "orient it, or fix its camera"))
            continue
        pixel_mm[name] = camera.pixel_mm
        stages.add(block.items["ORI_STAT"].text.lower() if "ORI_STAT" in block.items else "")
    kept, twice = in_order(images)
    wkt, notes = stated_crs(_crs(project, blocks), given.target)
    if "initial" in stages:
        notes += (
            f"{path.name}: orientations are marked as initial, not as adjusted → adjust the block, or let the poses be refined",
        )
    if any(not image.camera.is_pinhole for image in kept):
        other = next(t for t in LensTerms if t is not terms)
        notes += (
            f"{path.name}: lens coefficients are {terms} → if residuals grow towards the borders, say --lens-terms {other}",
        )
    return OrientationModel(kept, left_out=(*left_out, *twice), notes=notes, pixel_mm=pixel_mm, crs_wkt=wkt)


@dataclass(frozen=True, slots=True)
class _Camera:
    """A camera as `PhotoCamera.camera_and_turn` has it, with what the file says of it; `problem` where it cannot be used."""

    name: str = ""
    focal_mm: float = 0.0
    pixel_mm: float = 0.0
    camera: Camera | None = None
    turn: FloatArray = field(default_factory=lambda: np.eye(3))
    problem: str = ""


def _camera_of(block: _Block, cameras: Mapping[str, _Camera]) -> _Camera:
    name = block.items["CAMERA_ID"].text if "CAMERA_ID" in block.items else next(iter(cameras), "")
    if name not in cameras or ("CAMERA_ID" not in block.items and len(cameras) > 1):
        raise ValueError(f"no camera {name!r}; there are: {', '.join(cameras) or 'none'}")
    if cameras[name].problem:
        raise ValueError(f"camera {name}: {cameras[name].problem}")
    return cameras[name]


def _image(block: _Block, name: str, camera: _Camera, rows: MatrixRows) -> OrientedImage:
    item = block.items.get("EXT_ORI")
    if item is None:
        raise ValueError("it has no $EXT_ORI")
    values = numbers(item.text.split()[-13:], 13, f"$EXT_ORI (line {item.line})")
    if abs(values[0] - camera.focal_mm) > MOST_FOCAL * camera.focal_mm:
        raise ValueError(
            f"$EXT_ORI (line {item.line}) has a focal length of {values[0]:g} mm, its camera {camera.focal_mm:g} mm"
        )
    assert camera.camera is not None
    return OrientedImage(
        name, camera.camera, camera.turn @ rows.photo_from_world(values[4:]), np.array(values[1:4]), camera.name
    )  # fmt: skip


def _cameras(blocks: Sequence[_Block], to_mm: float, terms: LensTerms) -> dict[str, _Camera]:
    cameras: dict[str, _Camera] = {}
    for block in blocks:
        items = block.items | _active(block)
        name = next((block.items[k].text for k in ("ID", "TYPE") if k in block.items), "")
        try:
            photo = _photo_camera(items, to_mm, terms)
            pixel = 1 / float(np.linalg.norm(photo.pixel_of_mm[0, :2]) or np.nan)
            cameras[name] = _Camera(name, photo.focal_mm, pixel, *photo.camera_and_turn)
        except ValueError as error:
            cameras[name] = _Camera(name, problem=f"{error} (line {block.line})")
    return cameras


def _active(block: _Block) -> dict[str, _Item]:
    """The calibration set that ``$ACTIVE_CALIBRATION`` names, else the first."""
    wanted = block.items["ACTIVE_CALIBRATION"].text if "ACTIVE_CALIBRATION" in block.items else ""
    named = [s for s in block.sets if "ID" in s and s["ID"].text == wanted] or block.sets
    return {k: v for k, v in (named[0] if named else {}).items() if k != "ID"}


def _photo_camera(items: Mapping[str, _Item], to_mm: float, terms: LensTerms) -> PhotoCamera:
    def values(key: str, count: int) -> list[float]:
        if key not in items:
            raise ValueError(f"it has no ${key}")
        return numbers(items[key].text.split(), count, f"${key} (line {items[key].line})")

    corner = items["PIXEL_REFERENCE"].text.lower() if "PIXEL_REFERENCE" in items else "centertopleft"
    if corner not in CORNERS:
        raise ValueError(
            f"$PIXEL_REFERENCE {items['PIXEL_REFERENCE'].text!r} is not known; known: {', '.join(CORNERS)}"
        )
    kind = items["DISTORTION_TYPE"].text.lower() if "DISTORTION_TYPE" in items else ""
    if "DISTORTION" in items or kind not in ("", "none", "polynomial"):
        raise ValueError(
            "its distortion is no polynomial: undistort the images, or export the camera with a polynomial"
        )
    affine = np.array(values("CCD_INTERIOR_ORIENTATION", 6)).reshape(2, 3)
    affine[:, :2] /= to_mm
    affine[:, 2] += CORNERS[corner]
    xp, yp = values("PRINCIPAL_POINT_PPA", 2) if "PRINCIPAL_POINT_PPA" in items else (0.0, 0.0)
    radial = values("RADIAL_COEFFS", 8) if "RADIAL_COEFFS" in items else []
    tangential = values("DECENTRE_COEFFS", 4) if "DECENTRE_COEFFS" in items else []
    if any(tangential[2:]):
        raise ValueError("its decentring has more than two terms")
    return PhotoCamera(
        int(values("CCD_COLUMNS", 1)[0]), int(values("CCD_ROWS", 1)[0]), affine, values("FOCAL_LENGTH", 1)[0] * to_mm,
        (xp * to_mm, yp * to_mm), tuple(k / to_mm ** (2 * i) for i, k in enumerate(radial)),
        tuple(p / to_mm for p in tangential[:2]), terms,
    )  # fmt: skip


def _blocks(lines: Sequence[str], path: Path) -> Iterator[_Block]:
    """Blocks as they come; raises CatalogError where one does not end."""
    block: _Block | None = None
    items: dict[str, _Item] = {}
    last = ""
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        if line.startswith("$"):
            if block is not None:
                yield block
                block = None
            if not text.startswith("$END"):
                block = _Block(text[1:].split()[0], number)
                items = block.items
        elif block is not None and text.startswith("$"):
            last, _, value = text[1:].partition(":")
            last = last.strip()
            if last == "CALIBRATION_SET":
                block.sets.append(items := {})
            elif last == "END":
                items = block.items
            elif last not in items:
                items[last] = _Item(value.strip().replace(r"\ ", " "), number)
        elif block is not None and last in items:
            items[last] = _Item(f"{items[last].text} {text}".strip(), items[last].line)
    if block is not None:
        raise CatalogError(f"${block.name} does not end", where=f"{path}:{block.line}", remedy=AGAIN)


def _mm_of_unit(project: Mapping[str, _Item], path: Path) -> float:
    """Millimetres of a unit of the photograph; raises CatalogError where a unit is not known, or the world is not in metres."""
    world, image = (project.get(f"LINEAR_UNITS_OF_{k}") for k in ("OBJECT", "IMAGE"))
    if world is not None and world.text.lower() not in ("m", "meter", "metre", "meters", ""):
        problem = f"coordinates in {world.text!r}, not in metres"
        raise CatalogError(problem, where=f"{path}:{world.line}", remedy="export the project in metres")
    if image is not None and image.text.lower() not in MM_OF_IMAGE:
        raise CatalogError(
            f"the unit {image.text!r} is not known", where=f"{path}:{image.line}", remedy=f"one of {', '.join(MM_OF_IMAGE)}"
        )  # fmt: skip
    return MM_OF_IMAGE[image.text.lower()] if image is not None else 1.0


def _name(block: _Block) -> str:
    """File of the photograph, else its number."""
    items = block.items
    if "PHOTO_FILE" in items and items["PHOTO_FILE"].text:
        return file_name(items["PHOTO_FILE"].text)
    return items["PHOTO_NUM"].text if "PHOTO_NUM" in items else f"line {block.line}"


def _crs(project: Mapping[str, _Item], blocks: Sequence[_Block]) -> str:
    places = [project, *(b.items for b in blocks if b.name == "COORDINATE_SYSTEM_SET")]
    return next((p["COORDINATE_SYSTEM"].text for p in places if "COORDINATE_SYSTEM" in p), "")

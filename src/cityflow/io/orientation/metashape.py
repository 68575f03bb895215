"""Camera files of Metashape (Export Cameras, XML): sensors with their calibration, and a 4 × 4 matrix for each image."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import nearest_rotation
from cityflow.io.given_files import MODEL_MB, check_plain
from cityflow.io.orientation.camera_calibration import REMEDY, metashape_camera, metashape_fisheye
from cityflow.io.orientation.geocentric import geocentric_to_map, on_map
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel, in_order
from cityflow.io.orientation.readers import OrientationFile

TERMS = ("k1", "k2", "k3", "k4", "p1", "p2", "b1", "b2")
AGAIN = "export the cameras again, as Metashape XML"


@dataclass(frozen=True, slots=True)
class _Similarity:
    """world = scale · rotation · x + translation."""

    rotation: FloatArray
    translation: FloatArray
    scale: float

    def points(self, xyz: FloatArray) -> FloatArray:
        return np.asarray(self.scale * self.rotation @ xyz + self.translation)


def read(given: OrientationFile) -> OrientationModel:
    """For `readers.READERS`."""
    return read_metashape(given.path, given.target)


def read_metashape(path: str | Path, target: CRS | None = None) -> OrientationModel:
    """The images of the first chunk that has any.

    Parameters
    ----------
    target : projected CRS to which geocentric or geographic coordinates are led; None takes the file's own where it is projected. Files of a local
        frame are taken as they are.

    Raises
    ------
    CatalogError
        Where the file is no such file, or its coordinates cannot be led to a projected CRS.
    """
    check_plain(path, MODEL_MB)
    try:
        root = ElementTree.parse(path).getroot()
    except (
        OSError,
        ElementTree.ParseError,
        LookupError,
        ValueError,
    ) as error:  # LookupError: an encoding that nobody knows
        raise CatalogError(f"the file cannot be read ({error})", where=str(path), remedy=AGAIN) from error
    chunk = next((c for c in root.iter("chunk") if c.find("cameras") is not None), None)
    if chunk is None:
        raise CatalogError("the file has no chunk with cameras", where=str(path), remedy=AGAIN)
    try:
        cameras, refused, pixel = _sensors(chunk)
        world = _World.of(chunk, target, str(path))
        parts = _components(chunk)
        images, left_out, pixel_mm = [], [], {}
        for node in chunk.findall("cameras//camera"):
            outcome = _image(node, cameras, refused, parts, world)
            if isinstance(outcome, LeftOut):
                left_out.append(outcome)
                continue
            images.append(outcome)
            if pixel.get(node.get("sensor_id", "")):
                pixel_mm[outcome.name] = pixel[node.get("sensor_id", "")]
    except ValueError as error:
        raise CatalogError(f"the file is damaged ({error})", where=str(path), remedy=AGAIN) from error
    kept, twice = in_order(images)
    return OrientationModel(kept, left_out=(*left_out, *twice), pixel_mm=pixel_mm, crs_wkt=world.wkt, notes=world.notes)


def _image(
    node: ElementTree.Element,
    cameras: dict[str, Camera],
    refused: dict[str, str],
    parts: dict[str, _Similarity],
    world: _World,
) -> OrientedImage | LeftOut:
    name, sensor = node.get("label", ""), node.get("sensor_id", "")
    matrix = _values(node.find("transform"), 16)
    if matrix is None:
        return LeftOut(name, "the model has no orientation of this image", "align it, or do without")
    if node.get("enabled", "true").lower() in ("false", "0"):
        return LeftOut(name, "the image is switched off in the model")
    if sensor not in cameras:
        return LeftOut(name, refused.get(sensor, f"the model has no sensor {sensor!r}"), REMEDY)
    pose = matrix.reshape(4, 4)
    own = parts.get(node.get("component_id", ""), _Similarity(np.eye(3), np.zeros(3), 1.0))
    centre, rotation = world.placed(own.points(pose[:3, 3]), own.rotation @ nearest_rotation(pose[:3, :3]))
    if not np.isfinite(centre).all():
        return LeftOut(name, "its place lies outside the CRS", "check --crs")
    return OrientedImage(name, cameras[sensor], rotation.T, centre, sensor)


def _sensors(chunk: ElementTree.Element) -> tuple[dict[str, Camera], dict[str, str], dict[str, float]]:
    """Cameras by sensor id, reasons for those that cannot be used, and sizes of their pixels in mm."""
    cameras: dict[str, Camera] = {}
    refused: dict[str, str] = {}
    pixel: dict[str, float] = {}
    for node in chunk.findall("sensors/sensor"):
        key = node.get("id", "")
        try:
            cameras[key] = _camera(node)
        except ValueError as error:
            refused[key] = f"sensor {node.get('label', key)!r}: {error}"
        size = node.find("property[@name='pixel_width']")
        pixel[key] = float(size.get("value", "0")) if size is not None else 0.0
    return cameras, refused, pixel


def _camera(node: ElementTree.Element) -> Camera:
    kind = node.get("type", "frame")
    if kind not in ("frame", "fisheye", "equidistant_fisheye"):
        raise ValueError(f"a camera of the type {kind} cannot be undistorted here")
    found = node.findall("calibration")
    chosen = next((c for c in found if c.get("class") == "adjusted"), found[0] if found else None)
    size = chosen.find("resolution") if chosen is not None else None
    size = node.find("resolution") if size is None else size
    if chosen is None or size is None:
        raise ValueError("it has no calibration")
    width, height = int(size.get("width", "0")), int(size.get("height", "0"))
    values = {t.tag: float(t.text or 0) for t in chosen if t.tag in (*TERMS, "f", "fx", "fy", "cx", "cy")}
    focal = values.get("f", values.get("fy", 0.0))
    if focal <= 0 or width <= 0 or height <= 0:
        raise ValueError("its calibration has no focal length or no size")
    if "fx" in values:
        values["b1"] = values["fx"] - focal
    centre = width / 2 + values.get("cx", 0.0), height / 2 + values.get("cy", 0.0)
    plain = Camera(width, height, focal, focal, *centre)
    return metashape_camera(plain, values) if kind == "frame" else metashape_fisheye(plain, values)


def _components(chunk: ElementTree.Element) -> dict[str, _Similarity]:
    """Parts of a chunk that are placed on their own; only where the chunk itself is not."""
    if chunk.find("transform/rotation") is not None:
        return {}
    return {n.get("id", ""): _similarity(n.find("transform")) for n in chunk.findall("components/component")}


def _similarity(node: ElementTree.Element | None) -> _Similarity:
    if node is None:
        return _Similarity(np.eye(3), np.zeros(3), 1.0)
    whole = _values(node, 16) if node.text and len(node.text.split()) == 16 else None
    if whole is not None:
        matrix = whole.reshape(4, 4)
        scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
        return _Similarity(nearest_rotation(matrix[:3, :3]), matrix[:3, 3], scale)
    rotation, translation, scale_value = (
        _values(node.find(t), n) for t, n in (("rotation", 9), ("translation", 3), ("scale", 1))
    )
    return _Similarity(
        np.eye(3) if rotation is None else nearest_rotation(rotation.reshape(3, 3)),
        np.zeros(3) if translation is None else translation,
        1.0 if scale_value is None else float(scale_value[0]),
    )


def _values(node: ElementTree.Element | None, count: int) -> FloatArray | None:
    if node is None or not (node.text or "").strip():
        return None
    values = np.array([float(v) for v in (node.text or "").split()])
    if len(values) != count:
        raise ValueError(f"<{node.tag}> has {len(values)} numbers instead of {count}")
    return values


@dataclass(frozen=True, slots=True)
class _World:
    """From the chunk's coordinates to the world's: a similarity, then, where that is geocentric, a map projection."""

    chunk: _Similarity
    projection: Transformer | None
    wkt: str | None
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, chunk: ElementTree.Element, target: CRS | None, where: str) -> _World:
        text = (chunk.findtext("reference") or "").strip()
        similarity = _similarity(chunk.find("transform"))
        if not text or text.upper().startswith(("LOCAL_CS", "ENGCRS", "LOCAL")):
            return cls(similarity, None, None)
        try:
            own = CRS.from_user_input(text)
        except CRSError as error:
            raise CatalogError(f"the CRS in the file is not known ({error})", where=where, remedy=AGAIN) from error
        goal = target if target is not None else own
        if not goal.is_projected and not (goal.is_compound and goal.sub_crs_list[0].is_projected):
            raise CatalogError(
                f"the file is in {own.name}, in degrees", where=where, remedy="assign a projected CRS with --crs EPSG:n"
            )
        datum = own.geodetic_crs or own
        note = "heights of a Metashape file are taken as its CRS has them; check them against known points"
        return cls(similarity, geocentric_to_map(datum, goal), own.to_wkt(), (note,))

    def placed(self, centre: FloatArray, axes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """World centre and (3, 3) world_from_camera of a pose in the chunk."""
        place, turned = self.chunk.points(centre), self.chunk.rotation @ axes
        return (place, turned) if self.projection is None else on_map(self.projection, place, turned)

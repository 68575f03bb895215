"""Oriented images as STAC items with the perspective-imagery extension, and back.

The extension gives interior orientation in millimetres on the sensor, which models from images alone do not know, and has no field for most
distortions. The exact camera, in pixels, is therefore in ``cityflow:camera``, and is what is read again.
"""

from __future__ import annotations

import os
import posixpath
from collections.abc import Mapping
from math import isfinite
from typing import Any
from urllib.parse import unquote, urljoin

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import PERSPECTIVE, Camera, OrientedImage
from cityflow.core.reference import Reference
from cityflow.geometry.rotations import PHOTO_FLIP, omega_phi_kappa
from cityflow.io.catalog.catalog_kinds import KIND
from cityflow.io.catalog.stac_assets import IMAGE, ImageAsset
from cityflow.io.orientation.oriented_images import FARTHEST_M

PERSPECTIVE_IMAGERY = "https://stac-extensions.github.io/perspective-imagery/v1.0.0/schema.json"
VIEW = "https://stac-extensions.github.io/view/v1.0.0/schema.json"

CAMERA_KEYS = ("width", "height", "fx", "fy", "cx", "cy", "kind")
ORTHONORMAL = 1e-6
"""How far products of a rotation's rows may be off, in files of eight digits."""


def image_properties(asset: ImageAsset, reference: Reference) -> dict[str, Any]:
    """Properties of an image's item.

    ``pers:rotation_matrix`` turns world axes into the image's in photogrammetry's sense: x right, y up, z backward.
    """
    image, c = asset.oriented, asset.oriented.camera
    matrix = np.asarray(PHOTO_FLIP @ image.rotation + 0.0)
    omega, phi, kappa = (float(np.degrees(a)) for a in omega_phi_kappa(image.rotation))
    properties: dict[str, Any] = {
        KIND: IMAGE,
        "proj:shape": [c.height, c.width],
        "pers:interior_orientation": _interior(c, asset.pixel_mm),
        "pers:perspective_center": image.centre.tolist(),
        "pers:rotation_matrix": matrix.reshape(-1).tolist(),
        "pers:omega": omega, "pers:phi": phi, "pers:kappa": kappa,
        "view:off_nadir": round(float(np.degrees(image.tilt)), 4),
        "view:azimuth": round(float(np.degrees(np.arctan2(image.axis[0], image.axis[1])) % 360), 4) % 360,
        "cityflow:camera": camera_json(c),
        "cityflow:heights": list(asset.heights),
        "cityflow:bands": asset.bands,
        "cityflow:dtype": asset.dtype,
        "cityflow:gain": list(asset.gain),
    }  # fmt: skip
    if asset.pixel_mm:
        properties["cityflow:pixel_mm"] = asset.pixel_mm
    if any(g != 1.0 for g in asset.gamma):
        properties["cityflow:gamma"] = list(asset.gamma)
    if asset.falloff:
        properties["cityflow:falloff"] = asset.falloff
    if asset.shoulder:
        properties["cityflow:shoulder"] = asset.shoulder
    if asset.white:
        properties["cityflow:white"] = asset.white
    if image.head:
        properties["cityflow:head"] = image.head
    if asset.pose_covariance:
        properties["cityflow:pose_covariance"] = list(asset.pose_covariance)
    if asset.video_s is not None:
        properties["cityflow:video_s"] = asset.video_s
    if properties["view:off_nadir"] > 90:
        # The view extension ends at the horizon.
        del properties["view:off_nadir"], properties["view:azimuth"]
    if reference.horizontal_epsg is not None:
        properties["pers:crs"] = reference.horizontal_epsg
    if reference.vertical_epsg is not None:
        properties["pers:vertical_crs"] = reference.vertical_epsg
    return properties


def _interior(camera: Camera, pixel_mm: float) -> dict[str, Any]:
    tree: dict[str, Any] = {"sensor_array_dimensions": [camera.width, camera.height]}
    if pixel_mm:
        offset = [(camera.cx - camera.width / 2) * pixel_mm, (camera.height / 2 - camera.cy) * pixel_mm]
        tree |= {
            "pixel_spacing": [pixel_mm, pixel_mm],
            "focal_length": (camera.fx + camera.fy) / 2 * pixel_mm,
            "principal_point_offset": offset,
        }
    return tree


def camera_json(camera: Camera) -> dict[str, Any]:
    """A camera as JSON, exact to the last bit."""
    tree: dict[str, Any] = {k: getattr(camera, k) for k in CAMERA_KEYS}
    return tree | {"distortion": list(camera.distortion)}


def camera_of_json(tree: Mapping[str, Any]) -> Camera:
    """What `camera_json` wrote."""
    fx, fy, cx, cy = (float(tree[k]) for k in ("fx", "fy", "cx", "cy"))
    distortion = tuple(float(v) for v in tree.get("distortion", ()))
    return Camera(
        int(tree["width"]), int(tree["height"]), fx, fy, cx, cy, distortion, str(tree.get("kind", PERSPECTIVE))
    )


def image_of_item(
    item: Mapping[str, Any], place: str, asset_key: str, cameras: dict[Any, Camera] | None = None
) -> ImageAsset:
    """The image of an item.

    Parameters
    ----------
    place : path or URL of the item's file, which its relative references count from
    cameras : those of the images before; one that is known is not held twice

    Raises
    ------
    KeyError, ValueError, TypeError
        Where the item lacks something or it is no such thing.
    """
    p, asset = item["properties"], item["assets"][asset_key]
    name = str(item["id"])
    centre = [float(v) for v in p["pers:perspective_center"]]
    if len(centre) != 3 or not all(map(isfinite, centre)):
        raise ValueError(f"item {name} has no finite position")
    low, high = (float(v) for v in p["cityflow:heights"])
    x_min, y_min, x_max, y_max = (float(v) for v in p["proj:bbox"])
    if not all(abs(v) <= FARTHEST_M for v in (*centre, low, high, x_min, y_min, x_max, y_max)):
        raise ValueError(f"item {name} is not on Earth")
    return ImageAsset(
        name=name,
        href=_absolute(str(asset["href"]), place),
        checksum=str(asset["file:checksum"])[4:],
        size=int(asset["file:size"]),
        bounds=(x_min, y_min, x_max, y_max),
        oriented=OrientedImage(
            name,
            _camera(p["cityflow:camera"], cameras),
            _rotation(p, name),
            np.array(centre),
            str(p.get("cityflow:head", "")),
        ),
        heights=(low, high),
        bands=int(p["cityflow:bands"]),
        dtype=str(p["cityflow:dtype"]),
        gain=tuple(float(g) for g in p["cityflow:gain"]),
        date="" if p.get("cityflow:date_unknown") else str(p["datetime"])[:10],
        pixel_mm=float(p.get("cityflow:pixel_mm", 0.0)),
        gamma=tuple(float(g) for g in p.get("cityflow:gamma", ())),
        falloff=float(p.get("cityflow:falloff", 0.0)),
        shoulder=float(p.get("cityflow:shoulder", 0.0)),
        white=float(p.get("cityflow:white", 0.0)),
        pose_covariance=tuple(float(v) for v in p.get("cityflow:pose_covariance", ())),
        video_s=None if p.get("cityflow:video_s") is None else float(p["cityflow:video_s"]),
    )


def _camera(tree: Mapping[str, Any], known: dict[Any, Camera] | None) -> Camera:
    if known is None:
        return camera_of_json(tree)
    key = (*(tree.get(k) for k in CAMERA_KEYS), *tree.get("distortion", ()))
    if key not in known:
        known[key] = camera_of_json(tree)
    return known[key]


def _rotation(properties: Mapping[str, Any], name: str) -> FloatArray:
    """World axes to the camera's."""
    m = [float(v) for v in properties["pers:rotation_matrix"]]
    if len(m) != 9 or not _is_rotation(m[:3], m[3:6], m[6:]):
        raise ValueError(f"the matrix of item {name} is no rotation")
    return np.asarray(PHOTO_FLIP @ np.array(m).reshape(3, 3) + 0.0)


def _is_rotation(a: list[float], b: list[float], c: list[float]) -> bool:
    """Whether three rows are orthonormal and right-handed: with plain numbers, as numpy takes ten times as long for so few."""
    rows = ((a, a, 1.0), (b, b, 1.0), (c, c, 1.0), (a, b, 0.0), (b, c, 0.0), (c, a, 0.0))
    cross = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    square = all(abs(u[0] * v[0] + u[1] * v[1] + u[2] * v[2] - n) <= ORTHONORMAL for u, v, n in rows)
    return square and cross[0] * c[0] + cross[1] * c[1] + cross[2] * c[2] > 0


def _absolute(href: str, place: str) -> str:
    if "://" in href:
        return href
    if "://" in place:
        return urljoin(place, href) if place.startswith("http") else _joined_url(place, href)
    return os.path.normpath(os.path.join(os.path.dirname(place), unquote(href)))


def _joined_url(place: str, href: str) -> str:
    protocol, path = place.split("://", 1)
    return f"{protocol}://{posixpath.normpath(posixpath.join(posixpath.dirname(path), unquote(href)))}"

"""A block of known truth without pictures: what cameras over a bumpy ground would measure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np

from cityflow.adjustment.block import rotation_of
from cityflow.adjustment.tracks import Ties
from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.rotations import from_omega_phi_kappa

CAMERA = Camera(1200, 900, 1500.0, 1500.0, 610.0, 445.0, (-0.02, 0.01, 1e-4, -2e-4))
PIXEL_M = 100.0 / 1500.0


@dataclass(frozen=True)
class Scene:
    images: tuple[OrientedImage, ...]
    xyz: np.ndarray
    ties: Ties


def scene(
    seed: int,
    noise_px: float = 0.3,
    wrong: float = 0.02,
    cameras: tuple[Camera, Camera, Camera] = (CAMERA,) * 3,
    mounted: bool = False,
) -> Scene:
    """24 images, level and tilted to both sides, 100 m over hills of 15 m.

    Parameters
    ----------
    wrong : share of the observations that are off by tens of pixels
    cameras : of the level, the left and the right head
    mounted : whether the three heads of a station are on one mount, 20 cm apart; else each image is where and as it likes
    """
    rng = np.random.default_rng(seed)
    images: list[OrientedImage] = []
    for k in range(24):
        station, side = divmod(k, 3)
        omega = np.radians((0.0, 30.0, -30.0)[side]) + rng.normal(0, 0.01)
        rotation = from_omega_phi_kappa(omega, rng.normal(0, 0.01), rng.normal(0, 0.02))
        centre = np.array([5000.0 + 16.0 * (station % 4), 2000.0 + 25.0 * (station // 4) + (0, -55, 55)[side], 100.0])
        image = OrientedImage(f"i{k:02d}", cameras[side], rotation, centre + rng.normal(0, 0.5, 3))
        if mounted and side:
            level = images[-side]
            tilt = (
                from_omega_phi_kappa(np.radians((0.0, 30.0, -30.0)[side]), 0.0, 0.0)
                @ from_omega_phi_kappa(0.0, 0.0, 0.0).T
            )
            image = replace(
                image,
                rotation=tilt @ level.rotation,
                centre=level.centre + level.rotation.T @ np.array([0.0, 0.2 * (3 - 2 * side), 0.05]),
            )
        images.append(image)
    xy = rng.uniform((4980, 1970), (5070, 2060), (450, 2))
    xyz = np.column_stack([xy, 15 * np.sin(xy[:, 0] / 9) * np.cos(xy[:, 1] / 12)])
    seen = []
    for number, image in enumerate(images):
        uv, depth = image.project(xyz)
        for point in np.flatnonzero(image.holds(uv) & (depth > 0)):
            seen.append((point, number, *(uv[point] + rng.normal(0, noise_px, 2))))
    table = np.array(seen)
    off = rng.random(len(table)) < wrong
    table[off, 2:] += rng.normal(0, 20, (int(off.sum()), 2))
    table = table[np.lexsort((table[:, 1], table[:, 0]))]
    places = np.unique(table[:, 0], return_inverse=True)[1]
    ties = Ties(
        places.astype(np.int64), table[:, 1].astype(np.int64), np.arange(len(table)), table[:, 2:], np.ones(len(table))
    )
    return Scene(tuple(images), xyz, ties.some(np.ones(len(table), bool)))


def disturbed(images: Sequence[OrientedImage], position_m: float, angle_px: float, seed: int) -> list[OrientedImage]:
    """The images with poses that are each off by themselves."""
    rng = np.random.default_rng(seed)
    turns = rotation_of(rng.normal(0, angle_px / CAMERA.fx, (len(images), 3)))
    return [
        replace(i, rotation=t @ i.rotation, centre=i.centre + rng.normal(0, position_m, 3))
        for i, t in zip(images, turns, strict=True)
    ]


def parallax_px(images: list[OrientedImage] | tuple[OrientedImage, ...], truth: Scene) -> float:
    """Root mean square vertical parallax of true points between pairs of images that show them, pixels."""
    squares = []
    for a in range(len(images)):
        for b in range(a + 1, len(images)):
            one, other = (truth.images[k].project(truth.xyz) for k in (a, b))
            both = (one[1] > 0) & (other[1] > 0) & truth.images[a].holds(one[0]) & truth.images[b].holds(other[0])
            if both.sum() > 20:
                rays = images[a].rays(one[0][both])
                base = images[b].centre - images[a].centre
                normal = np.cross(base, rays)
                ray = images[b].rays(other[0][both])
                sine = np.sum(normal * ray, axis=1) / np.linalg.norm(normal, axis=1) / np.linalg.norm(ray, axis=1)
                squares.append((sine * CAMERA.fx) ** 2)
    return float(np.sqrt(np.mean(np.concatenate(squares))))


@lru_cache(maxsize=1)
def _texture() -> np.ndarray:
    """Blobs of many sizes, 1600 pixels of 0.1 m around the origin."""
    rng = np.random.default_rng(3)
    layers = [cv2.GaussianBlur(rng.normal(size=(1600, 1600)), (0, 0), s) * s for s in (1.5, 3.0, 6.0, 12.0)]
    total = np.sum(layers, axis=0)
    return np.asarray(np.clip(128 + 45 * total / total.std(), 0, 255), np.float32)


def rendered_ground(image: OrientedImage) -> np.ndarray:
    """(h, w, 1) uint8: level ground at height 0 with a texture, as an image within 80 m of the origin sees it."""
    v, u = np.mgrid[: image.camera.height, : image.camera.width] + 0.5
    rays = image.rays(np.column_stack([u.ravel(), v.ravel()]))
    ground = image.centre + rays * (-image.centre[2] / rays[:, 2])[:, None]
    column, row = ((ground[:, k].reshape(u.shape) * s / 0.1 + 800 - 0.5) for k, s in ((0, 1), (1, -1)))
    picture = cv2.remap(_texture(), column.astype(np.float32), row.astype(np.float32), cv2.INTER_CUBIC)
    return np.asarray(np.clip(picture, 0, 255), np.uint8)[..., None]


def rendered_height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights of the hills that `rendered_hills` shows, metres."""
    return np.asarray(4.0 * np.sin(x / 8.0) * np.cos(y / 10.0))


def rendered_hills(image: OrientedImage) -> np.ndarray:
    """(h, w, 1) uint8: gentle hills with the texture of `rendered_ground`, as an image within 80 m of the origin sees them."""
    v, u = np.mgrid[: image.camera.height, : image.camera.width] + 0.5
    rays = image.rays(np.column_stack([u.ravel(), v.ravel()]))
    height = np.zeros(len(rays))
    for _ in range(12):
        ground = image.centre + rays * ((height - image.centre[2]) / rays[:, 2])[:, None]
        height = rendered_height(ground[:, 0], ground[:, 1])
    column, row = ((ground[:, k].reshape(u.shape) * s / 0.1 + 800 - 0.5) for k, s in ((0, 1), (1, -1)))
    picture = cv2.remap(_texture(), column.astype(np.float32), row.astype(np.float32), cv2.INTER_CUBIC)
    return np.asarray(np.clip(picture, 0, 255), np.uint8)[..., None]

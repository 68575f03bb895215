"""A block of level ground and flat-roofed boxes with a random texture, seen by any camera, with true depths. Exact: every ray is cut with every plane."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.pixels import ArrayPixels

BOXES = np.array([[-9.0, -6.0, -1.0, 3.0, 6.0], [3.0, -4.0, 9.0, 5.0, 3.5]])
"""x and y of two corners, and height."""


@dataclass(frozen=True)
class BoxScene:
    """Ground at height 0 and boxes on it."""

    seed: int = 1
    boxes: FloatArray = field(default_factory=lambda: BOXES)

    def depths(self, image: OrientedImage, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Depth per ray and the number of the face: 0 ground, then roof and four walls of each box."""
        origin = image.centre
        with np.errstate(divide="ignore", invalid="ignore"):
            best = (0.0 - origin[2]) / rays[..., 2]
            face = np.zeros(best.shape, np.int64)
            for n, (x0, y0, x1, y1, top) in enumerate(self.boxes):
                for k, (axis, at) in enumerate([(2, top), (0, x0), (0, x1), (1, y0), (1, y1)]):
                    t = (at - origin[axis]) / rays[..., axis]
                    xyz = origin + t[..., None] * rays
                    inside = np.ones(t.shape, bool)
                    for a, low, high in ((0, x0, x1), (1, y0, y1), (2, 0.0, top)):
                        if a != axis:
                            inside &= (xyz[..., a] >= low) & (xyz[..., a] <= high)
                    nearer = inside & (t > 0) & (t < best)
                    best, face = np.where(nearer, t, best), np.where(nearer, 1 + 5 * n + k, face)
        return best, face

    def truth(self, image: OrientedImage) -> FloatArray:
        """(h, w) depths at pixel centres."""
        return self.depths(image, _rays(image, 1))[0]

    def picture(self, image: OrientedImage, gain: float = 1.0, noise: float = 1.5) -> ArrayPixels:
        """The image as a camera would take it: means of 2 × 2 rays, with noise."""
        rays = _rays(image, 2)
        depth, face = self.depths(image, rays)
        xyz = image.centre + depth[..., None] * rays
        rng = np.random.default_rng(self.seed)
        grey = np.array([110.0, 170.0, 70.0, 90.0, 80.0, 60.0, 140.0, 50.0, 100.0, 75.0, 85.0])[face]
        for cell, strength in ((0.15, 12.0), (0.6, 9.0)):
            texture = cv2.GaussianBlur(rng.standard_normal((512, 512)).astype(np.float32), (0, 0), 1.0)
            texture *= strength / texture.std()
            upright = (face > 0) & ((face - 1) % 5 > 0)
            a = np.where(upright, xyz[..., 0] + xyz[..., 1], xyz[..., 0])
            b = np.where(upright, xyz[..., 2], xyz[..., 1])
            at_x, at_y = (((c / cell + 31.0 * face + 256) % 510).astype(np.float32) for c in (a, b))
            grey = grey + cv2.remap(texture, at_x, at_y, cv2.INTER_LINEAR)
        h, w = image.camera.height, image.camera.width
        grey = gain * grey.reshape(h, 2, w, 2).mean(axis=(1, 3))
        grey += _noise(image, noise)
        return ArrayPixels(np.repeat(np.clip(np.rint(grey), 0, 255).astype(np.uint8)[..., None], 3, axis=2))


def _noise(image: OrientedImage, sigma: float) -> FloatArray:
    rng = np.random.default_rng(sum(image.name.encode()))
    return rng.normal(0.0, sigma, (image.camera.height, image.camera.width))


def _rays(image: OrientedImage, parts: int) -> FloatArray:
    camera = image.camera
    x, y = ((np.arange(n * parts) + 0.5) / parts for n in (camera.width, camera.height))
    return image.rays(np.stack(np.meshgrid(x, y), axis=-1))


def view(
    name: str, centre: tuple[float, float, float], target: tuple[float, float, float], *, focal: float = 1500.0,
    size: tuple[int, int] = (360, 280), up: tuple[float, float, float] = (0.0, 1.0, 0.0), distortion: tuple[float, ...] = (),
) -> OrientedImage:  # fmt: skip
    """A view of a target, upright."""
    at = np.array(centre)
    z = np.array(target) - at
    z /= np.linalg.norm(z)
    x = np.cross(-np.array(up), z)
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    camera = Camera(size[0], size[1], focal, focal, size[0] / 2 + 1.3, size[1] / 2 - 0.8, distortion)
    return OrientedImage(name, camera, rotation, at)


def nadir_views(distortion: tuple[float, ...] = ()) -> list[OrientedImage]:
    """A reference image and partners to the left, to the right and across, GSD 8 cm, turned a little each."""
    places = [(0, 0), (24, 1), (-24, -1), (2, 26)]
    return [
        view(f"nadir{i}", (x, y, 120.0), (0.8 * i - 1, 0.3, 0.0), distortion=distortion, up=(0.03 * i, 1, 0))
        for i, (x, y) in enumerate(places)
    ]


def oblique_views(side: str) -> list[OrientedImage]:
    """45° views: ``across`` the base line, or ``along`` it."""
    if side == "across":
        places, up = [(0, -90), (24, -90), (-24, -91)], (0.0, 1.0, 1.0)
    else:
        places, up = [(-90, 0), (-112, 1), (-70, 0)], (1.0, 0.0, 1.0)
    return [view(f"{side}{i}", (x, y, 90.0), (0.3 * i, 0, 2), up=up) for i, (x, y) in enumerate(places)]

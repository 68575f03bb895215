"""A street of blocks on a plain, painted by a formula, as cameras see it: each pixel's ray is followed to the first surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from box_rays import through_box
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.grid import Grid
from cityflow.core.pixels import ArrayPixels

WALL = np.array([250.0, 30.0, 250.0])
"""No roof and no ground has a colour like it."""


@dataclass(frozen=True)
class Blocks:
    """(N, 6) x_min, y_min, x_max, y_max, floor, top of flat-roofed blocks on the plane z = 0, metres."""

    boxes: np.ndarray

    def heights(self, grid: Grid) -> np.ndarray:
        x, y = grid.x_centres()[None, :], grid.y_centres()[:, None]
        z = np.zeros(grid.shape)
        for x0, y0, x1, y1, _, top in self.boxes:
            z = np.where((x >= x0) & (x < x1) & (y >= y0) & (y < y1), np.maximum(z, top), z)
        return z.astype(np.float32)

    def hit(self, origin: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Distance along each of (N, 3) rays, and whether a wall is hit."""
        with np.errstate(divide="ignore", invalid="ignore"):
            nearest = np.where(rays[:, 2] < 0, -origin[2] / rays[:, 2], np.inf)
        wall = np.zeros(len(rays), bool)
        for box in self.boxes:
            enter, leave = through_box(origin, rays, box[[0, 1, 4]], box[[2, 3, 5]])
            t = enter.max(axis=0)
            hit = (t <= leave) & (t > 0) & (t < nearest)
            nearest = np.where(hit, t, nearest)
            wall = np.where(hit, enter.argmax(axis=0) < 2, wall)
        return nearest, wall


def paint(xyz: np.ndarray, period: float = 7.0) -> np.ndarray:
    """(N, 3) colours of roofs and ground, smooth in the world; roofs are red, ground is green."""
    a = np.sin(2 * np.pi * xyz[:, 0] / period) * np.cos(2 * np.pi * xyz[:, 1] / (1.3 * period))
    roof = xyz[:, 2] > 1.0
    red = np.where(roof, 150 + 40 * a, 40 + 20 * a)
    green = np.where(roof, 50 + 20 * a, 140 + 40 * a)
    return np.column_stack([red, green, 90 + 50 * a])


def photograph(blocks: Blocks, image: OrientedImage, noise: float = 0.0, seed: int = 0) -> ArrayPixels:
    camera = image.camera
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    rays = image.rays(np.column_stack([u.ravel(), v.ravel()]))
    distance, wall = blocks.hit(image.centre, rays)
    colour = np.where(wall[:, None], WALL, paint(image.centre + distance[:, None] * rays))
    colour = colour + np.random.default_rng(seed).normal(0, noise, colour.shape) if noise else colour
    return ArrayPixels(np.clip(np.rint(colour), 0, 255).astype(np.uint8).reshape(camera.height, camera.width, 3))


def looking(
    name: str,
    centre: tuple[float, float, float],
    tilt_deg: float = 0.0,
    towards_deg: float = 0.0,
    camera: Camera | None = None,
) -> OrientedImage:
    """A view tilted from nadir towards a compass direction (0 = north); the picture's top points there."""
    tilt, azimuth = np.radians(tilt_deg), np.radians(towards_deg)
    flat = np.array([np.sin(azimuth), np.cos(azimuth), 0.0])
    axis = np.sin(tilt) * flat + np.cos(tilt) * np.array([0.0, 0.0, -1.0])
    right = np.array([np.cos(azimuth), -np.sin(azimuth), 0.0])
    rotation = np.stack([right, np.cross(axis, right), axis])
    return OrientedImage(name, camera or Camera(600, 500, 620.0, 620.0, 300.0, 250.0), rotation, np.array(centre))

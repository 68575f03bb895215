"""A flight of nine rendered pictures over textured ground, and its catalog with poses that may be off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from adjustment.scenes import rendered_ground
from cityflow.adjustment.block import rotation_of
from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.core.camera import Camera, OrientedImage
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.catalog.stac import Catalog, read_catalog
from cityflow.io.orientation.colmap import write_colmap

CAMERA = Camera(420, 320, 480.0, 480.0, 210.0, 160.0)
ORIGIN = (85000.0, 447000.0, 0.0)


def ground_flight() -> list[OrientedImage]:
    """Nine upright images 50 m over the ground."""
    rng = np.random.default_rng(4)
    return [
        OrientedImage(
            f"i{k}.png",
            CAMERA,
            from_omega_phi_kappa(*rng.normal(0, 0.02, 3)),
            np.array([9.0 * (k % 3) - 9, 9.0 * (k // 3) - 9, 50.0 + rng.normal(0, 1.5)]),
        )
        for k in range(9)
    ]


def ground_pictures(folder: Path, images: list[OrientedImage]) -> Path:
    """The folder with the images' files."""
    folder.mkdir(parents=True)
    for image in images:
        cv2.imwrite(str(folder / image.name), np.repeat(rendered_ground(image), 3, axis=2))
    return folder


def ground_catalog(folder: Path, images: list[OrientedImage], given: list[OrientedImage]) -> Catalog:
    ground_pictures(folder / "images", images)
    write_colmap(folder / "orientation", given, np.empty((0, 3)), (0.0, 0.0, 0.0))
    source = ImageSource(
        folder / "images", {"colmap": folder / "orientation"}, origin=ORIGIN, heights=(-2.0, 2.0), gains=False
    )
    create_catalog(
        folder / "catalog",
        SurveyFiles(images=source),
        crs="EPSG:7415",
        text=SurveyText(title="ground", date="2026-06-21"),
    )
    return read_catalog(str(folder / "catalog"))


def turned(images: list[OrientedImage], off_px: float) -> list[OrientedImage]:
    """The images, each turned by itself."""
    turns = rotation_of(np.random.default_rng(8).normal(0, off_px / CAMERA.fx, (len(images), 3)))
    return [replace(i, rotation=t @ i.rotation) for i, t in zip(images, turns, strict=True)]


def off_px(catalog: Catalog, images: list[OrientedImage]) -> float:
    """Root mean square distance in pixels between where neighbours have the same ground, poses against poses, one shift per survey allowed."""
    truth = {Path(i.name).stem: i for i in images}
    grid = np.stack(np.meshgrid(np.linspace(60, 360, 5), np.linspace(60, 260, 5)), axis=-1).reshape(-1, 2)
    away = []
    for asset in catalog.images:
        true = truth[Path(asset.name).stem]
        rays = true.rays(grid)
        ground = true.centre + rays * (-true.centre[2] / rays[:, 2])[:, None]
        away.append(asset.oriented.project(ground + np.array(ORIGIN))[0] - grid)
    table = np.array(away)
    return float(np.sqrt(np.mean((table - table.mean(axis=(0, 1))) ** 2)))

"""``cityflow orient``: a catalog with spoiled poses becomes one with refined poses; the same again changes nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from rich.console import Console

from adjustment.scenes import rendered_ground
from cityflow.adjustment.block import rotation_of
from cityflow.catalog.create import create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.core.camera import Camera, OrientedImage
from cityflow.errors import CatalogError, WorkflowError
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.catalog.stac import Catalog, read_catalog
from cityflow.io.orientation.colmap import write_colmap
from cityflow.workflow.orient import REPORT, orient_catalog, orient_parameters

CAMERA = Camera(420, 320, 480.0, 480.0, 210.0, 160.0)
ORIGIN = (85000.0, 447000.0, 0.0)


def _flight() -> list[OrientedImage]:
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


def _catalog(folder: Path, images: list[OrientedImage], given: list[OrientedImage]) -> Catalog:
    (folder / "images").mkdir(parents=True)
    for image in images:
        cv2.imwrite(str(folder / "images" / image.name), np.repeat(rendered_ground(image), 3, axis=2))
    write_colmap(folder / "orientation", given, np.empty((0, 3)), (0.0, 0.0, 0.0))
    source = ImageSource(
        folder / "images", {"colmap": folder / "orientation"}, origin=ORIGIN, heights=(-2.0, 2.0), gains=False
    )
    create_catalog(folder / "catalog", images=source, crs="EPSG:7415", title="ground", date="2026-06-21")
    return read_catalog(str(folder / "catalog"))


def _off(catalog: Catalog, images: list[OrientedImage]) -> float:
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


@pytest.mark.cluster
def test_spoiled_poses_are_refined_and_a_repeated_command_keeps_every_byte(tmp_path: Path) -> None:
    images = _flight()
    rng = np.random.default_rng(8)
    turns = rotation_of(rng.normal(0, 0.8 / CAMERA.fx, (len(images), 3)))
    wrong = [replace(i, rotation=t @ i.rotation) for i, t in zip(images, turns, strict=True)]
    given = _catalog(tmp_path, images, wrong)
    console, out = Console(file=(tmp_path / "told.txt").open("w")), tmp_path / "refined"
    orient_catalog(given, out, tmp_path / "work", orient_parameters([]), "", 2, console)
    found = read_catalog(str(out))
    report = json.loads((out / REPORT).read_text())
    assert report["summary"]["refined"]
    assert report["summary"]["weak"] == []
    assert _off(found, images) < 0.3 * _off(given, images)
    assert all(len(a.pose_covariance) == 21 for a in found.images)
    assert [(a.checksum, a.gain, a.heights) for a in found.images] == [
        (a.checksum, a.gain, a.heights) for a in given.images
    ]
    before = {p.name: p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}
    records = sorted((tmp_path / "work" / "records").rglob("*.json"))
    orient_catalog(given, out, tmp_path / "work", orient_parameters([]), "", 1, console)
    assert sorted((tmp_path / "work" / "records").rglob("*.json")) == records
    assert {p.name: p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()} == before


def test_wrong_words_are_answered(tmp_path: Path) -> None:
    with pytest.raises(WorkflowError, match="bound"):
        orient_parameters(["bound_pix=3"])
    images = _flight()[:2]
    given = _catalog(tmp_path, images, images)
    with pytest.raises(CatalogError, match="2 images from the air"):
        orient_catalog(given, tmp_path / "out", tmp_path / "work", orient_parameters([]), "", 1, Console(quiet=True))

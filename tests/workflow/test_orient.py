"""``cityflow orient``: a catalog with spoiled poses becomes one with refined poses; the same again changes nothing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from cityflow.core.camera import OrientedImage
from cityflow.errors import CatalogError, WorkflowError
from cityflow.io.catalog.stac import Catalog, read_catalog
from cityflow.workflow.orient import REPORT, orient_catalog, orient_parameters
from ground_flight import ORIGIN, ground_catalog, ground_flight, turned


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
    images = ground_flight()
    given = ground_catalog(tmp_path, images, turned(images, 0.8))
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
    images = ground_flight()[:2]
    given = ground_catalog(tmp_path, images, images)
    with pytest.raises(CatalogError, match="2 images from the air"):
        orient_catalog(given, tmp_path / "out", tmp_path / "work", orient_parameters([]), "", 1, Console(quiet=True))

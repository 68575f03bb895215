"""``cityflow orient CATALOG --onto``: planes of a scan hold the adjustment of a block; each picture is looked at by a task of its own."""

from __future__ import annotations

import io
import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from pyproj import CRS as CrsOfFile
from rich.console import Console
from typer.testing import CliRunner

from adjustment.scenes import rendered_height, rendered_hills
from cityflow.adjustment.block import rotation_of, vector_of
from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.cli import app
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.points import PointCloud
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.catalog.stac import Catalog, read_catalog
from cityflow.io.orientation.colmap import write_colmap
from cityflow.io.points.las_write import write_points
from cityflow.reporting.orientation_report import FIGURES
from cityflow.runs.orientation_asked import OrientationAsked
from cityflow.workflow.orientation_run import run_orientation

CAMERA = Camera(480, 360, 520.0, 520.0, 240.0, 180.0)
CRS = "EPSG:25832"
ORIGIN = np.array([458000.0, 5428000.0, 100.0])
OFF = np.array([0.4, -0.3, 0.25])
"""Of the whole block, metres; each image is off by 2 cm per axis and half a pixel besides."""


def _flight() -> list[OrientedImage]:
    """Twelve images 50 m over the hills, those of the outer strips tilted inwards."""
    rng = np.random.default_rng(11)
    images = []
    for k in range(12):
        strip, along = divmod(k, 4)
        turn = np.radians([(-12, 0, 12)[strip], 0, 0]) + rng.normal(0, 0.03, 3)
        centre = np.array([9.0 * along - 13.5, 10.0 * strip - 10.0, 50.0]) + rng.normal(0, 0.8, 3)
        images.append(OrientedImage(f"i{k:02d}.png", CAMERA, from_omega_phi_kappa(*turn), centre))
    return images


def _catalog(folder: Path, flight: list[OrientedImage]) -> Catalog:
    rng = np.random.default_rng(3)
    (folder / "images").mkdir(parents=True)
    for image in flight:
        cv2.imwrite(str(folder / "images" / image.name), np.repeat(rendered_hills(image), 3, axis=2))
    turns = rotation_of(rng.normal(0, 0.5 / CAMERA.fx, (len(flight), 3)))
    given = [
        replace(i, rotation=t @ i.rotation, centre=i.centre + OFF + rng.normal(0, 0.02, 3))
        for i, t in zip(flight, turns, strict=True)
    ]
    write_colmap(folder / "orientation", given, np.empty((0, 3)), (0.0, 0.0, 0.0))
    x, y, z = ORIGIN.tolist()
    source = ImageSource(
        folder / "images", {"colmap": folder / "orientation"}, origin=(x, y, z), heights=(94.0, 106.0), gains=False
    )
    text = SurveyText(title="hills", date="2026-06-21")
    create_catalog(folder / "catalog", SurveyFiles(images=source), crs=CRS, text=text)
    return read_catalog(str(folder / "catalog"))


def _scan(path: Path) -> Path:
    """Fourteen points per square metre, exact to 2 cm."""
    rng = np.random.default_rng(9)
    xy = rng.uniform(-38, 38, (80_000, 2))
    xyz = np.column_stack([xy, rendered_height(xy[:, 0], xy[:, 1])]) + rng.normal(0, 0.02, (80_000, 3)) + ORIGIN
    path.write_bytes(write_points(PointCloud.of(xyz), crs=CrsOfFile.from_user_input(CRS)))
    return path


def _off(catalog: Catalog, flight: list[OrientedImage]) -> tuple[float, float]:
    """Centres, metres, and rotations, degrees: root mean square."""
    found = {Path(a.name).stem: a.oriented for a in catalog.images}
    pairs = [(found[Path(i.name).stem], i) for i in flight]
    away = np.array([one.centre - ORIGIN - true.centre for one, true in pairs])
    turns = vector_of(np.array([one.rotation @ true.rotation.T for one, true in pairs]))
    return float(np.sqrt(np.mean(np.sum(away**2, axis=1)))), float(
        np.degrees(np.sqrt(np.mean(np.sum(turns**2, axis=1))))
    )


def _records(work: Path) -> Counter[str]:
    return Counter(p.parent.parent.name for p in (work / "records").rglob("*.json"))


@pytest.mark.cluster
def test_a_scan_holds_a_block_by_a_task_for_each_picture(scheduler: str, tmp_path: Path) -> None:
    flight, out, work = _flight(), tmp_path / "out", tmp_path / "work"
    given = _catalog(tmp_path, flight)
    # the hills repeat themselves after forty metres
    settings = ("registration.shift_m=8", "registration.turn_deg=3")
    asked = OrientationAsked(given.href, str(out), False, settings, onto=(str(_scan(tmp_path / "hills.laz")),))
    told = io.StringIO()

    def run() -> None:
        run_orientation(asked, work, scheduler, 0, Console(file=told, width=400))

    run()
    assert "The survey holds the adjustment by" in told.getvalue()
    centre, angle = _off(read_catalog(str(out)), flight)
    assert _off(given, flight)[0] > 0.5
    assert centre < 0.08
    assert angle < 0.08
    held = json.loads((out / FIGURES).read_text())["registration"]["held"]
    assert sum(held["patches"]) > 100
    records = _records(work)
    assert (records["patches"], records["crops"], records["hold"]) == (1, 12, 1)
    before = {p.name: p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()}
    run()
    assert _records(work) == records
    assert {p.name: p.read_bytes() for p in sorted(out.rglob("*")) if p.is_file()} == before

    # a picture that can no longer be read is left out, and named
    (record,) = (work / "records" / "crops" / "i05").glob("*.json")
    record.unlink()
    (tmp_path / "images" / "i05.png").write_bytes(b"no picture")
    run()
    again, turned = _off(read_catalog(str(out)), flight)
    assert again < 0.08
    assert turned < 0.08
    result = CliRunner().invoke(app, ["status", str(work), "--json"], catch_exceptions=False)
    standing = json.loads(result.output)
    stages = {s["stage"]: (s["tasks"], s["done"], s["failed"]) for s in standing["stages"]}
    assert [*stages] == ["features", "ties", "adjust", "register", "patches", "crops", "hold"]
    assert (stages["patches"], stages["crops"], stages["hold"]) == ((1, 1, 0), (12, 11, 1), (1, 1, 0))
    assert [(p["units"], "i05.png" in p["reason"]) for p in standing["problems"]] == [(["i05"], True)]

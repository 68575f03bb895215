"""``cityflow orient`` on photographs as they should not be: what is wrong is said, and the others are oriented."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rich.console import Console

from adjustment.scenes import rendered_hills
from cityflow import cli
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.photo_metadata import PhotoMetadata
from cityflow.evaluation.poses import PoseFigures, pose_figures
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.images.exif_write import with_exif
from cityflow.reporting.orientation_report import FIGURES

pytestmark = pytest.mark.cluster
CAMERA = Camera(480, 360, 520.0, 520.0, 240.0, 180.0)
ZOOMED = replace(CAMERA, fx=640.0, fy=640.0)
PIXEL_MM = 0.005


@dataclass(frozen=True)
class Ended:
    """What a command left: its report, what it printed, and the poses against the true ones after a similarity."""

    report: dict[str, Any]
    told: str
    figures: PoseFigures


def _strip(prefix: str, east_m: float, cameras: tuple[Camera, ...], seed: int) -> list[OrientedImage]:
    """Two rows of images, 45 m over the hills, some tilted."""
    rng = np.random.default_rng(seed)
    images = []
    for k, camera in enumerate(cameras):
        along, row = divmod(k, 2)
        rotation = from_omega_phi_kappa(*(np.radians([(-12.0, 12.0)[row], 0.0, 0.0]) + rng.normal(0, 0.04, 3)))
        centre = np.array([east_m + 7.0 * along - 7.0, 8.0 * row - 4.0, 45.0]) + rng.normal(0, 0.8, 3)
        images.append(OrientedImage(f"{prefix}{k:02d}", camera, rotation, centre))
    return images


def _jpeg(image: OrientedImage, quality: int = 92, blur_px: float = 0.0) -> bytes:
    pixels = np.repeat(rendered_hills(image), 3, axis=2)
    if blur_px:
        pixels = cv2.GaussianBlur(pixels, (0, 0), blur_px)
    return cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()


def _tagged(image: OrientedImage, data: bytes, number: int, focal: float = 1.0) -> bytes:
    """With a focal length that is the true one by this factor."""
    camera = image.camera
    return with_exif(
        data,
        PhotoMetadata(
            image.name, camera.width, camera.height, "maker", "model", taken=f"2026:06:21 10:00:{number:02d}",
            focal_mm=focal * camera.fx * PIXEL_MM, sensor_width_mm=camera.width * PIXEL_MM,
        ),
    )  # fmt: skip


def _oriented(
    folder: Path,
    pictures: dict[str, bytes],
    truth: list[OrientedImage],
    monkeypatch: pytest.MonkeyPatch,
    scheduler: str,
) -> Ended:
    photos, out = folder / "photos", folder / "out"
    photos.mkdir()
    for name, data in pictures.items():
        (photos / f"{name}.jpg").write_bytes(data)
    command = ["cityflow", "orient", str(photos), "--out", str(out), "--scale", "45", "--scheduler", scheduler]
    monkeypatch.setattr(sys, "argv", command)
    with (folder / "told.txt").open("w") as told:
        monkeypatch.setattr(cli.options, "console", Console(file=told, width=400))
        with pytest.raises(SystemExit) as ended:
            cli.main()
    assert not ended.value.code
    found = [a.oriented for a in read_catalog(str(out)).images]
    seen = [t for t in truth if t.name in {i.name for i in found}]
    figures = pose_figures(found, seen, with_similarity=True)
    return Ended(json.loads((out / FIGURES).read_text()), (folder / "told.txt").read_text(), figures)


def test_a_focal_length_wrong_by_half_blurred_frames_and_doubles(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    images = _strip("i", 0.0, (CAMERA,) * 6, 4)
    pictures = {i.name: _tagged(i, _jpeg(i), k, 1.5) for k, i in enumerate(images)}
    # the same picture, encoded anew, and one that shows nothing sharp
    pictures["again"] = _tagged(images[3], _jpeg(images[3], 70), 30, 1.5)
    blurred = replace(images[5], name="blurred", centre=images[5].centre + np.array([2.0, 1.0, 0.0]))
    pictures["blurred"] = _tagged(blurred, _jpeg(blurred, blur_px=12.0), 31, 1.5)
    ended = _oriented(tmp_path, pictures, images, monkeypatch, scheduler)
    left_out = ended.report["left_out"]
    assert sorted(left_out) in (["again", "blurred"], ["blurred", "i03"])
    assert "the same picture as" in left_out.get("again", left_out.get("i03", ""))
    assert "blurred, dark" in left_out["blurred"]
    assert ended.report["oriented"] == 6
    assert "the files say 780 px, which the pictures contradict" in ended.told
    assert ended.figures.focal_percent < 3
    assert ended.figures.centre_rmse_m < 0.3


def test_a_change_of_zoom_and_two_flights_that_do_not_overlap(
    scheduler: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = _strip("a", -45.0, (*(CAMERA,) * 4, *(ZOOMED,) * 4), 4)
    second = _strip("b", 45.0, (ZOOMED,) * 6, 5)
    pictures = {i.name: _tagged(i, _jpeg(i), k) for k, i in enumerate([*first, *second])}
    ended = _oriented(tmp_path, pictures, [*first, *second], monkeypatch, scheduler)
    assert (
        "the camera changes at a04.jpg (maker model 3.2 mm, 480 × 360 after maker model 2.6 mm, 480 × 360)"
        in ended.told
    )
    assert ended.report["models"] == [8, 6], ended.report["left_out"]
    assert "models that show nothing in common (8, 6 images): flights that do not overlap?" in ended.told
    assert all("belongs to model 2" in ended.report["left_out"][i.name] for i in second)
    assert [c["images"] for c in ended.report["cameras"]] == [4, 4]
    assert ended.figures.images == 8
    assert ended.figures.focal_percent < 3
    assert ended.figures.centre_rmse_m < 0.3

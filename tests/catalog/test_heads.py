"""Which head took an image is known from the orientation and from the file, through the catalog into the adjustment."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from cityflow.adjustment.block import Block
from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
from cityflow.catalog.orientation import ImageSource
from cityflow.core.camera import Camera, OrientedImage
from cityflow.handover.oriented import of_json, to_json
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.orientation.colmap import read_colmap, write_colmap

CAMERA = Camera(160, 120, 150.0, 150.0, 80.0, 60.0)
DOWN = np.diag([1.0, -1.0, -1.0])


def _images(*heads: str) -> list[OrientedImage]:
    return [OrientedImage(f"i{k}.jpg", CAMERA, DOWN, np.array([5.0 * k, 0.0, 50.0]), h) for k, h in enumerate(heads)]


def _written(folder: Path, images: list[OrientedImage], serials: list[str]) -> Path:
    (folder / "images").mkdir(parents=True)
    rng = np.random.default_rng(1)
    for image, serial in zip(images, serials, strict=True):
        exif = Image.Exif()
        exif[0x0110] = "Rig"
        if serial:
            exif.get_ifd(0x8769)[0xA431] = serial
        picture = cv2.GaussianBlur(rng.integers(0, 255, (120, 160, 3)).astype(np.uint8), (0, 0), 2)
        Image.fromarray(picture).save(folder / "images" / image.name, exif=exif)
    write_colmap(folder / "model", images, np.empty((0, 3)))
    source = ImageSource(
        folder / "images",
        {"colmap": folder / "model"},
        origin=(85000.0, 447000.0, 0.0),
        heights=(-1.0, 5.0),
        gains=False,
    )
    create_catalog(
        folder / "catalog",
        SurveyFiles(images=source),
        crs="EPSG:7415",
        text=SurveyText(title="heads", date="2026-06-21"),
    )
    return folder / "catalog"


def test_heads_that_differ_in_nothing_but_their_name_are_two_cameras(tmp_path: Path) -> None:
    """Of two heads with one data sheet, the orientation tells the first two images from the others, serial numbers the last."""
    catalog = _written(tmp_path, _images("left", "left", "right", "right"), ["", "", "S2", "S3"])
    heads = [i.head for i in read_colmap(tmp_path / "model").images]
    assert heads == ["1", "1", "2", "2"]
    assets = read_catalog(str(catalog)).images
    assert [a.oriented.head for a in assets] == ["1 Rig", "1 Rig", "2 Rig S2", "2 Rig S3"]
    assert {a.oriented.camera for a in assets} == {CAMERA}
    block = Block.of([a.oriented for a in assets], np.zeros(3))
    assert block.camera.tolist() == [0, 0, 1, 2]
    assert [block.image(k, "n", np.zeros(3)).head for k in range(4)] == [a.oriented.head for a in assets]


def test_one_head_with_two_focal_lengths_is_two_cameras() -> None:
    images = _images("a", "a")
    images[1] = replace(images[1], camera=replace(CAMERA, fx=151.0, fy=151.0))
    assert Block.of(images, np.zeros(3)).camera.tolist() == [0, 1]


def test_a_task_is_told_the_head_and_what_has_none_stays_as_it_was() -> None:
    named, unnamed = _images("left", "")
    assert of_json(to_json(named)).head == "left"
    assert "head" not in to_json(unnamed)
    assert of_json(to_json(unnamed)).head == ""

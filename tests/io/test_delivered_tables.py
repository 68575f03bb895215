"""BINGO, PATB and ISAT: an example in the program's syntax, and the synthetic flight written in it; mounts of cameras."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import (
    PHOTO_FLIP,
    from_phi_omega_kappa,
    omega_phi_kappa,
    rotation_x,
    rotation_y,
    rotation_z,
)
from cityflow.io.orientation import bingo, isat, opk, patb
from cityflow.io.orientation.oriented_images import OrientationModel
from cityflow.io.orientation.readers import OrientationFile
from delivered_flight import PIXEL_MM, flight, largest_difference_px

CAMERA_SSK = """begin camera_parameters FC550_DJIMFT15mmF1.7ASPH_15.0_4608x3456 (RGB)(1)
    focal_length:                      15.00522620622411729130
    ppac:                              0.02793232590500918308 -0.02181191393910364776
    ppbs:                               0 0
    film_format:                       13.12498944000000200560 17.49998592000000030566
    lens_distortion_flag:              off
    io_required:                       yes
    camera_type:                       frame
    media_type:                        digital
    pixel_size:                        3.79774000000000011568 3.79774000000000011568
    image_size_in_pixels:              3456 4608
    scanline_orientation:              4
    photo_coord_sys_orientation:       1
    photo_coord_sys_origin:            1727.50000000000000000000 2303.50000000000000000000
    antenna_offsets:                   0   0   0
end camera_parameters
"""
PHOTO_SSK = """# photos
begin photo_measurements 1_1 strip_id 1
 7 1.0 2.0 1.0 2.0 1
end photo_measurements

begin photo_parameters 1_1\tstrip_id 1
 camera_name:\tFC550_DJIMFT15mmF1.7ASPH_15.0_4608x3456 (RGB)(1)
 camera_orientation:\t0
 image_id:\tD:\\flight\\DJI_1.JPG
 EO_parameters:\t1000.0\t2000.0\t300.0\t0.0\t0.0\t90.0
end photo_parameters
"""


def _cameras(folder: Path, images: tuple[OrientedImage, ...], **more: Any) -> dict[str, str]:
    """``--cameras`` for the flight: pixels for all; the ids are in the images' names."""
    entries = [
        {"id": key, "width": c.width, "height": c.height, "focal_mm": c.fx * PIXEL_MM, "pixel_mm": PIXEL_MM, "cx": c.cx, "cy": c.cy,
         "images": f"*{key}*", **more.get(key, {})}
        for key, c in {_head(i): i.camera for i in images}.items()
    ]  # fmt: skip
    (folder / "cameras.json").write_text(json.dumps(entries))
    return {"cameras": str(folder / "cameras.json")}


def _head(image: OrientedImage) -> str:
    return next(h for h in ("nadir", "left", "right", "forward", "back") if h in image.name)


def _given(path: Path, text: str, options: dict[str, str]) -> OrientationFile:
    path.write_text(text)
    return OrientationFile(path, options, lambda _: (900, 600))


def _grads(image: OrientedImage) -> tuple[float, float, float]:
    """φ, ω, κ of Ry(φ) Rx(ω) Rz(κ), grads."""
    m = PHOTO_FLIP @ image.rotation
    omega = np.arcsin(-m[2, 1])
    return tuple(np.array([np.arctan2(m[2, 0], m[2, 2]), omega, np.arctan2(m[0, 1], m[1, 1])]) * 200 / np.pi)


def test_bingo(tmp_path: Path) -> None:
    images = flight()
    lines = ["* iteration 5", "C comment"]
    for image in images:
        values = (*image.centre, *_grads(image))
        lines.append(f"ORIA {image.name} " + " ".join(f"{v:.12f}" for v in values) + f" {_head(image)}")
    lines += ["CORD 11 458001.5 5428002.5 111.25 0.01", "CORD 12 458003.5 5428004.5 112.25"]
    model = bingo.read(_given(tmp_path / "itera.dat", "\n".join(lines), _cameras(tmp_path, images)))
    assert largest_difference_px(model, images) < 1e-6
    assert model.sparse == pytest.approx(np.array([[458001.5, 5428002.5, 111.25], [458003.5, 5428004.5, 112.25]]))
    assert model.pixel_mm[model.images[0].name] == PIXEL_MM
    (tmp_path / "geoin.dat").write_text("CAPA 1 0 80.123 0.01 -0.02\n")
    (note,) = bingo.read(_given(tmp_path / "itera.dat", "\n".join(lines), _cameras(tmp_path, images))).notes
    assert "geoin.dat has a focal length of 80.123 mm" in note


def test_the_angles_of_bingo_are_those_of_its_matrix() -> None:
    """Elements of BINGO's matrix photo_from_world as programs that read it have them."""
    phi, omega, kappa = 0.3, -0.2, 1.1
    m = PHOTO_FLIP @ from_phi_omega_kappa(phi, omega, kappa)
    s, c = np.sin, np.cos
    assert m[0, 0] == pytest.approx(c(kappa) * c(phi) + s(kappa) * s(omega) * s(phi))
    assert m[1, 2] == pytest.approx(s(kappa) * s(phi) + c(kappa) * s(omega) * c(phi))
    assert m[2] == pytest.approx([c(omega) * s(phi), -s(omega), c(omega) * c(phi)])


@pytest.mark.parametrize("rows", ["photo-axes", "world-axes"])
def test_patb(tmp_path: Path, rows: str) -> None:
    images = flight()
    lines = []
    for image in images:
        m = PHOTO_FLIP @ image.rotation
        m = m if rows == "photo-axes" else m.T
        lines.append(
            f" {image.name} {image.camera.fx * PIXEL_MM * 1000:.6f} " + " ".join(f"{v:.9f}" for v in image.centre)
        )
        lines += ["    " + " ".join(f"{v:.15f}" for v in row) for row in m]
    options = _cameras(tmp_path, images) | {"matrix": rows}
    model = patb.read(_given(tmp_path / "town.ori", "\n".join([*lines, "-99", ""]), options))
    assert largest_difference_px(model, images) < 1e-6
    assert not model.notes


def test_what_is_wrong_in_patb_is_named(tmp_path: Path) -> None:
    images = flight()
    camera = next(i.camera for i in images if "nadir" in i.name)
    good = "nadir_1 153.0 1 2 3 1 0 0 0 1 0 0 0 1\n"
    model = patb.read(
        _given(tmp_path / "a.ori", good + "nadir_2 153.0 1 2 3 1 0 0 0 1 0 0\n-99\n", _cameras(tmp_path, images))
    )
    assert [i.name for i in model.images] == ["nadir_1"]
    assert "a.ori, line 2: image nadir_2 has 11 numbers instead of 13" in str(model.left_out[0])
    assert f"nadir_1 has a focal length of 153 mm, its camera {camera.fx * PIXEL_MM:.3f} mm" in model.notes[0]
    with pytest.raises(CatalogError, match="no image in the file"):
        patb.read(_given(tmp_path / "a.ori", "-99\n", _cameras(tmp_path, images)))
    with pytest.raises(CatalogError, match=r"has no cameras → name them with --cameras"):
        patb.read(_given(tmp_path / "a.ori", good, {}))


def test_isat(tmp_path: Path) -> None:
    images = flight()
    photos, cameras = [], []
    for key, c in {_head(i): i.camera for i in images}.items():
        ppac = (c.cx - c.width / 2) * PIXEL_MM, -(c.cy - c.height / 2) * PIXEL_MM
        cameras += [
            f"begin camera_parameters {key}", f"  focal_length: {c.fx * PIXEL_MM:.17g}", f"  ppac: {ppac[0]:.17g} {ppac[1]:.17g}", "  camera_type: frame",
            f"  pixel_size: {PIXEL_MM * 1e3} {PIXEL_MM * 1e3}", f"  image_size_in_pixels: {c.height} {c.width}", "  photo_coord_sys_orientation: 1",
            f"  photo_coord_sys_origin: {(c.height - 1) / 2} {(c.width - 1) / 2}", "end camera_parameters",
        ]  # fmt: skip
    for image in images:
        values = (*image.centre, *np.degrees(omega_phi_kappa(image.rotation)))
        photos += [
            f"begin photo_parameters {image.name} strip_id 1", f" camera_name: {_head(image)}", " EO_parameters:\t" + "\t".join(f"{v:.12f}" for v in values),
            "end photo_parameters", "",
        ]  # fmt: skip
    (tmp_path / "camera").write_text("\n".join(cameras))
    model = isat.read(_given(tmp_path / "photo", "\n".join(photos), {}))
    assert largest_difference_px(model, images) < 1e-6


@pytest.mark.parametrize("size", [(4608, 3456), None])
def test_the_example_of_isat(tmp_path: Path, size: tuple[int, int] | None) -> None:
    (tmp_path / "a_camera.ssk").write_text(CAMERA_SSK)
    (tmp_path / "a_photo.ssk").write_text(PHOTO_SSK)
    (image,) = isat.read(OrientationFile(tmp_path / "a_photo.ssk", {}, lambda _: size)).images
    assert (image.name, image.camera.width, image.camera.height) == ("DJI_1.JPG", 4608, 3456)
    assert image.camera.fx == pytest.approx(15.00522620622 / 0.00379774)
    assert (image.camera.cx, image.camera.cy) == pytest.approx(
        (2304 + 0.027932326 / 0.00379774, 1728 + 0.021811914 / 0.00379774)
    )
    north, _ = image.project(np.array([[1000.0, 2010.0, 200.0]]))  # the top of the picture looks to the west
    assert north[0] - (image.camera.cx, image.camera.cy) == pytest.approx([image.camera.fx / 10, 0.0], abs=1e-6)


@pytest.mark.parametrize(("before", "after", "match"), [
    ("flag:              off", "flag:              on", "a_photo.ssk, line 6: camera FC550.*: its table of lens distortion is not read"),
    ("orientation:       1", "orientation:       2", "its frame is turned"), ("3456 4608", "3456 4600", "it has 4600 × 3456 pixels, the image 4608 × 3456"),
    ("    focal_length:                      15.005", "    focal_length:                      l5.005", "'l5.0052.*' in focal_length"),
])  # fmt: skip
def test_a_camera_of_isat_that_cannot_be_used(tmp_path: Path, before: str, after: str, match: str) -> None:
    assert before in CAMERA_SSK
    (tmp_path / "a_camera.ssk").write_text(CAMERA_SSK.replace(before, after))
    (tmp_path / "a_photo.ssk").write_text(PHOTO_SSK)
    model = isat.read(OrientationFile(tmp_path / "a_photo.ssk", {}, lambda _: (4608, 3456)))
    with pytest.raises(AssertionError, match=match):
        raise AssertionError(str(model.left_out[0]))


def test_files_of_isat_and_bingo_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="the camera file is missing"):
        isat.read(_given(tmp_path / "photo", PHOTO_SSK, {}))
    with pytest.raises(CatalogError, match=r"photo:6: photo_parameters 1_1 does not end"):
        isat.read(_given(tmp_path / "photo", PHOTO_SSK.replace("end photo_parameters", ""), {}))
    options = _cameras(tmp_path, flight())
    with pytest.raises(CatalogError, match="no line ORIA"):
        bingo.read(_given(tmp_path / "itera.dat", "CORD 1 2 3 4\n", options))
    model = bingo.read(_given(tmp_path / "itera.dat", "ORIA nadir_1 1 2 3 4 5 6o\nORIA other 1 2 3 4 5 6\n", options))
    assert "itera.dat, line 1: '6o' in the orientation is no number" in str(model.left_out[0])
    assert "line 2: none or several of the cameras" in str(model.left_out[1])


def _opk(folder: Path, images: tuple[OrientedImage, ...], attitudes: list[FloatArray], **more: Any) -> OrientationModel:
    lines = [
        " ".join([i.name, *(f"{v:.12f}" for v in (*i.centre, *np.degrees(omega_phi_kappa(a))))])
        for i, a in zip(images, attitudes, strict=True)
    ]  # fmt: skip
    return opk.read(_given(folder / "table.txt", "\n".join(lines), _cameras(folder, images, **more)))


def test_boresight_and_mounts_are_applied(tmp_path: Path) -> None:
    """Truth by matrices alone: world_from_photo = world_from_body · Rx Ry Rz; the table has the body's angles."""
    images = flight()
    mounts = {
        "nadir": (0.2, -0.1, 0.3),
        "left": (-45.2, 0.1, 90.0),
        "right": (45.0, 0.3, -90.1),
        "forward": (0.1, -44.8, 180.0),
        "back": (1.0, 40.0, 0.5),
    }
    bodies = []
    for image in images:
        o, p, k = np.radians(mounts[_head(image)])
        world_from_photo = (PHOTO_FLIP @ image.rotation).T
        bodies.append(PHOTO_FLIP @ (world_from_photo @ (rotation_x(o) @ rotation_y(p) @ rotation_z(k)).T).T)
    more = {h: dict(zip(("mount_omega", "mount_phi", "mount_kappa"), m, strict=True)) for h, m in mounts.items()}
    assert largest_difference_px(_opk(tmp_path, images, bodies, **more), images) < 1e-6


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_pictures_that_are_stored_turned(tmp_path: Path, quarters: int) -> None:
    """A picture turned clockwise by 90° shows its top at its right: (u, v) of before is now (height - v, u)."""
    upright = tuple(i for i in flight() if "nadir" in i.name)
    stored = []
    for image in upright:
        c, rotation = image.camera, image.rotation
        for _ in range(quarters):
            c = replace(c, width=c.height, height=c.width, fx=c.fy, fy=c.fx, cx=c.height - c.cy, cy=c.cx)
            rotation = np.array([-rotation[1], rotation[0], rotation[2]])
        stored.append(OrientedImage(image.name, c, rotation, image.centre))
    model = _opk(tmp_path, tuple(stored), [i.rotation for i in upright], nadir={"turn_deg": 90 * quarters})
    assert largest_difference_px(model, tuple(stored)) < 1e-6
    place = upright[0].centre - [3.0, 5.0, 100.0]
    (before,), (after,) = (i.project(place[None])[0] for i in (upright[0], stored[0]))
    w, h = upright[0].camera.width, upright[0].camera.height
    expected = {1: (h - before[1], before[0]), 2: (w - before[0], h - before[1]), 3: (before[1], w - before[0])}[
        quarters
    ]
    assert after == pytest.approx(expected)

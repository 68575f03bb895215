from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest

from cityflow.core.camera import FISHEYE, Camera, OrientedImage
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import from_omega_phi_kappa
from cityflow.io.orientation.colmap import read_colmap, write_colmap
from cityflow.io.orientation.colmap_cameras import MODELS, camera_of

CAMERAS = (
    Camera(4000, 3000, 3500.5, 3500.5, 2001.25, 1499.75),
    Camera(4000, 3000, 3500.5, 3490.1, 2001.25, 1499.75, (-0.1, 0.02, 1e-4, -2e-4)),
    Camera(4000, 3000, 3500.5, 3490.1, 2001.25, 1499.75, (-0.1, 0.02, 1e-4, -2e-4, 0.003, 0.01, 0.002, -0.001)),
    Camera(4000, 3000, 1500.5, 1490.1, 2001.25, 1499.75, (-0.01, 0.002, 1e-4, -2e-4), FISHEYE),
)


def _images(seed: int, count: int = 12) -> list[OrientedImage]:
    rng = np.random.default_rng(seed)
    return [
        OrientedImage(
            f"strip {i % 3}/img_{i:03d}.jpg", CAMERAS[i % len(CAMERAS)], from_omega_phi_kappa(*rng.normal(0, 0.5, 3)),
            rng.uniform((340_100, 547_600, 400), (341_100, 548_600, 600)),
        )
        for i in range(count)
    ]  # fmt: skip


def _write(folder: Path, cameras: str, images: str, points: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    for name, text in (("cameras", cameras), ("images", images), ("points3D", points)):
        (folder / f"{name}.txt").write_text(text)
    return folder


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("origin", [(0.0, 0.0, 0.0), (340_600.0, 548_100.0, 0.0)])
def test_round_trip(tmp_path: Path, seed: int, origin: tuple[float, float, float]) -> None:
    images = sorted(_images(seed), key=lambda i: i.name)
    sparse = np.random.default_rng(seed).uniform(0, 1e6, (50, 3))
    write_colmap(tmp_path, images, sparse, origin)
    model = read_colmap(tmp_path).moved(origin)
    assert [i.name for i in model.images] == [i.name for i in images]
    assert [i.camera for i in model.images] == [i.camera for i in images]
    for read, given in zip(model.images, images, strict=True):
        assert np.abs(read.rotation - given.rotation).max() < 1e-12
        assert np.abs(read.centre - given.centre).max() < 1e-9
    assert np.abs(model.sparse - sparse).max() < 1e-9
    assert model.left_out == ()


def test_pose_by_hand(tmp_path: Path) -> None:
    """A camera that looks straight down from 100 m over (10, 20): a half turn about x, and t = −R·c."""
    folder = _write(tmp_path / "m", "1 SIMPLE_PINHOLE 200 100 50 100 50\n", "7 0 1 0 0 -10 20 100 1 a.jpg\n\n")
    image = read_colmap(folder).images[0]
    assert image.centre == pytest.approx((10, 20, 100))
    assert image.axis == pytest.approx((0, 0, -1))
    uv, depth = image.project(np.array([[12.0, 22.0, 0.0]]))
    # two metres east are right of the centre, two metres north above it
    assert uv[0] == pytest.approx((101, 49))
    assert depth[0] == pytest.approx(100)


POSE = "1 0 0 0 1 2 3"


@pytest.mark.parametrize(
    "text",
    [
        f"# list\n1 {POSE} 1 a.jpg\n\n2 {POSE} 1 b c.jpg\n\n",
        f"1 {POSE} 1 a.jpg\n10.5 20 -1 3 4 5\n2 {POSE} 1 b c.jpg\n1 2 -1\n",
        f"1 {POSE} 1 a.jpg\n2 {POSE} 1 b c.jpg\n",
        f"1 {POSE} 1 a.jpg\r\n\r\n2 {POSE} 1 b c.jpg\r\n",
    ],
    ids=["empty lines", "points", "no lines", "windows"],
)
def test_lines_of_points_may_be_empty_or_missing(tmp_path: Path, text: str) -> None:
    model = read_colmap(_write(tmp_path / "m", "1 PINHOLE 200 100 50 50 100 50\n", text))
    assert [i.name for i in model.images] == ["a.jpg", "b c.jpg"]


def test_binary_is_text(tmp_path: Path) -> None:
    """The binary files of the same model, written field by field after COLMAP's documentation."""
    images = _images(3, 5)
    write_colmap(tmp_path / "text", images, np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]))
    text = read_colmap(tmp_path / "text")
    folder = tmp_path / "binary"
    folder.mkdir()
    _to_binary(tmp_path / "text", folder)
    binary = read_colmap(folder)
    assert [i.name for i in binary.images] == [i.name for i in text.images]
    assert [i.camera for i in binary.images] == [i.camera for i in text.images]
    assert all(np.array_equal(a.centre, b.centre) for a, b in zip(binary.images, text.images, strict=True))
    assert np.array_equal(binary.sparse, text.sparse)
    for name in ("cameras.bin", "images.bin", "points3D.bin"):
        whole = (folder / name).read_bytes()
        (folder / name).write_bytes(whole[:-3])
        with pytest.raises(CatalogError, match="damaged"):
            read_colmap(folder)
        (folder / name).write_bytes(whole)


def _to_binary(source: Path, folder: Path) -> None:
    lines = {
        n: [x for x in (source / n).read_text().splitlines() if x and x[0] != "#"]
        for n in ("cameras.txt", "images.txt", "points3D.txt")
    }
    data = struct.pack("<Q", len(lines["cameras.txt"]))
    for line in lines["cameras.txt"]:
        number, model, width, height, *params = line.split()
        data += struct.pack("<iiQQ", int(number), MODELS[model][0], int(width), int(height))
        data += struct.pack(f"<{len(params)}d", *map(float, params))
    (folder / "cameras.bin").write_bytes(data)
    data = struct.pack("<Q", len(lines["images.txt"]))
    for line in lines["images.txt"]:
        number, *pose, camera, name = line.split(maxsplit=9)
        data += struct.pack("<i7di", int(number), *map(float, pose), int(camera)) + name.encode() + b"\0"
        data += struct.pack("<Q", 2) + struct.pack("<ddq", 1, 2, -1) * 2
    (folder / "images.bin").write_bytes(data)
    data = struct.pack("<Q", len(lines["points3D.txt"]))
    for line in lines["points3D.txt"]:
        number, x, y, z, *_ = line.split()
        data += struct.pack("<Q3d3Bd", int(number), float(x), float(y), float(z), 1, 2, 3, 0.5)
        data += struct.pack("<Q", 1) + struct.pack("<ii", 1, 0)
    (folder / "points3D.bin").write_bytes(data)


@pytest.mark.parametrize(
    ("model", "params", "coefficients"),
    [
        ("SIMPLE_RADIAL", (900, 500, 400, -0.05), (-0.05, 0, 0, 0)),
        ("RADIAL", (900, 500, 400, -0.05, 0.01), (-0.05, 0.01, 0, 0)),
        ("OPENCV", (900, 905, 500, 400, -0.05, 0.01, 0.001, -0.002), (-0.05, 0.01, 0.001, -0.002)),
        (
            "FULL_OPENCV", (900, 905, 500, 400, -0.05, 0.01, 0.001, -0.002, 0.003, 0.01, -0.02, 0.004),
            (-0.05, 0.01, 0.001, -0.002, 0.003, 0.01, -0.02, 0.004),
        ),
    ],
)  # fmt: skip
def test_distortions_are_opencvs(model: str, params: tuple[float, ...], coefficients: tuple[float, ...]) -> None:
    camera = camera_of(model, 1000, 800, params)
    xy = np.random.default_rng(4).uniform(-0.5, 0.5, (20, 2))
    points = np.column_stack([xy, np.ones(20)])
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, np.array(coefficients, float))
    assert camera.distort(xy) == pytest.approx(expected[:, 0], abs=1e-9)


@pytest.mark.parametrize(
    ("model", "k"),
    [
        ("SIMPLE_RADIAL_FISHEYE", (0.02,)),
        ("RADIAL_FISHEYE", (0.02, -0.01)),
        ("OPENCV_FISHEYE", (0.02, -0.01, 0.003, 0.001)),
    ],
)
def test_fisheyes_are_opencvs(model: str, k: tuple[float, ...]) -> None:
    focal = (500.0, 500.0) if model == "OPENCV_FISHEYE" else (500.0,)
    camera = camera_of(model, 1000, 800, (*focal, 500, 400, *k))
    xy = np.random.default_rng(5).uniform(-1.5, 1.5, (20, 2))
    full = np.zeros(4)
    full[: len(k)] = k
    points = np.column_stack([xy, np.ones(20)])[:, None]
    expected, _ = cv2.fisheye.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix, full)
    assert camera.distort(xy) == pytest.approx(expected[:, 0], abs=1e-9)


def test_an_unknown_camera_model_costs_its_images_alone(tmp_path: Path) -> None:
    cameras = "1 PINHOLE 200 100 50 50 100 50\n2 THIN_PRISM_FISHEYE 200 100 50 50 100 50 0 0 0 0 0 0 0 0\n3 FOV 200 100 50 50 100 50 0.9\n"
    images = f"1 {POSE} 1 a.jpg\n\n2 {POSE} 2 b.jpg\n\n3 {POSE} 3 c.jpg\n\n4 {POSE} 9 d.jpg\n\n"
    model = read_colmap(_write(tmp_path / "m", cameras, images))
    assert [i.name for i in model.images] == ["a.jpg"]
    words = {o.name: o.problem for o in model.left_out}
    assert "THIN_PRISM_FISHEYE" in words["b.jpg"]
    assert "FOV" in words["c.jpg"]
    assert "no camera 9" in words["d.jpg"]


def test_damage_and_absence_are_named(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="no COLMAP model"):
        read_colmap(tmp_path)
    with pytest.raises(CatalogError, match=r"images.txt, line 1"):
        read_colmap(_write(tmp_path / "m", "1 PINHOLE 200 100 50 50 100 50\n", "1 0.5 zero 0 0 1 2 3 1 a.jpg\n\n"))
    twice = _write(tmp_path / "t", "1 PINHOLE 200 100 50 50 100 50\n", f"1 {POSE} 1 a.jpg\n\n2 {POSE} 1 a.jpg\n\n")
    assert [o.name for o in read_colmap(twice).left_out] == ["a.jpg"]

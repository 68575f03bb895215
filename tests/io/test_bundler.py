from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cityflow.errors import CatalogError
from cityflow.io.orientation.bundler import read_bundler

POINTS = np.array([[10.0, 5.0, 2.0], [-20.0, 8.0, -3.0], [4.0, -12.0, 1.0]])
ROTATION = np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
TRANSLATION = np.array([1.0, -2.0, -150.0])
F, K1, K2 = 1200.0, -0.07, 0.02


def _bundle(folder: Path, names: str = "a.jpg 0 1200\nb.jpg\n") -> Path:
    def row(values: np.ndarray) -> str:
        return " ".join(f"{v:.12g}" for v in values)

    camera = "\n".join([f"{F} {K1} {K2}", *(row(r) for r in ROTATION), row(TRANSLATION)])
    nothing = "\n".join(["0 0 0", "0 0 0", "0 0 0", "0 0 0", "0 0 0"])
    points = "\n".join(f"{row(p)}\n255 0 0\n1 0 5 1.0 2.0" for p in POINTS)
    path = folder / "bundle.out"
    path.write_text(f"# Bundle file v0.3\n2 {len(POINTS)}\n{camera}\n{nothing}\n{points}\n")
    (folder / "list.txt").write_text(names)
    return path


def test_projection_is_bundlers(tmp_path: Path) -> None:
    """P = R X + t; p = −P.xy / P.z; f r(p) p, with x right and y up from the centre of the image."""
    model = read_bundler(_bundle(tmp_path), lambda name: (1600, 1200))
    (image,) = model.images
    local = POINTS @ ROTATION.T + TRANSLATION
    p = -local[:, :2] / local[:, 2:]
    r2 = (p**2).sum(axis=1, keepdims=True)
    expected = F * (1 + K1 * r2 + K2 * r2**2) * p * (1, -1) + (800, 600)
    uv, depth = image.project(POINTS)
    assert uv == pytest.approx(expected, abs=1e-9)
    assert (depth > 0).all()
    assert model.sparse == pytest.approx(POINTS)
    assert [o.name for o in model.left_out] == ["b.jpg"]
    assert "no orientation" in model.left_out[0].problem


def test_an_unreadable_image_is_left_out(tmp_path: Path) -> None:
    model = read_bundler(_bundle(tmp_path), lambda name: None)
    assert model.images == ()
    assert [o.name for o in model.left_out] == ["a.jpg", "b.jpg"]


def test_damage_is_named(tmp_path: Path) -> None:
    with pytest.raises(CatalogError, match="2 cameras, but 1 images"):
        read_bundler(_bundle(tmp_path, "a.jpg\n"), lambda name: (1600, 1200))
    path = _bundle(tmp_path)
    path.write_text("\n".join(path.read_text().splitlines()[:-4]))
    with pytest.raises(CatalogError, match="ends too early"):
        read_bundler(path, lambda name: (1600, 1200))
    (tmp_path / "list.txt").unlink()
    with pytest.raises(CatalogError, match="list of images is missing"):
        read_bundler(path, lambda name: (1600, 1200))

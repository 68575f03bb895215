"""The Khronos validator on what is written; needs node and its package gltf-validator (installed, or on NODE_PATH)."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from cityflow.core.building import Building
from cityflow.core.reference import Reference
from cityflow.core.texture import Drape
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.coarse_glb import write_coarse_glb
from cityflow.io.city_models.coarse_scene import coarse_of
from cityflow.io.city_models.gltf import write_buildings_glb, write_terrain_glb
from cityflow.io.export_formats.formats import written
from cityflow.io.export_formats.tile import CityTile
from cityflow.io.globe_frame import frame_at
from painted_faces import painted

NODE = shutil.which("node")
_VALIDATE = """
const validator = require("gltf-validator"), fs = require("fs"), path = require("path");
const file = process.argv[1], beside = (uri) => path.join(path.dirname(file), decodeURIComponent(uri));
const bytes = (name) => new Uint8Array(fs.readFileSync(name));
validator.validateBytes(bytes(file), { uri: file, externalResourceFunction: async (uri) => bytes(beside(uri)) })
  .then((report) => console.log(JSON.stringify(report)));
"""
FRAME = frame_at(None, (85000.0, 447500.0, 0.0))


def _has_validator() -> bool:
    if NODE is None:
        return False
    return subprocess.run([NODE, "-e", 'require("gltf-validator")'], capture_output=True, check=False).returncode == 0


pytestmark = pytest.mark.skipif(not _has_validator(), reason="node with gltf-validator is not installed")


def _report(data: bytes, folder: Path) -> dict[str, int]:
    path = folder / "written.glb"
    path.write_bytes(data)
    assert NODE is not None
    done = subprocess.run([NODE, "-e", _VALIDATE, str(path)], capture_output=True, text=True, check=True, timeout=60)
    issues = json.loads(done.stdout)["issues"]
    return {kind: issues[f"num{kind}"] for kind in ("Errors", "Warnings")}


@pytest.mark.parametrize("rectified", [True, False])
def test_buildings_have_no_faults(neighbours: list[Building], tmp_path: Path, rectified: bool) -> None:
    paint = painted(neighbours, rectified=rectified)
    paint.save(tmp_path)
    folder = tmp_path / "products/tiles3d/t"
    folder.mkdir(parents=True)
    data = write_buildings_glb("t", neighbours, FRAME, Appearance("products/tiles3d/t", paint.textures))
    assert _report(data, folder) == {"Errors": 0, "Warnings": 0}


@pytest.mark.parametrize("draped", [True, False])
def test_terrain_has_no_faults(
    terrain: tuple[np.ndarray, np.ndarray], neighbours: list[Building], tmp_path: Path, draped: bool
) -> None:
    paint = painted(neighbours)
    paint.save(tmp_path)
    drape = Drape(paint.textures.pages[0], (84950.0, 447480.0, 85050.0, 447580.0)) if draped else None
    data = write_terrain_glb("t", *terrain, FRAME, Appearance("", drape=drape))
    assert _report(data, tmp_path) == {"Errors": 0, "Warnings": 0}


@pytest.mark.parametrize("is_whole", [True, False])
def test_what_stands_far_away_has_no_faults(
    terrain: tuple[np.ndarray, np.ndarray], neighbours: list[Building], tmp_path: Path, is_whole: bool
) -> None:
    paint, bounds = painted(neighbours), (84950.0, 447480.0, 85050.0, 447580.0)
    paint.save(tmp_path)
    drape = Drape(paint.textures.pages[0], bounds) if is_whole else None
    coarse = coarse_of(neighbours, *terrain, bounds, paint.textures, drape, lambda path: (tmp_path / path).read_bytes())
    assert _report(write_coarse_glb("t", coarse, FRAME, is_whole=is_whole), tmp_path) == {"Errors": 0, "Warnings": 0}


@pytest.mark.parametrize("textured", [True, False])
def test_a_tile_as_glb_has_no_faults(
    neighbours: list[Building], amersfoort: Reference, tmp_path: Path, textured: bool
) -> None:
    paint = painted(neighbours, rectified=True)
    paint.save(tmp_path)
    folder = tmp_path / "products/glb"
    folder.mkdir(parents=True)
    terrain = (
        np.array([[84950.0, 447480.0, 0.0], [85050.0, 447480.0, 0.0], [85050.0, 447580.0, 0.0]]),
        np.array([[0, 1, 2]]),
    )
    tile = CityTile(
        "t", (84950.0, 447480.0, 85050.0, 447580.0), tuple(neighbours), terrain, [terrain], amersfoort, "A town", "2026-01-01",
        rectified=paint.textures if textured else None,
    )  # fmt: skip
    ((_, data),) = written("glb", tile)
    assert _report(data, folder) == {"Errors": 0, "Warnings": 0}

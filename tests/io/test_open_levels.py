"""However many images are looked at, few files are open, and what was closed is opened again."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from cityflow.io.images import tiled_images as images
from cityflow.io.images.image_write import png_bytes
from cityflow.io.images.tiled_images import open_image, tile_image


def test_few_files_are_open(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(images, "OPEN_LEVELS", 8)
    opened = []
    for k in range(24):
        source, tiled = tmp_path / f"{k}.png", tmp_path / f"{k}.tif"
        source.write_bytes(png_bytes(np.full((300, 300, 3), k + 1, np.uint8)))
        tile_image(source, tiled)
        opened.append(open_image(tiled))
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(2):
        for level in (0, 1):
            shown = [int(i.window((0, 4), (0, 4), level).mean()) for i in opened]
            assert shown == list(range(1, 25))
    assert len(os.listdir("/proc/self/fd")) <= before + 8
    for image in opened:
        image.close()
    assert not images._LATELY.keys() & {(id(i), level) for i in opened for level in (0, 1)}

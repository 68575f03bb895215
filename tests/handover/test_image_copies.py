"""Copies of images of a far store: fetched once, gone when there is no room and nobody has them open."""

from __future__ import annotations

import gc
import uuid
from pathlib import Path

import numpy as np

from cityflow.flow.store import Store
from cityflow.handover.image_copies import ImageCopies
from cityflow.io.images import tiled_images as images
from cityflow.io.images.image_write import png_bytes
from cityflow.io.images.tiled_images import tile_image

COUNT = 5


def far_images(folder: Path) -> tuple[Store, list[str]]:
    store = Store.open(f"memory://{uuid.uuid4().hex}")
    (folder / "a.png").write_bytes(png_bytes(np.random.default_rng(0).integers(0, 256, (200, 200, 3)).astype(np.uint8)))
    tile_image(folder / "a.png", folder / "a.tif")
    paths = [f"work/ingest/{k}/image.tif" for k in range(COUNT)]
    for path in paths:
        store.put_file(folder / "a.tif", path)
    return store, paths


def test_an_image_is_fetched_once(tmp_path: Path) -> None:
    store, paths = far_images(tmp_path)
    (tmp_path / "copies").mkdir()
    copies = ImageCopies(tmp_path / "copies")
    first = copies.open(store, paths[0])
    assert copies.open(store, paths[0]) is first
    del first
    store.remove(paths[0])
    assert copies.open(store, paths[0]).window((0, 2), (0, 2)).shape == (2, 2, 3)


def test_what_is_open_stays(tmp_path: Path) -> None:
    store, paths = far_images(tmp_path)
    (tmp_path / "copies").mkdir()
    copies = ImageCopies(tmp_path / "copies", room_bytes=2 * (tmp_path / "a.tif").stat().st_size)
    held = [copies.open(store, p) for p in paths]
    assert len(list((tmp_path / "copies").iterdir())) == COUNT, "all of them are in use"
    assert all(i.window((0, 2), (0, 2)).shape == (2, 2, 3) for i in held)
    for image in held:
        image.close()
    del held, image
    gc.collect()
    assert not [i for i in images._LATELY.values() if i.path.startswith(str(tmp_path))]
    copies.open(store, paths[-1])
    assert len(list((tmp_path / "copies").iterdir())) == 2
    assert copies.open(store, paths[0]).window((0, 2), (0, 2)).shape == (2, 2, 3), "fetched anew"

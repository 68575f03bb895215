"""Time of textures of 73 faces with about 100 candidates each, from images of 15 megapixels of one block, without a run: true hulls, true surface.

    python benchmarks/texture_block.py FOLDER [--seed 9304] [--processes 2]      # some 190 images, kept in FOLDER

Of each image only the window around the faces is rendered, the rest of its 15 megapixels is grey. No texel comes from there; edges of houses farther away,
by which poses are checked, are looked for there in vain.
What is measured, and of which faces: `texture_stage.py`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import grown
from cityflow.io.images.image_tiles import tile_image
from cityflow.io.images.image_write import jpeg_bytes
from cityflow.io.images.tiled_images import open_image
from cityflow.stages.synth import scene_bounds, scene_over
from cityflow.stages.synth.synthetic_survey import SynthParameters, town_of
from cityflow.synthetic.flight_presets import preset
from cityflow.synthetic.render import render
from cityflow.texture.unit import TextureParameters
from texture_stage import NEAR_M, faces_of, nearest, timed
from texture_visibility import true_houses, true_surface

WIDTH_PX, HEIGHT_PX, GREY, AROUND_PX = 4480, 3360, 128, 64
WIDER_M = 10.0
"""Of an image, and so many pixels around the faces are rendered."""


def survey(seed: int) -> SynthParameters:
    """Five cameras over one block; of the town as much as can hide it."""
    flight = preset("five_cameras", width_px=WIDTH_PX, height_px=HEIGHT_PX, forward_overlap=0.87, side_overlap=0.8)
    return SynthParameters(seed=seed, size=(20.0, 20.0), surroundings_m=90.0, flight=flight)


def window(image: OrientedImage, xyz: FloatArray) -> tuple[slice, slice]:
    """Rows and columns of an image that show points, with some around; empty where it shows none."""
    uv, depth = image.project(xyz)
    low, high = np.floor(uv[depth > 0].min(axis=0)) - AROUND_PX, np.ceil(uv[depth > 0].max(axis=0)) + AROUND_PX
    (x_0, y_0), (x_1, y_1) = (np.clip(v, 0, (image.camera.width, image.camera.height)).astype(int).tolist() for v in (low, high))  # fmt: skip
    return slice(y_0, y_1), slice(x_0, x_1)


def picture(folder: Path, p: SynthParameters, xyz: FloatArray, image: OrientedImage) -> Path | None:
    """The file of an image, tiled as `ingest` tiles it; None where nothing of the faces is in it."""
    path, (rows, cols) = folder / f"{image.name}.tif", window(image, xyz)
    height, width = rows.stop - rows.start, cols.stop - cols.start
    if min(height, width) <= 0:
        return None
    if not path.exists():
        c = image.camera
        part = replace(image, camera=replace(c, width=width, height=height, cx=c.cx - cols.start, cy=c.cy - rows.start))
        town = town_of(p.seed, p.whole_town)
        pixels = np.full((c.height, c.width, 3), GREY, np.uint8)
        pixels[rows, cols] = render(
            scene_over(p.seed, town.parameters, scene_bounds(town, image)), part, p.render, p.seed
        )
        source = path.with_suffix(".jpg")
        source.write_bytes(jpeg_bytes(pixels, p.jpeg_quality, False))
        tile_image(str(source), path)
    return path


def main(words: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("folder", type=Path)
    options.add_argument("--seed", type=int, default=9304)
    options.add_argument("--processes", type=int, default=2)
    options.add_argument("--least", type=int, default=100, help="candidates that a face must have on average")
    asked = options.parse_args(words)
    asked.folder.mkdir(parents=True, exist_ok=True)
    p = survey(asked.seed)
    town = town_of(p.seed, p.whole_town)
    houses = nearest(true_houses(town), p.area)
    xyz = np.concatenate([ring for f in faces_of(houses)[0] for ring in f.rings])
    with ProcessPoolExecutor(asked.processes, get_context("spawn")) as pool:
        paths = list(pool.map(partial(picture, asked.folder, p, xyz), p.images))
    images = [ColourImage(i, open_image(path)) for i, path in zip(p.images, paths, strict=True) if path is not None]
    x, y = xyz[:, :2].mean(axis=0).tolist()
    surface = true_surface(town, grown((x, y, x, y), NEAR_M + WIDER_M), p.truth_cell_m)
    print(json.dumps(timed(houses, images, surface, TextureParameters(), asked.least), ensure_ascii=False))


if __name__ == "__main__":
    main()

"""White level of a survey with 16-bit files: many sensors use only 12 bits, and their images would appear black."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import ImageAsset
from cityflow.io.images.coarse_image import coarse_image
from cityflow.io.images.image_header import image_header
from cityflow.texture.source_image import white_of

LOOKED_AT = 24
"""Images that tell the white level of all; those in between were taken by the same sensor; set by hand."""
COARSE_PX = 512
"""Longest side of the overview that is looked at; bounds time."""


def with_white(assets: Sequence[ImageAsset]) -> list[ImageAsset]:
    """One white level for all images of 16 bits, so that it depends neither on a tile nor on an area of interest; damaged images say nothing."""
    white = white_level([a.href for a in sorted(assets, key=lambda a: a.name) if a.dtype != "uint8"])
    return [replace(a, white=white) if a.dtype != "uint8" else a for a in assets]


def white_level(paths: Sequence[str]) -> float:
    """The white level of images of 16 bits; 0 where there are none, or all are damaged."""
    places = np.unique(np.linspace(0, len(paths) - 1, min(len(paths), LOOKED_AT)).round().astype(int)).tolist()
    return max((_white(paths[k]) for k in places), default=0.0)


def _white(path: str) -> float:
    try:
        header = image_header(path)
        level = max(0, int(np.ceil(np.log2(max(header.height, header.width) / COARSE_PX))))
        return white_of(coarse_image(path, level).array[..., :3])
    except CatalogError:
        return 0.0

"""White level of a survey with 16-bit files: many sensors use only 12 bits, and their images would appear black."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import ImageAsset
from cityflow.io.images.coarse_image import coarse_image
from cityflow.texture.source_image import white_of

LOOKED_AT = 24
"""Images that tell the white level of all; those in between were taken by the same sensor; set by hand."""
COARSE_PX = 512
"""Longest side of the overview that is looked at; bounds time."""


def with_white(assets: Sequence[ImageAsset]) -> list[ImageAsset]:
    """One white level for all images of 16 bits, so that it depends neither on a tile nor on an area of interest; damaged images say nothing."""
    deep = sorted((a for a in assets if a.dtype != "uint8"), key=lambda a: a.name)
    places = np.unique(np.linspace(0, len(deep) - 1, min(len(deep), LOOKED_AT)).round().astype(int)).tolist()
    white = max((_white(deep[k]) for k in places), default=0.0)
    return [replace(a, white=white) if a.dtype != "uint8" else a for a in assets]


def _white(asset: ImageAsset) -> float:
    camera = asset.oriented.camera
    level = max(0, int(np.ceil(np.log2(max(camera.height, camera.width) / COARSE_PX))))
    try:
        return white_of(coarse_image(asset.href, level).array[..., :3])
    except CatalogError:
        return 0.0

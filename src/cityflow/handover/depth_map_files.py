"""Depth maps as files, from match tasks to fuse tasks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.depth_map import DepthMap
from cityflow.handover.array_file import decode_arrays, encode_arrays

NO_COLOUR = np.empty((0, 0, 0), np.uint8)


def depth_map_name(tile: str) -> str:
    """Name of the file in which a match task leaves the depths of a ground tile."""
    return f"{tile}.cfd"


def encode_depth_map(depth_map: DepthMap) -> bytes:
    """The same depth map gives the same bytes."""
    # an expected precision needs no more than three digits
    sigma = depth_map.sigma.astype(np.float16)
    layers: dict[str, NDArray[Any]] = {
        "depth": depth_map.depth, "sigma": sigma, "views": depth_map.views, "colour": depth_map.colour,
    }  # fmt: skip
    return encode_arrays(layers, {"image": depth_map.image, "row": depth_map.row, "col": depth_map.col})


def decode_depth_map(data: bytes, *, colour: bool = True) -> DepthMap:
    """Read what `encode_depth_map` wrote; sigma comes back with three digits.

    Without `colour`, which is most of the file, the map has no bands: (0, 0, 0) uint8.

    Raises
    ------
    CityflowError
        These are other bytes.
    """
    layers, attributes = decode_arrays(data, lambda name: colour or name != "colour")
    return DepthMap(
        attributes["image"], int(attributes["row"]), int(attributes["col"]), layers["depth"], layers["sigma"].astype(np.float32),
        layers["views"], layers.get("colour", NO_COLOUR),
    )  # fmt: skip

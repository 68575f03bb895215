"""Depth maps as files: what a match task leaves, and a surface task reads. Blosc-compressed arrays behind a JSON header."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numcodecs import Blosc, blosc
from numpy.typing import NDArray

from cityflow.core.depth_map import DepthMap
from cityflow.errors import CityflowError

MAGIC = b"CFDM1\n"
LAYERS = ("depth", "sigma", "views", "colour")
STORED = {"sigma": np.dtype("<f2")}
"""An expected precision needs no more than three digits."""


def encode_depth_map(depth_map: DepthMap) -> bytes:
    """The same depth map gives the same bytes."""
    blosc.use_threads = False
    header: dict[str, Any] = {"image": depth_map.image, "row": depth_map.row, "col": depth_map.col, "layers": {}}
    blocks = []
    for name in LAYERS:
        array = _stored(name, getattr(depth_map, name))
        block = Blosc(cname="zstd", clevel=3, shuffle=Blosc.SHUFFLE).encode(array) if array.size else b""
        header["layers"][name] = [array.dtype.str, list(array.shape), len(block)]
        blocks.append(block)
    text = json.dumps(header, sort_keys=True).encode()
    return MAGIC + struct.pack("<I", len(text)) + text + b"".join(blocks)


def decode_depth_map(data: bytes) -> DepthMap:
    """Read what `encode_depth_map` wrote; sigma comes back with three digits.

    Raises
    ------
    CityflowError
        These are other bytes.
    """
    start = len(MAGIC) + 4
    if data[: len(MAGIC)] != MAGIC:
        raise CityflowError("this is no depth map", where="match output", remedy="run the match stage again")
    length = struct.unpack("<I", data[len(MAGIC) : start])[0]
    header = json.loads(data[start : start + length])
    place, layers = start + length, {}
    for name in LAYERS:
        dtype, shape, size = header["layers"][name]
        layers[name] = _array(data[place : place + size], dtype, shape)
        place += size
    return DepthMap(
        header["image"], int(header["row"]), int(header["col"]), layers["depth"], layers["sigma"].astype(np.float32),
        layers["views"], layers["colour"],
    )  # fmt: skip


def _stored(name: str, array: NDArray[Any]) -> NDArray[Any]:
    wanted = STORED.get(name, array.dtype.newbyteorder("<"))
    return np.ascontiguousarray(array, wanted)


def _array(block: bytes, dtype: str, shape: list[int]) -> NDArray[Any]:
    if not block:
        return np.empty(shape, dtype)
    # blosc decodes into a read-only buffer; whoever reads a depth map may filter it in place
    decoded = np.frombuffer(Blosc().decode(block), dtype).reshape(shape).copy()
    return np.asarray(decoded)

"""Patches of a scan, and what pictures show around them, as the files that tasks leave for one another."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cityflow.adjustment.patch_matching import Crop, Sides
from cityflow.handover.array_file import decode_arrays, encode_arrays

_SIDES = ("patch", "xyz", "normals", "kind", "seen")


def encode_sides(sides: Sides, cell_m: float) -> bytes:
    """The same sides give the same bytes; `cell_m`: of their patches, metres."""
    return encode_arrays({name: getattr(sides, name) for name in _SIDES}, {"cell_m": cell_m})


def decode_sides(data: bytes) -> tuple[Sides, float]:
    """What `encode_sides` wrote."""
    arrays, attributes = decode_arrays(data)
    return Sides(*(arrays[name] for name in _SIDES)), float(attributes["cell_m"])


def encode_crops(crops: Mapping[int, Crop]) -> bytes:
    """Number of a side → what one image shows around it; the same crops give the same bytes."""
    parts = list(crops.values())
    return encode_arrays(
        {
            "side": np.array(list(crops), np.int64), "shape": np.array([c.grey.shape for c in parts], np.int64).reshape(-1, 2),
            "first": np.array([c.first for c in parts], np.float64).reshape(-1, 2), "size": np.array([c.size for c in parts], np.float64),
            "grey": np.concatenate([c.grey.reshape(-1) for c in parts]) if parts else np.empty(0, np.float32),
        },
        {},
    )  # fmt: skip


def decode_crops(data: bytes) -> dict[int, Crop]:
    """What `encode_crops` wrote."""
    arrays, _ = decode_arrays(data)
    ends = np.cumsum(np.prod(arrays["shape"], axis=1))
    grey = np.split(arrays["grey"], ends[:-1])
    return {
        int(k): Crop(grey[i].reshape(arrays["shape"][i]), arrays["first"][i], float(arrays["size"][i]))
        for i, k in enumerate(arrays["side"])
    }

"""Features of images and matches of pairs as the files that tasks leave for one another."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np

from cityflow.adjustment.features import Features
from cityflow.core.arrays import IntArray


def encode_features(features: Features) -> bytes:
    """The same features give the same bytes."""
    return _packed({"uv": features.uv, "scale": features.scale, "descriptors": features.descriptors})


def decode_features(data: bytes) -> Features:
    """What `encode_features` wrote."""
    arrays = _unpacked(data)
    return Features(arrays["uv"], arrays["scale"], arrays["descriptors"])


def encode_matches(matches: Mapping[str, IntArray]) -> bytes:
    """Name of the other image → (K, 2) numbers of features in both; the same matches give the same bytes."""
    return _packed({name: pairs.astype(np.int32) for name, pairs in sorted(matches.items())})


def decode_matches(data: bytes) -> dict[str, IntArray]:
    """What `encode_matches` wrote."""
    return {name: pairs.astype(np.int64) for name, pairs in _unpacked(data).items()}


def _packed(arrays: Mapping[str, np.ndarray]) -> bytes:
    """Arrays behind one another: numpy's archive would hold the time of day."""
    out = io.BytesIO()
    np.save(out, np.array(list(arrays), dtype=np.str_), allow_pickle=False)
    for array in arrays.values():
        np.save(out, np.ascontiguousarray(array), allow_pickle=False)
    return out.getvalue()


def _unpacked(data: bytes) -> dict[str, np.ndarray]:
    file = io.BytesIO(data)
    names = np.load(file, allow_pickle=False)
    return {str(name): np.load(file, allow_pickle=False) for name in names}

"""Features of images, matches and geometries of pairs as the files that tasks leave for one another."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np

from cityflow.adjustment.features import Features
from cityflow.adjustment.pair_geometry import PairGeometry
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


def encode_geometries(pairs: Mapping[str, PairGeometry]) -> bytes:
    """Name of the other image → what agrees; the same pairs give the same bytes."""
    arrays: dict[str, np.ndarray] = {}
    for name, pair in sorted(pairs.items()):
        matrices = np.concatenate([pair.matrices.reshape(-1), pair.pose.reshape(-1), [float(pair.kind)]])
        arrays |= {f"m {name}": pair.matches.astype(np.int32), f"g {name}": matrices}
    return _packed(arrays)


def decode_geometries(data: bytes) -> dict[str, PairGeometry]:
    """What `encode_geometries` wrote."""
    arrays, pairs = _unpacked(data), {}
    for key in arrays:
        if key.startswith("m "):
            values = arrays[f"g {key[2:]}"]
            matrices, pose = values[:27].reshape(3, 3, 3), values[27:39].reshape(3, 4)
            pairs[key[2:]] = PairGeometry(arrays[key].astype(np.int64), int(values[39]), matrices, pose)
    return pairs


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

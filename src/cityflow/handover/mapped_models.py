"""Models of a mapping as the file that its task leaves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cityflow.adjustment.mapping import MappedModel
from cityflow.handover.array_file import decode_arrays, encode_arrays
from cityflow.handover.oriented import of_json, to_json

COLUMNS = ("xyz", "lengths", "errors_px", "observations", "tracks")


def encode_models(models: Sequence[MappedModel]) -> bytes:
    """The same models give the same bytes."""
    arrays = {f"{k}/{c}": np.asarray(getattr(m, c)) for k, m in enumerate(models) for c in COLUMNS}
    stated = [
        {
            "numbers": list(m.numbers),
            "images": [to_json(i) for i in m.images],
            "focals": [[k, s] for k, s in sorted(m.focal_sigmas.items())],
        }
        for m in models
    ]
    return encode_arrays(arrays, {"models": stated})


def decode_models(data: bytes) -> list[MappedModel]:
    """What `encode_models` wrote."""
    arrays, stated = decode_arrays(data)
    return [_model(one, [arrays[f"{k}/{c}"] for c in COLUMNS]) for k, one in enumerate(stated["models"])]


def _model(one: Any, arrays: list[Any]) -> MappedModel:
    xyz, lengths, errors, observations, tracks = arrays
    images, sigmas = tuple(of_json(i) for i in one["images"]), {int(k): sigma for k, sigma in one["focals"]}
    return MappedModel(tuple(one["numbers"]), images, xyz, lengths, errors, observations, tracks, sigmas)

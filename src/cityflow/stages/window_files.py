"""What windows tasks leave of a unit: JSON that a person can read, too."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from cityflow.core.openings import FaceOpenings, Opening, UnitOpenings
from cityflow.core.texture import FaceKey
from cityflow.stages.texture_files import Rings


def encode_openings(found: UnitOpenings, rings: Mapping[FaceKey, Rings]) -> bytes:
    """All walls with their openings; `rings`, the world vertices of every face, are what a face is known by."""
    tree = {
        "storeys": found.storeys, "window_to_wall_ratio": found.window_to_wall_ratio, "seen_share": found.seen_share,
        "faces": [{**_face(f), "rings": [[list(p) for p in ring] for ring in rings[f.key]]} for f in found.faces],
    }  # fmt: skip
    return (json.dumps(tree, allow_nan=False, separators=(",", ":")) + "\n").encode()


def decode_openings(data: bytes) -> tuple[UnitOpenings, dict[FaceKey, Rings]]:
    """What `encode_openings` wrote."""
    tree = json.loads(data)
    faces = tuple(_read(f) for f in tree["faces"])
    rings = {
        face.key: tuple(tuple((p[0], p[1], p[2]) for p in ring) for ring in f["rings"])
        for face, f in zip(faces, tree["faces"], strict=True)
    }
    return UnitOpenings(faces, tree["storeys"], tree["window_to_wall_ratio"], tree["seen_share"]), rings


def _face(found: FaceOpenings) -> dict[str, Any]:
    return {
        "key": list(found.key), "area_m2": round(found.area_m2, 4), "seen_m2": round(found.seen_m2, 4), "storeys": found.storeys,
        "window_to_wall": found.window_to_wall, "reason": found.reason,
        "openings": [
            {
                "ring": o.ring.tolist(), "bounds": list(o.bounds), "kind": o.kind, "confidence": o.confidence, "support": o.support,
                "completed": o.completed,
            }
            for o in found.openings
        ],
    }  # fmt: skip


def _read(tree: Mapping[str, Any]) -> FaceOpenings:
    key: FaceKey = (tree["key"][0], int(tree["key"][1]))
    openings = tuple(
        Opening(
            key,
            np.array(o["ring"], np.float64),
            tuple(o["bounds"]),
            o["kind"],
            o["confidence"],
            o["support"],
            o["completed"],
        )
        for o in tree["openings"]
    )
    return FaceOpenings(
        key, openings, tree["storeys"], tree["area_m2"], tree["seen_m2"], tree["window_to_wall"], tree["reason"]
    )

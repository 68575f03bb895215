"""The result of a windows task, as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from cityflow.core.openings import TOO_LITTLE, FaceOpenings, Opening, UnitOpenings
from cityflow.core.texture import FaceKey
from cityflow.handover.texture_files import Rings


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
    return UnitOpenings(faces, tree["storeys"], tree["window_to_wall_ratio"], tree.get("seen_share", 0.0)), rings


def wall_lines(data: bytes) -> Iterator[str]:
    """One line of text per wall: its name, the share that is seen, its windows and their share, or why there are none."""
    found, rings = decode_openings(data)
    for wall in found.faces:
        seen = min(wall.seen_m2 / wall.area_m2, 1.0) if wall.area_m2 > 0 else 0.0
        name = f"{wall.key[0]} face {wall.key[1]}"
        place = f"faces {_facing_deg(rings[wall.key]):.0f}°, {wall.area_m2:.1f} m², {100 * seen:.0f} % seen"
        yield f"{name} ({place}): {_result_text(wall)}"


def _result_text(wall: FaceOpenings) -> str:
    if wall.reason:
        return wall.reason
    sure = [o.confidence for o in wall.openings if o.kind == "window"]
    doors = len(wall.openings) - len(sure)
    return ", ".join([
        _counted(len(sure), "window") + (f" (confidence {sum(sure) / len(sure):.2f})" if sure else ""),
        *([_counted(doors, "door")] if doors else []), *([_counted(wall.storeys, "storey")] if wall.storeys else []),
        TOO_LITTLE if wall.window_to_wall is None else f"ratio {wall.window_to_wall:.3f}",
    ])  # fmt: skip


def _counted(number: int, name: str) -> str:
    return f"{number or 'no'} {name}{'' if number == 1 else 's'}"


def _facing_deg(rings: Rings) -> float:
    """Degrees from north, clockwise, of the direction that a wall looks at."""
    ring = np.array(rings[0], np.float64)
    x, y, _ = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
    return float(np.degrees(np.arctan2(x, y)) % 360)


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

"""The windows of a tile's buildings for its exports: on the exported faces, and as attributes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cityflow.core.building import Building, Lod, Scalar, Semantic
from cityflow.core.openings import TOO_LITTLE, FaceOpenings, UnitOpenings
from cityflow.core.texture import FaceKey
from cityflow.handover.texture_files import faces_of
from cityflow.handover.window_files import decode_openings
from cityflow.texture.planes import face_planes
from cityflow.windows.find_windows import unit_openings


def openings_on(data: bytes, building: Building) -> UnitOpenings:
    """The result of a task, for the faces of a building that have the same vertices; walls that were cut otherwise are left out."""
    found, rings = decode_openings(data)
    keys = faces_of(building)
    kept = [_moved(f, keys[rings[f.key]]) for f in found.faces if rings[f.key] in keys]
    planes = face_planes(building.solids[Lod.LOD22], building.beyond)
    return unit_openings([f for f in planes if f.semantic is Semantic.WALL], kept)


def with_window_figures(building: Building, found: UnitOpenings | None, failure: str = "") -> Building:
    """Attributes: number of windows, confidence, share of the walls, storeys by rows; or why there are none."""
    if found is None or not found.faces:
        return building.with_attributes({"windows_missing": failure}) if failure else building
    sure = [o.confidence for o in found.openings if o.kind == "window"]
    more: dict[str, Scalar] = {}
    if sure or found.window_to_wall_ratio is not None:
        more["windows"] = len(sure)
    if sure:
        more["windows_confidence"] = round(float(np.mean(sure)), 3)
    if found.storeys is not None:
        more["storeys_by_windows"] = found.storeys
    if found.window_to_wall_ratio is not None:
        more["window_to_wall_ratio"] = round(found.window_to_wall_ratio, 3)
    else:
        more["window_to_wall_missing" if sure else "windows_missing"] = _usual_reason(found)
    return building.with_attributes({**more, "windows_seen_share": round(found.seen_share, 3)})


def _usual_reason(found: UnitOpenings) -> str:
    """Why there is no share of windows: the reason of most of the walls' area, where no wall has a result."""
    reasons = sorted({f.reason for f in found.faces})
    if "" in reasons:
        return TOO_LITTLE
    return max(reasons, key=lambda reason: sum(f.area_m2 for f in found.faces if f.reason == reason))


def _moved(found: FaceOpenings, key: FaceKey) -> FaceOpenings:
    """The same openings under another key."""
    return replace(found, key=key, openings=tuple(replace(o, face=key) for o in found.openings))

"""Stage ``windows``: windows and doors in the textures of one unit (Frommholz 2017 §6)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Face, Lod, Polyhedron, Scalar, Semantic
from cityflow.core.openings import TOO_LITTLE, FaceOpenings, UnitOpenings
from cityflow.core.texture import FaceKey, FacePlane
from cityflow.flow.stage import Cost, Stage
from cityflow.flow.task import Json, Outcome, Task
from cityflow.flow.workspace import Workspace
from cityflow.handover.texture_files import Rings, decode_unit, faces_of
from cityflow.handover.window_files import decode_openings, encode_openings
from cityflow.stages.texture import images_of
from cityflow.survey.city import City
from cityflow.survey.survey import Survey
from cityflow.survey.unit_entry import UnitEntry
from cityflow.texture.planes import face_planes
from cityflow.windows.find import find_unit_windows, unit_openings
from cityflow.windows.window_parameters import WindowParameters

NAME = "windows"
VERSION = 8
WINDOWS = "windows.json"
UPRIGHT = 0.1
"""Sine of the tilt up to which a face is a wall."""


def are_wanted(survey: Survey) -> bool:
    """Whether anybody looks for windows: an ortho alone shows no wall."""
    return survey.textures and survey.parameters.windows.when == "auto" and bool(survey.images.assets)


def task(survey: Survey, unit: UnitEntry) -> Task | None:
    """The windows of one unit; None where it has no textures, or where only an ortho can have shown it."""
    textures = survey.results.outputs_of("texture", unit.id)
    if not textures or not images_of(survey, unit):
        return None
    path, digest = next(iter(textures.items()))
    return Task(
        NAME, unit.id, "cityflow.stages.windows:run", VERSION,
        parameters=survey.parameters_for(NAME, unit.id, survey.parameters.windows),
        inputs={"texture": digest},
        arguments={"texture": path},
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Windows of all walls that have a texture, as JSON."""
    parameters = WindowParameters.model_validate(task.parameters)
    texture, rings = decode_unit(workspace.read(task.arguments["texture"]))
    found = find_unit_windows(planes_of(rings), {p.key: p for p in texture.rectified}, parameters)
    workspace.write(WINDOWS, encode_openings(found, rings))
    return workspace.outcome(result=figures(found))


def planes_of(rings: Mapping[FaceKey, Rings]) -> tuple[FacePlane, ...]:
    """Faces in planes of their own, from their vertices; upright ones are walls."""
    found = []
    for key in sorted(rings):
        corners = [np.array(r, np.float64).reshape(-1, 3) for r in rings[key]]
        starts = np.cumsum([0, *(len(r) for r in corners)])
        numbers = tuple(tuple(range(a, b)) for a, b in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True))
        semantic = Semantic.WALL if _is_upright(corners[0]) else Semantic.ROOF
        shell = Polyhedron(np.concatenate(corners), (Face(numbers, semantic),))
        found += [replace(plane, key=key) for plane in face_planes(shell, None)]
    return tuple(found)


def _is_upright(ring: FloatArray) -> bool:
    normal = np.cross(ring - ring[0], np.roll(ring, -1, axis=0) - ring[0]).sum(axis=0)
    return abs(float(normal[2])) <= UPRIGHT * float(np.linalg.norm(normal))


def figures(found: UnitOpenings) -> dict[str, Json]:
    """For the record: how many, how sure, and why walls show none."""
    windows = [o for o in found.openings if o.kind == "window"]
    reasons = Counter(f.reason for f in found.faces if f.reason)
    return {
        "windows": len(windows), "doors": len(found.openings) - len(windows), "walls": len(found.faces),
        "confidence": round(float(np.mean([o.confidence for o in windows])), 3) if windows else None,
        "completed": sum(o.completed for o in windows), "storeys": found.storeys,
        "window_to_wall_ratio": _rounded(found.window_to_wall_ratio), "seen_share": _rounded(found.seen_share), "reasons": dict(sorted(reasons.items())),
    }  # fmt: skip


def openings_on(data: bytes, building: Building) -> UnitOpenings:
    """What a task wrote, for the faces of a building that have the same vertices; walls that were cut in another way are left out."""
    found, rings = decode_openings(data)
    keys = faces_of(building)
    kept = [_moved(f, keys[rings[f.key]]) for f in found.faces if rings[f.key] in keys]
    planes = face_planes(building.solids[Lod.LOD22], building.beyond)
    return unit_openings([f for f in planes if f.semantic is Semantic.WALL], kept)


def with_window_figures(building: Building, found: UnitOpenings | None, failure: str = "") -> Building:
    """Attributes: windows, how sure they are, their share of the walls, storeys by their rows; or why nobody could look."""
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
    """Why there is no share of windows: what holds for most of the walls' area, if nobody could look at any."""
    reasons = sorted({f.reason for f in found.faces})
    if "" in reasons:
        return TOO_LITTLE
    return max(reasons, key=lambda reason: sum(f.area_m2 for f in found.faces if f.reason == reason))


def _moved(found: FaceOpenings, key: FaceKey) -> FaceOpenings:
    """The same openings under another key."""
    return replace(found, key=key, openings=tuple(replace(o, face=key) for o in found.openings))


def _rounded(value: Any) -> float | None:
    return None if value is None else round(float(value), 4)


STAGE: Stage[City] = Stage(
    name=NAME,
    unit="building that photographs show",
    text="rectified patches of its walls → windows and doors with a confidence, per wall their share, rows and the reason where nobody could look",
    needs=(lambda _, name: [("texture", name)],),
    task=lambda city, name: task(city.survey, city.units[name]),
    count=lambda city: city.count_units() if are_wanted(city.survey) else 0,
    parameters=(WindowParameters,),
    cost=Cost(0.5, 500.0, 0.05),
)

"""Stage ``windows``: windows and doors in the textures of one unit (Frommholz 2017 §6)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.openings import UnitOpenings
from cityflow.core.texture import FaceKey, FacePlane
from cityflow.flow.stage import Cost, Place, Stage
from cityflow.flow.task import Json, Outcome, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.texture_files import Rings, decode_unit
from cityflow.handover.window_files import encode_openings
from cityflow.survey.city import City
from cityflow.survey.texture_inputs import windows_are_wanted
from cityflow.survey.texture_needs import texture_needs
from cityflow.survey.unit_entry import UnitEntry
from cityflow.texture.planes import face_planes
from cityflow.windows.find_windows import find_unit_windows
from cityflow.windows.window_parameters import WindowParameters

NAME = "windows"
VERSION = 9
WINDOWS = "windows.json"
UPRIGHT = 0.1
"""Sine of the tilt up to which a face is a wall; set by hand."""


@dataclass(frozen=True, slots=True)
class WindowInputs(TaskInputs):
    """The RUN-relative path of the unit's texture."""

    texture: str


def task(city: City, unit: UnitEntry) -> Task | None:
    """The windows of one unit; None where it has no textures, or where only an ortho can have shown it."""
    survey = city.survey
    textures = survey.results.outputs_of("texture", unit.id)
    if not textures or not texture_needs(city, unit).images:
        return None
    path, digest = next(iter(textures.items()))
    return KIND.task(
        unit.id, parameters=as_json(survey.parameters_of(NAME, unit.id, survey.parameters.windows)),
        inputs={"texture": digest},
        given=WindowInputs(path),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Windows of all walls that have a texture, as JSON."""
    given, parameters = task.arguments_as(WindowInputs), task.parameters_as(WindowParameters)
    texture, rings = decode_unit(workspace.read(given.texture))
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


def _rounded(value: Any) -> float | None:
    return None if value is None else round(float(value), 4)


KIND = TaskKind(NAME, VERSION, run, WindowInputs)

STAGE: Stage[City] = Stage(
    name=NAME,
    unit="building seen in photographs",
    place=Place.UNIT,
    text="rectified patches of its walls → windows and doors with a confidence, per wall their share, rows, and the reason where they could not be searched",
    kinds=(KIND,),
    needs=(lambda _, name: [("texture", name)],),
    task=lambda city, name: task(city, city.units[name]),
    asked=lambda city, _: windows_are_wanted(city.survey),
    supplied=lambda city, name: bool(city.survey.results.outputs_of("texture", name)),
    until_export=True,
    count=lambda city: city.count_units() if windows_are_wanted(city.survey) else 0,
    parameters=(WindowParameters,),
    cost=Cost(0.5, 500.0, 0.05),
)

"""What tasks are given, as JSON and as dataclasses again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import pytest
import shapely
from pydantic import TypeAdapter

from cityflow.core.camera import FISHEYE, Camera, OrientedImage
from cityflow.core.edits import DrawnOutline, Edits
from cityflow.core.grid import Bounds, Grid
from cityflow.core.local_frame import LocalFrame
from cityflow.core.parameters import Parameters
from cityflow.flow.task import Task
from cityflow.flow.typed import TaskInputs, as_json, from_json
from cityflow.handover.field_types import EditsField, FrameField, OrientedField

TURN, AT = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0], np.array([85e3 + 1 / 3, 447e3 + 0.1, 1e-17])


class Fit(Parameters):
    reach_m: float = 0.1


@dataclass(frozen=True, slots=True)
class Part(TaskInputs):
    path: str
    weight: float


@dataclass(frozen=True, slots=True)
class Everything(TaskInputs):
    bounds: Bounds
    parts: tuple[Part, ...]
    by_name: Mapping[str, Part]
    chosen: tuple[tuple[int, int], ...]
    grid: Grid
    image: OrientedField
    frame: FrameField
    edits: EditsField
    fit: Fit
    dtm: str | None = None


def everything() -> Everything:
    image = OrientedImage(
        "flight_1", Camera(640, 480, 901 / 7, 902 / 7, 320.1, 240.2, (0.1, -1 / 3, 0, 0), FISHEYE), TURN, AT
    )
    frame = LocalFrame("east_45", TURN, AT, ("flight_1",))
    edits = Edits((DrawnOutline(shapely.box(1 / 3, 0, 1, 1), "a", locked=True),), rejected=(shapely.Point(0.1, 0.2),))
    part = Part("work/ingest/f1/0_0.laz", 0.1 + 0.2)
    return Everything(
        (1 / 3, -1e300, 5e-324, 447e3), (part, part), {"b": part, "a": part}, ((3, -4),), Grid(0.1, 0.2, 0.3, 4, 5), image, frame, edits,
        Fit(reach_m=0.7),
    )  # fmt: skip


def assert_same(a: Any, b: Any) -> None:
    """Equal to the last bit, whatever has arrays in it."""
    assert type(a) is type(b)
    if is_dataclass(a) and not isinstance(a, Grid):
        for field in fields(a):
            assert_same(getattr(a, field.name), getattr(b, field.name))
    elif isinstance(a, np.ndarray):
        assert a.tobytes() == b.tobytes()
    else:
        assert a == b


def test_every_value_comes_back_to_the_last_bit() -> None:
    given = everything()
    text = json.dumps(as_json(given), allow_nan=False)
    again = from_json(Everything, json.loads(text), "count-7")
    assert json.dumps(as_json(again)) == text
    assert list(again.by_name) == ["b", "a"]
    assert again.frame.images == ()
    for name in ("bounds", "parts", "chosen", "grid", "image", "fit", "dtm"):
        assert_same(getattr(given, name), getattr(again, name))
    assert again.edits.lines() == given.edits.lines()
    assert_same(given.frame.frame_from_world, again.frame.frame_from_world)


def test_trees_are_those_of_pydantic() -> None:
    given = replace(everything(), bounds=(np.float64(1 / 3), -1e300, 5e-324, 447e3), dtm="work/dtm.tif")
    tree = as_json(given)
    assert tree == TypeAdapter(Everything).dump_python(given, mode="json")
    assert all(type(value) is float for value in tree["bounds"])
    assert tree["chosen"] == [[3, -4]]


def test_a_class_within_a_function_is_written_too() -> None:
    @dataclass(frozen=True, slots=True)
    class Within(TaskInputs):
        part: Part

    assert as_json(Within(Part("work/x", 2.0))) == {"part": {"path": "work/x", "weight": 2.0}}


SPOILT: Mapping[str, tuple[dict[str, Any], str]] = {
    "missing": ({"parts": [{"path": "work/x"}]}, "parts.0.weight"),
    "unknown": ({"extent": [0, 0, 1, 1]}, "extent"),
    "of another kind": ({"bounds": [0, 0, 1]}, "bounds.3"),
    "no image": ({"image": {"name": "flight_1"}}, "image"),
}


@pytest.mark.parametrize("how", SPOILT)
def test_a_wrong_field_is_named_with_stage_and_unit(how: str) -> None:
    change, field = SPOILT[how]
    task = Task("count", "0599100000012345", "x:y", 1, arguments={**as_json(everything()), **change})
    with pytest.raises(
        ValueError, match=rf"count-0599100000012345: what it is given cannot be read as Everything: {field}: "
    ):
        task.arguments_as(Everything)


def test_parameters_are_read_as_their_model() -> None:
    task = Task("count", "u", "x:y", 1, parameters=as_json(Fit(reach_m=2.0)))
    assert task.parameters_as(Fit) == Fit(reach_m=2.0)
    with pytest.raises(ValueError, match=r"count-u: its parameters cannot be read as Fit: reach_m: "):
        Task("count", "u", "x:y", 1, parameters={"reach_m": "far"}).parameters_as(Fit)


def test_fields_can_be_left_out() -> None:
    tree = as_json(everything(), without=("image", "grid.cell"))
    assert "image" not in tree
    assert tree["grid"] == {"x_min": 0.1, "y_max": 0.2, "rows": 4, "cols": 5}

"""What `cityflow parameters` says of every key, and how keys are chosen."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Any, Literal

import pytest
from pydantic import Field

from cityflow.core.parameters import Parameters
from cityflow.errors import WorkflowError
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.known_keys import described
from cityflow.runs.model_keys import model_keys


class Kind(StrEnum):
    OAK = "oak"
    ELM = "elm"


class Leaves(Parameters):
    width_m: float = Field(0.25, gt=0, le=1, description="of a leaf, m")
    kind: Kind = Field(Kind.OAK, description="of the tree")


class Garden(Parameters):
    name: str = Field(description="of the garden")
    angle_deg: float | None = Field(None, ge=0, le=90, description="of the slope, degrees; null: measured")
    trees: int = Field(3, ge=1, description="how many")
    tools: tuple[Literal["rake", "hoe"], ...] = Field(("rake",), min_length=1, description="in the shed")
    order: Literal["rows"] | Literal["free"] = Field("free", description="how they stand")
    fenced: bool = Field(True, description="has a fence")
    leaves: Leaves = Leaves()


def test_every_parameter_is_described() -> None:
    lines = described(model_keys(CityParameters)).splitlines()
    assert any(line.startswith("surface.cell_m = 0.5") and "m" in line for line in lines)
    assert not [line for line in lines if not line.split(" = ", 1)[1].split("  ")[1].strip()]
    assert not [line for line in lines if "Ge(" in line or "Le(" in line or "Gt(" in line or "MinLen" in line]


def test_defaults_are_those_of_a_run() -> None:
    """A section may have other defaults in one place than in another: water of surfaces from images, time limits of stages."""
    keys, run = model_keys(CityParameters), CityParameters().model_dump(mode="json")
    for name, key in keys.items():
        value: Any = run
        for part in name.split("."):
            value = value[part] if value is not None else None
        if value is not None:
            assert json.loads(key.default) == value, name
    assert keys["image_surface.cover.water_area_m2"].default != keys["surface.cover.water_area_m2"].default


def test_a_line_says_default_meaning_and_what_a_value_may_be() -> None:
    assert described(model_keys(Garden)).splitlines() == [
        "name = no default  of the garden",
        "angle_deg = null  of the slope, degrees; null: measured  (0 to 90 or null)",
        "trees = 3  how many  (at least 1)",
        'tools = ["rake"]  in the shed  (any of rake, hoe; at least 1 value)',
        'order = "free"  how they stand  (one of rows, free)',
        "fenced = true  has a fence  (true or false)",
        "leaves.width_m = 0.25  of a leaf, m  (> 0, at most 1)",
        'leaves.kind = "oak"  of the tree  (one of oak, elm)',
    ]


@pytest.mark.parametrize(
    ("wanted", "keys"),
    [
        ("leaves", ["leaves.width_m", "leaves.kind"]),
        ("leaves.", ["leaves.width_m", "leaves.kind"]),
        ("leaves.kind", ["leaves.kind"]),
        ("width", ["leaves.width_m"]),
        ("_M", ["leaves.width_m"]),
        ("*_deg", ["angle_deg"]),
        ("k*", ["leaves.kind"]),
        ("?rees", ["trees"]),
    ],
)
def test_keys_are_chosen_by_section_by_part_and_by_pattern(wanted: str, keys: list[str]) -> None:
    assert [line.split(" = ")[0] for line in described(model_keys(Garden), wanted).splitlines()] == keys


@pytest.mark.parametrize(("wanted", "near"), [("leafs", "leaves"), ("widht", "width_m"), ("tre*x", "trees")])
def test_a_name_that_no_key_has_is_refused_with_the_nearest(wanted: str, near: str) -> None:
    with pytest.raises(WorkflowError, match=near):
        described(model_keys(Garden), wanted)

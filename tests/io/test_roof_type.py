from __future__ import annotations

from dataclasses import replace

import pytest

from cityflow.core.building import Building
from cityflow.io.city_models.roof_type_codes import roof_type_code


def test_flat_and_gable_roofs_are_known(gable: Building, courtyard: Building) -> None:
    assert roof_type_code(gable) == "1030"
    assert roof_type_code(courtyard) == "1000"


@pytest.mark.parametrize(
    ("name", "code"), [("hip", "1040"), ("mansard", "1060"), ("complex", None), ("unheard of", None)]
)
def test_the_attribute_counts_first(gable: Building, name: str, code: str | None) -> None:
    assert roof_type_code(gable.with_attributes({"roof_type": name})) == code


def test_without_a_solid_nothing_is_said(gable: Building) -> None:
    assert roof_type_code(replace(gable, solids={})) is None

from __future__ import annotations

from dataclasses import replace

from cityflow.core.building import Status
from cityflow.core.roof_type_names import RoofType
from cityflow.reconstruction.choose import MODULES
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.roof_figures import METHOD_TEXTS, TYPE_TEXTS, roof_figures
from cityflow.viewer.unit_figures import UnitFigures

ROW = UnitRow("a", "0_0", Status.DONE, method="roof_types")
SEEN = {"overhang_max_m": 0.5}


def test_counts_claims_and_reaches() -> None:
    units = [
        replace(ROW, attributes={"roof_type": "gable", "claimed_rmse_m": 0.05, **SEEN}, reaches_m=(0.3, 0.5)),
        replace(ROW, attributes={"roof_type": "gable", "claimed_rmse_m": 0.1, **SEEN}, reaches_m=(0.4,)),
        replace(ROW, attributes={"roof_type": "flat", "claimed_rmse_m": 0.15, "overhang_max_m": 0.0}),
        replace(ROW, method="extruded", attributes={"roof_type": "flat", "claimed_rmse_m": 0.7}),
        replace(ROW, method="extruded", attributes={"claimed_rmse_m": None}),
        UnitRow("refused", "0_0", Status.REFUSED),
    ]
    found = roof_figures(UnitFigures.of(units))
    assert found["models"] == 5
    assert [(t["type"], t["count"]) for t in found["types"]] == [("flat", 2), ("gable", 2)]
    assert [(c["most_m"], c["count"]) for c in found["claims"]["within"]] == [(0.1, 2), (0.2, 3)]
    assert (found["claims"]["more"], found["claims"]["unknown"]) == (1, 1)
    assert found["overhangs"] == {"buildings": 2, "edges": 3, "median_m": 0.4, "longest_m": 0.5}
    assert [(m["method"], m["count"]) for m in found["methods"]] == [("roof_types", 3), ("extruded", 2)]


def test_nothing_looked_for_is_not_nothing_found() -> None:
    found = roof_figures(UnitFigures.of([replace(ROW, attributes={"roof_type": "flat"})]))
    assert found["overhangs"] is None
    assert found["claims"] is None
    looked = roof_figures(UnitFigures.of([replace(ROW, attributes={"overhang_max_m": 0.0})]))["overhangs"]
    assert looked == {"buildings": 0, "edges": 0, "median_m": None, "longest_m": None}


def test_every_type_and_method_has_words() -> None:
    assert set(TYPE_TEXTS) == set(RoofType)
    assert set(METHOD_TEXTS) == set(MODULES)

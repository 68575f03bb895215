from __future__ import annotations

from cityflow.core.building import Scalar, Status
from cityflow.viewer.report_rows import UnitRow
from cityflow.viewer.unit_figures import UnitFigures
from cityflow.viewer.window_figures import window_figures


def unit(number: int, **attributes: Scalar) -> UnitRow:
    return UnitRow(str(number), "", Status.DONE, attributes=attributes)


def test_nothing_is_said_where_nobody_looked() -> None:
    assert window_figures(UnitFigures.of([])) is None
    assert window_figures(UnitFigures.of([unit(1, roof_type="gable"), unit(2, storeys="two")])) is None
    assert window_figures(UnitFigures.of([unit(1, storeys=3)])) is None, "a cadastre has counted these"


def test_medians_and_storeys() -> None:
    rows = [
        unit(n, window_to_wall_ratio=r, storeys_by_windows=s, windows=4)
        for n, (r, s) in enumerate([(0.1, 2), (0.2, 2), (0.3, 12)])
    ]
    others = [unit(7, windows=0, storeys=9), unit(8, windows_missing="coarse", windows_seen_share=0.1), unit(9)]
    figures = window_figures(UnitFigures.of([*rows, *others]))
    assert figures is not None
    assert (figures["buildings"], figures["with_windows"], figures["with_ratio"]) == (4, 3, 3)
    assert figures["windows"] == 12
    assert figures["ratio_median"] == 0.2
    assert figures["storeys"] == [{"storeys": "2", "count": 2}, {"storeys": "8 or more", "count": 1}]
    assert figures["missing"] == [{"reason": "coarse", "count": 1}]

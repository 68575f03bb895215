from __future__ import annotations

from cityflow.core.building import Scalar, Status
from cityflow.viewer.rows import UnitRow
from cityflow.viewer.window_figures import window_figures


def unit(number: int, **attributes: Scalar) -> UnitRow:
    return UnitRow(str(number), "", Status.DONE, attributes=attributes)


def test_nothing_is_said_where_nobody_looked() -> None:
    assert window_figures([]) is None
    assert window_figures([unit(1, roof_type="gable"), unit(2, storeys="two")]) is None


def test_medians_and_storeys() -> None:
    rows = [
        unit(n, window_to_wall_ratio=r, storeys=s, windows=4)
        for n, (r, s) in enumerate([(0.1, 2), (0.2, 2), (0.3, 12)])
    ]
    figures = window_figures([*rows, unit(9)])
    assert figures is not None
    assert figures["buildings"] == 3
    assert figures["windows"] == 12
    assert figures["ratio_median"] == 0.2
    assert figures["storeys"] == [{"storeys": "2", "count": 2}, {"storeys": "8 or more", "count": 1}]

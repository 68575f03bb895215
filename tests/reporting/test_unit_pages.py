from __future__ import annotations

from urllib.parse import unquote

import numpy as np
import pytest

from cityflow.core.building import Status
from cityflow.flow.store import Store
from cityflow.reporting.unit_pages import chosen_units, page_path
from cityflow.viewer.report_parameters import ReportParameters, UnitPageParameters
from cityflow.viewer.report_rows import UnitRow


def pages(**counts: int) -> ReportParameters:
    return ReportParameters(pages=UnitPageParameters(**counts))


def house(name: str, status: Status, size: float, **more: object) -> UnitRow:
    ring = np.array([(0, 0), (size, 0), (size, size), (0, size), (0, 0)], float)
    return UnitRow(name, "0_0", status, rings=(ring,), **more)  # type: ignore[arg-type]


def test_pages_are_bounded_and_the_largest_come_first() -> None:
    units = [house(f"u{i:04d}", Status.FAILED, 1.0 + i % 97) for i in range(5000)]
    chosen = chosen_units(units, pages(failed=24))
    assert len(chosen.units) == 24
    assert chosen.left_out == 4976
    assert {u.rings[0].max() for u in chosen.units} == {97.0}


def test_refused_outlines_take_no_page_of_a_failed_building() -> None:
    units = [house(f"r{i}", Status.REFUSED, 90.0 + i) for i in range(9)] + [
        house(f"f{i}", Status.FAILED, 2.0) for i in range(9)
    ]
    chosen = chosen_units(units, pages(failed=9, refused=2, degraded=0, listed=0))
    assert sorted(u.id for u in chosen.units) == ["f0", "f1", "f2", "f3", "f4", "f5", "f6", "f7", "f8", "r7", "r8"]
    assert chosen.left_out == 7


def test_every_failed_building_has_a_page_unless_there_are_hundreds() -> None:
    assert chosen_units([house(f"f{i}", Status.FAILED, 2.0) for i in range(400)], ReportParameters()).left_out == 0


def test_failed_before_refused_before_simplified_before_slow() -> None:
    units = [
        house("slow", Status.DONE, 9, nmad=0.1, seconds=9.0), house("block", Status.DEGRADED, 9),
        house("thin", Status.REFUSED, 9), house("lost", Status.FAILED, 2), UnitRow("point", "", Status.FAILED),
    ]  # fmt: skip
    chosen = chosen_units(units, ReportParameters())
    assert [u.id for u in chosen.units] == ["lost", "point", "thin", "block", "slow"]
    assert chosen.left_out == 0
    assert [u.id for u in chosen_units(units, pages(failed=1, refused=0, degraded=0, listed=0)).units] == ["lost"]


def test_nothing_of_nothing() -> None:
    chosen = chosen_units([], ReportParameters())
    assert (chosen.units, chosen.left_out, chosen.addresses) == ((), 0, {})


@pytest.mark.parametrize("name", ["NL/0503 é?#%", "..", "a" * 300, "", 'x"><b>', "con:1*"])
def test_odd_names_make_files_and_links_that_find_them(name: str) -> None:
    store = Store.open("memory://pages")
    path = page_path(name)
    store.write_bytes(path, b"1")
    assert path.count("/") == 1
    assert len(path.encode()) < 255
    address = chosen_units([house(name, Status.FAILED, 3)], ReportParameters()).addresses[name]
    assert unquote(address) == path
    assert not set(address) & set('?#"<> ')

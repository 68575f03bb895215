"""Figures of districts from the summaries that merges left; no building is read."""

from __future__ import annotations

from pathlib import Path

import shapely

from browser import painted_run as town
from cityflow.core.building import Status
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.handover.export_summary import SUMMARY, Summary, added, encode_summary
from cityflow.handover.unit_counts import counts_of
from cityflow.reporting.summed_city import SummedCity
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared
from cityflow.survey.area import Area

TILES = {"0_0": 3, "1_0": 9, "8_0": 7, "9_0": 8}
DISTRICTS = {"8x8_0_0": ("0_0", "1_0"), "8x8_1_0": ("8_0", "9_0")}


def _rows(tile: str) -> list[dict[str, object]]:
    """Every third building of the west and every second of the east is poor; one failed."""
    poor = 3 if tile in DISTRICTS["8x8_0_0"] else 2
    rows: list[dict[str, object]] = [
        {
            "status": "done",
            "attributes": {"verdict": "good" if k % poor else "poor", "nmad": 0.01 * (k + 1), "method": "m"},
        }
        for k in range(TILES.get(tile, 2))
    ]
    return [*rows[:-1], {"status": "failed", "attributes": None}]


def _leave(store: Store, name: str, parts: tuple[str, ...], made: dict[str, Summary]) -> Record:
    found = [made[part] for part in parts]
    counts = added(s.counts for s in found) if parts else counts_of(_rows(name))
    made[name] = Summary(name, (0.0, 0.0, 1.0, 1.0), sum(s.tiles for s in found) or 1, counts, None, {}, {}, ())
    path = f"work/export/{name}/0/{SUMMARY}"
    store.write_bytes(path, encode_summary(made[name]))
    inputs = {f"part {part}": "" for part in parts}
    return Record("export", name, 1, "", 1, Status.DONE, "", {path: ""}, {}, {}, inputs)


def test_districts_are_told_from_summaries_the_worst_first(tmp_path: Path) -> None:
    run = town.prepare(town.write_catalog(tmp_path), tmp_path / "run")
    made: dict[str, Summary] = {}
    merged = {**dict.fromkeys(TILES, ()), **DISTRICTS, "city": tuple(DISTRICTS)}
    records = CurrentRecords({"export": [_leave(run.store, name, parts, made) for name, parts in merged.items()]})
    summed = SummedCity.read(run, records)
    assert summed.whole == made["city"]
    assert summed.has_districts
    assert summed.densest(run, records) == "9_0", "of the district with 15 buildings, the other has 12"
    rows = summed.rows()
    assert [row.name for row in rows] == ["8x8_1_0", "8x8_0_0"]
    east = rows[0]
    assert (east.tiles, east.buildings, east.good, east.look, east.poor, east.failed) == (2, 15, 6, 0, 9, 2)
    assert east.nmad_median == 0.04


def test_before_the_last_merge_the_tiles_are_summed(tmp_path: Path) -> None:
    run = town.prepare(town.write_catalog(tmp_path), tmp_path / "run")
    tiles = list(run.source().city.tiles)
    records = CurrentRecords({"export": [_leave(run.store, name, (), {}) for name in tiles]})
    summed = SummedCity.read(run, records)
    assert summed.parts == ()
    assert summed.whole is not None
    assert sum(summed.whole.counts["status"].values()) == 2 * len(tiles)
    assert summed.densest(run, records) == max(tiles)


def test_a_tile_is_covered_where_all_of_it_is_inside() -> None:
    area = Area(shapely.box(0, 0, 10, 10))
    assert area.covers((0, 0, 10, 5))
    assert not area.covers((5, 5, 11, 6))
    assert Area().covers((0, 0, 1, 1))


def test_nothing_is_summed_where_nothing_is_exported(tmp_path: Path) -> None:
    run: Prepared = town.prepare(town.write_catalog(tmp_path), tmp_path / "run")
    summed = SummedCity.read(run, CurrentRecords({}))
    assert (summed.whole, summed.parts, summed.densest(run, CurrentRecords({}))) == (None, (), "")

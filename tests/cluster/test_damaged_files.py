"""Files of a RUN that are not what was written: they are named and made again, and good products stay until there are new ones."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from cityflow.flow.store import Store
from cluster.small_city import Commands, SmallCity, contents, newest, redone

pytestmark = pytest.mark.cluster

FILES = {"ingest": ".laz", "reconstruct": "hull.city.jsonl", "export": "units.json", "surface": "surface.zarr/dsm/c/"}
"""A file of each stage, by a part of its path."""


def left(run: Path, stage: str) -> tuple[str, Path]:
    """A unit of a stage, and a file that it left."""
    for unit, record in newest(run, stage).items():
        paths = [p for p in record["outputs"] if FILES[stage] in p]
        if paths and record["sizes"][paths[0]] > 100:
            return unit, run / paths[0]
    raise AssertionError(stage)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def test_files_that_are_cut_short_are_made_again(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    harmed = {(stage, *left(copied_run, stage)) for stage in FILES}
    for _, _, path in harmed:
        cut(path)
    cut(copied_run / "products/city.city.jsonl")
    done = redone(copied_run, lambda: cityflow.run(small_city, copied_run))
    assert done == {(stage, unit) for stage, unit, _ in harmed} | {("export", "city")}
    assert contents(copied_run) == contents(small_run)


def test_verify_finds_single_bits(cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path) -> None:
    harmed = {(stage, *left(copied_run, stage)) for stage in FILES}
    for _, _, path in harmed:
        flip(path)
    every = {(stage, unit) for stage, unit, _ in harmed}
    first = redone(copied_run, lambda: cityflow.run(small_city, copied_run))
    assert {(stage, unit) for stage, unit in every if stage in ("export", "reconstruct")} <= first, (
        "the report reads them"
    )
    assert first <= every, "and what is made again for it reads others"
    assert redone(copied_run, lambda: cityflow.run(small_city, copied_run, "--verify")) == every - first
    assert contents(copied_run) == contents(small_run)


def test_who_reads_a_changed_file_waits_until_it_is_made_again(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    unit, hull = left(copied_run, "reconstruct")
    flip(hull)
    shutil.rmtree(copied_run / "records/export")
    done = redone(copied_run, lambda: cityflow.run(small_city, copied_run))
    assert ("reconstruct", unit) in done
    assert {stage for stage, _ in done} == {"reconstruct", "export"}
    assert contents(copied_run) == contents(small_run)


def test_readers_name_what_is_cut_short(cityflow: Commands, copied_run: Path) -> None:
    _, rows = left(copied_run, "export")
    cut(rows)
    said = cityflow("report", copied_run)
    assert said.code == 1
    assert f"{rows.relative_to(copied_run)}: has {rows.stat().st_size} bytes" in said.err
    assert "→ run again with --verify" in said.err


def test_products_stay_where_an_export_fails(
    cityflow: Commands, small_city: SmallCity, small_run: Path, copied_run: Path
) -> None:
    """One file of a tile cannot be written: its other products are as before, and the city still has the tile."""
    tile = sorted(p.stem for p in (copied_run / "products/citygml").glob("*.gml"))[0]
    blocked = copied_run / f"products/citygml/{tile}.gml"
    blocked.unlink()
    blocked.mkdir()
    (blocked / "in the way").touch()
    done = cityflow.run(small_city, copied_run, ok=False)
    assert f"failed: export-{tile}" in done.err
    before = contents(small_run)
    assert before.pop(f"products/citygml/{tile}.gml")
    assert {p: d for p, d in contents(copied_run).items() if "in the way" not in p} == before
    shutil.rmtree(blocked)
    assert cityflow("rerun", copied_run, "--failed").code == 0
    assert contents(copied_run) == contents(small_run)
    assert Store.open(copied_run).exists("report.html")

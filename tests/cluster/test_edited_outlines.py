"""Outlines that a person corrects: a rerun of what the edits touch makes the same files as a whole run, and leaves nothing to do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
import shapely

from cityflow.flow.ledger import Ledger
from cityflow.io.tables.edits_written import Edit, EditsFile
from cityflow.runs.run_folder import open_run
from cityflow.workflow.desk_places import Places
from cluster.small_city import Commands, SmallCity, contents, copy_of, newest, redone

pytestmark = pytest.mark.cluster

NEAR_M = 10.0
"""Only what shares walls with an edited building, or nearly touches it, is made again."""
EARLY = {"ingest", "match", "fuse", "surface", "detect"}
"""Stages before outlines; of given ones `ingest` deals them out."""


def entries(run: Path) -> dict[str, str]:
    """Building → its tile."""
    last = "units" if newest(run, "units") else "outline"
    return {e["id"]: tile for tile, r in newest(run, last).items() for e in r["result"]["units"]}


def polygon(run: Path, unit: str) -> shapely.Polygon:
    wanted = open_run(str(run))
    with Ledger.open(wanted.store) as ledger:
        return Places(wanted, ledger).polygon(unit, entries(run)[unit])


def edits_of(run: Path) -> EditsFile:
    return EditsFile(run / "edits.gpkg", open_run(str(run)).catalog.reference)


def commands(run: Path, edits: Sequence[Edit]) -> list[list[str]]:
    wanted = open_run(str(run))
    with Ledger.open(wanted.store) as ledger:
        return Places(wanted, ledger).commands(edits, [], [])


def across(outline: shapely.Polygon) -> shapely.LineString:
    """Through the middle, from one long side to the other."""
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(outline))
    a, b, c, d = corners[:4] if shapely.distance(*shapely.points(corners[:2])) > shapely.distance(*shapely.points(corners[1:3])) else corners[1:5]  # fmt: skip
    return shapely.LineString([(a + b) / 2, (c + d) / 2])


@pytest.mark.parametrize("source", ["given", "found"])
def test_edits_carried_out_where_they_act_are_what_a_whole_run_makes(
    cityflow: Commands, small_city: SmallCity, copied_run: Path, tmp_path: Path, source: str
) -> None:
    sets = ("--set", f"outline.source={source}")
    cityflow.run(small_city, copied_run, *sets)
    before, shapes = contents(copied_run), {unit: polygon(copied_run, unit) for unit in entries(copied_run)}
    largest = sorted(shapes, key=lambda unit: -shapes[unit].area)
    gone, moved = largest[0], largest[1]
    parted = next(u for u in largest[2:] if "." not in u)
    edits = [
        Edit("a", "rejected", shapes[gone], "", "Ann", 1.0),
        Edit("b", "locked", shapely.affinity.scale(shapes[moved], 0.9, 1.0), moved, "Ann", 2.0),
        Edit("c", "cut_lines", across(shapes[parted]), "", "Ann", 3.0),
    ]
    file = edits_of(copied_run)
    written = [file.add(edit, "") for edit in edits]

    def carried_out() -> set[tuple[str, str]]:
        ran = redone(copied_run, lambda: [cityflow("rerun", copied_run, *c) for c in commands(copied_run, written)])
        left = redone(copied_run, lambda: cityflow.run(small_city, copied_run, *sets))
        assert not left, "a whole run finds nothing to do"
        return ran

    other = copy_of(copied_run, tmp_path / "other")
    ran = carried_out()
    assert {s for s, _ in ran} & EARLY == ({"ingest"} if source == "given" else set())
    cityflow.run(small_city, other, *sets)
    assert contents(copied_run) == contents(other)
    now = entries(copied_run)
    assert gone not in now
    assert moved in now
    assert {u for u in now if u.startswith(f"{parted}.")}
    assert parted not in now
    if source == "found":  # the first border of given outlines has them all looked at
        places = shapely.union_all([edit.shape for edit in edits])
        made = [u for s, u in ran if s == "reconstruct" and u in shapes]
        assert {u for u in made if shapely.distance(shapes[u], places) > NEAR_M} == set()
        assert len(made) < len(shapes)
    for edit in written:
        file.remove(edit.name)
    carried_out()
    assert contents(copied_run) == before

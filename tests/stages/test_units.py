"""Stage ``units``: what outlines were split into, tied with the units of the outlines that touch them."""

from __future__ import annotations

from math import nan
from pathlib import Path

import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.building import Direction, Outline, OutlineEdge, Status
from cityflow.core.edits import Edits
from cityflow.core.splitting import CutLine, Splitting
from cityflow.flow.store import Store
from cityflow.flow.task import Task
from cityflow.flow.typed import as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.outline_lines import OutlineAt, Standing, decode, decode_all, encode, entries, lines
from cityflow.handover.split_lines import decode_splitting, encode_splitting, read_splits
from cityflow.stages import units

WEST, EAST = shapely.box(0, 0, 20, 10), shapely.box(20, 0, 40, 10)
CUT = LineString([(0.0, 5.0001), (20.0, 5.0001)])


def split_west() -> Splitting:
    """The western outline in two, along a line that ends on the wall shared with the eastern one."""
    south, north = shapely.box(0, 0, 20, 5.0001), shapely.box(0, 5.0001, 20, 10)
    cut = CutLine(CUT, "cut", 0.7, 0.4, 0.21, 0.0, 0.93, nan)
    return Splitting((south, north), (cut,), (), (Direction(30.1, 0.05, 0.8),), (Direction(45.0, 1.0, 0.3),))


def test_a_splitting_read_again_is_the_same() -> None:
    written = encode_splitting(split_west())
    again = decode_splitting(written)
    assert encode_splitting(again) == written
    assert again.aspects == split_west().aspects
    assert np.isnan(again.cut_lines[0].angle_sigma_deg)
    assert again.cut_lines[0].height_step_m == 0.21
    assert all(a.equals_exact(b, 0) for a, b in zip(again.units, split_west().units, strict=True))


def test_what_is_known_of_walls_survives_its_line() -> None:
    edge = OutlineEdge(LineString([(0, 0), (20, 0)]), "wall", 0.03, 0.9)
    inner = OutlineEdge(LineString([(5, 0), (5, 10)]), "wall", nan, 0.5)
    outline = Outline("w", WEST, {}, "", WEST.buffer(0.5, join_style="mitre"), (edge,), (inner,))
    again = decode(encode(Standing(outline))).outline
    assert again.roof is not None
    assert again.roof.equals(outline.roof)
    assert (again.edges[0].source, again.edges[0].sigma_m, again.edges[0].seen) == ("wall", 0.03, 0.9)
    assert np.isnan(again.inner_edges[0].sigma_m)


def units_of_tiles(tmp_path: Path, west_fails: bool = False) -> dict[str, tuple[Status, list[Standing]]]:
    """Both tiles' units; each tile owns one outline."""
    store = Store.open(str(tmp_path))
    outlines = {
        "west": Standing(Outline("west", WEST, {"street": "Oude Delft"}), ("east",), ("1_0",)),
        "east": Standing(Outline("east", EAST, {}), ("west",), ("0_0",)),
    }
    text = lines(outlines.values())
    store.write_bytes("work/outlines.jsonl", text)
    store.write_bytes("work/west.json", encode_splitting(split_west()))
    store.write_bytes("work/east.json", encode_splitting(Splitting((EAST,), reason="too small")))
    splits = {"west": None if west_fails else "work/west.json", "east": "work/east.json"}
    place = {e["id"]: OutlineAt(e["path"], e["start"], e["length"]) for e in entries(text, "work/outlines.jsonl")}
    about = {
        name: units.SplitOutline(place[name], tile, splits[name], "ran out of memory" if splits[name] is None else "")
        for name, tile in (("west", "0_0"), ("east", "1_0"))
    }
    found = {}
    for name, tile in (("west", "0_0"), ("east", "1_0")):
        given = as_json(units.UnitsInputs((name,), about, Edits()))
        task = Task("units", tile, "cityflow.stages.units:run", 1, arguments=given)
        workspace = Workspace(store, task)
        outcome = units.run(workspace, task)
        path = next(p for p in outcome.outputs if p.endswith(units.UNITS))
        listed = read_splits(store.read_bytes(next(p for p in outcome.outputs if p.endswith(units.SPLITS))))
        assert [outline for outline, _ in listed] == ([] if splits[name] is None else [name])
        assert [e["id"] for e in outcome.result["units"]] == [s.outline.id for s in decode_all(store.read_bytes(path))]
        found[tile] = outcome.status, decode_all(store.read_bytes(path))
    return found


def vertices(polygon: Polygon) -> set[tuple[float, float]]:
    return {(x, y) for x, y in shapely.get_coordinates(polygon).tolist()}


def test_a_cut_that_ends_on_a_shared_wall_is_a_vertex_of_the_neighbour_in_another_tile(tmp_path: Path) -> None:
    found = units_of_tiles(tmp_path)
    (_, west), (_, east) = found["0_0"], found["1_0"]
    assert len(west) == 2
    assert [s.outline.id for s in east] == ["east"]
    assert (20.0, 5.0001) in vertices(east[0].outline.polygon)
    names = {s.outline.id for s in west}
    assert all(n.startswith("west.") for n in names)
    assert set(east[0].neighbours) == names
    assert set(east[0].neighbour_tiles) == {"0_0"}
    for standing in west:
        assert "east" in standing.neighbours
        assert set(standing.neighbour_tiles) == {"0_0", "1_0"}
        assert standing.outline.attributes == {"street": "Oude Delft"}
        assert standing.outline.aspects == split_west().aspects


def test_an_outline_whose_split_failed_stays_whole_and_says_why(tmp_path: Path) -> None:
    status, west = units_of_tiles(tmp_path, west_fails=True)["0_0"]
    assert status is Status.DEGRADED
    assert [s.outline.id for s in west] == ["west"]
    assert west[0].outline.remark == "not split: ran out of memory"
    assert west[0].outline.polygon.equals(WEST)

"""Given outlines of neighbouring tiles: each tile's task moves its own walls, and both make the same vertices of what they share."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely import Polygon

from cityflow.core.building import Outline
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.flow.local_folder import LocalFolder
from cityflow.flow.store import Store
from cityflow.handover.outline_lines import decode, encode, owned
from cityflow.handover.surfaces import Surfaces
from cityflow.outlines.under_eaves.facades_inside import LARGEST_M, NEAR_M, SeenHouses
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.stages.ingest.outline_sample import sampled
from cityflow.stages.outline import given_walls as outline_walls
from cityflow.survey.surface_source import ZARR

TILE_M = 100.0


def row() -> list[Outline]:
    """Three roofs side by side across the border of two tiles at x = 100."""
    return [
        Outline(f"h{k}", Polygon([(x, 10), (x + 8, 10), (x + 8, 20), (x, 20)]))
        for k, x in enumerate((84.0, 92.0, 100.0))
    ]


GRID = Grid(0, 100, 0.5, 200, 400)
NOTHING = outline_walls.FacadeInputs(None, (), Surfaces(GRID, ZARR, GRID))


def roofs_and_echoes() -> np.ndarray:
    """Level roofs, and echoes on the south walls, 0.5 m under the eaves."""
    x, y = (v.ravel() for v in np.meshgrid(np.arange(84.1, 108, 0.25), np.arange(10.05, 20, 0.2)))
    rng = np.random.default_rng(5)
    walls = np.column_stack([rng.uniform(84, 108, 500), rng.normal(10.5, 0.03, 500), rng.uniform(0.5, 5.5, 500)])
    return np.vstack([np.column_stack([x, y, np.full(len(x), 6.0)]), walls])


def test_two_tiles_agree(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(outline_walls, "_seen", lambda *_: SeenHouses.of(roofs_and_echoes(), None))
    by_tile = owned(row(), TILE_M, {"0_0", "1_0"})
    assert set(by_tile) == {"0_0", "1_0"}
    moved = {
        s.outline.id: s
        for tile, other in (("0_0", "1_0"), ("1_0", "0_0"))
        for s in outline_walls.moved_in(
            Store(LocalFolder(str(tmp_path))), NOTHING, by_tile[tile], by_tile[other], WallsInParameters(), 0.05
        )
    }
    assert set(moved) == {"h0", "h1", "h2"}
    for standing in moved.values():
        outline = standing.outline
        assert outline.polygon.bounds[1] == pytest.approx(10.5, abs=0.03)
        assert outline.roof is not None
        assert outline.roof.bounds[1] == 10.0
        again = decode(encode(standing)).outline
        assert [e.source for e in again.rims] == ["roof"]
        assert again.polygon.equals(outline.polygon)
    for a, b in (("h0", "h1"), ("h1", "h2")):
        one, two = (set(map(tuple, shapely.get_coordinates(moved[k].outline.polygon).tolist())) for k in (a, b))
        assert len(one & two) == 2
        assert shapely.intersection(moved[a].outline.polygon, moved[b].outline.polygon).area == 0
        assert any(moved[a].outline.party)


def test_outlines_wider_than_a_task_sees_stay(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(outline_walls, "_seen", lambda *_: SeenHouses.of(roofs_and_echoes(), None))
    monkeypatch.setattr(outline_walls, "LARGEST_M", 7.0)
    by_tile = owned(row(), TILE_M, {"0_0", "1_0"})
    own = by_tile["0_0"]
    assert outline_walls.moved_in(Store(LocalFolder(str(tmp_path))), NOTHING, own, [], WallsInParameters(), 0.05) == own


def test_outlines_are_sampled_from_the_file_that_most_stand_in() -> None:
    names, bounds = [o.id for o in row()], shapely.bounds([o.polygon for o in row()])
    files = {"east": (95.0, 0.0, 200.0, 100.0), "all": (0.0, 0.0, 200.0, 100.0), "none": (300.0, 0.0, 400.0, 100.0)}
    assert sampled(names, bounds, files) == ("all", [0, 1, 2])
    assert sampled(names, bounds, {"none": files["none"]}) == ("", [])
    assert sampled(names, bounds, {}) == ("", [])
    assert sampled([], np.empty((0, 4)), files) == ("", [])


def test_the_sample_is_of_the_file_that_most_outlines_stand_in() -> None:
    rng = np.random.default_rng(3)
    corners, widths = rng.uniform(0, 600, (200, 2)).round(1).tolist(), rng.uniform(3, 120, 200).round(1).tolist()
    houses = [
        Outline(f"o{k}", shapely.box(x, y, x + w, y + 8))
        for k, ((x, y), w) in enumerate(zip(corners, widths, strict=True))
    ]
    files = {f"f{i}": (200.0 * i - 50, -50.0, 200.0 * i + 350, 700.0) for i in range(3)}

    def stands_in(house: Outline, bounds: Bounds) -> bool:
        x_0, y_0, x_1, y_1 = grown(house.polygon.bounds, NEAR_M)
        is_usual = max(x_1 - x_0, y_1 - y_0) <= LARGEST_M
        return is_usual and x_0 >= bounds[0] and y_0 >= bounds[1] and x_1 <= bounds[2] and y_1 <= bounds[3]

    inside = {name: [h.id for h in houses if stands_in(h, b)] for name, b in files.items()}
    most = max(sorted(inside), key=lambda name: len(inside[name]))
    names, boxes = [h.id for h in houses], shapely.bounds([h.polygon for h in houses])
    name, chosen = sampled(names, boxes, files)
    assert (name, [names[i] for i in chosen]) == (most, inside[most])
    assert 0 < len(inside[most]) < len(houses)
    assert sampled(names, boxes, {}) == ("", [])

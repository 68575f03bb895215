"""The order in which a large city is worked on: tile by tile and district by district, and few of either are begun and not ended at a time."""

from __future__ import annotations

import heapq
from typing import Any

import pytest

from cityflow.core.building import Status
from cityflow.core.reference import Reference
from cityflow.flow.ready import Ready
from cityflow.flow.task import Record, Task
from cityflow.io.catalog.stac import Catalog, LidarAsset
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters

COLS, ROWS, TILE = 48, 8, 250.0
"""A town of six districts in a row, with a building on each tile."""
IN_FLIGHT = 32


def town() -> CitySource:
    files = tuple(
        LidarAsset(f"{c}_{r}", f"{c}_{r}.laz", "1" * 64, 1, (c * 1000.0, r * 1000.0, c * 1000.0 + 999, r * 1000.0 + 999), (0.0, 9.0), 9)
        for r in range(2) for c in range(12)
    )  # fmt: skip
    catalog = Catalog("", "town", Reference("EPSG:28992", 28992, None, ""), "", "", files, None)
    return CitySource(
        catalog, CityParameters.model_validate({"split": {"when": "never"}, "points": {"source": "lidar"}})
    )


def record_of(task: Task) -> Record:
    """What the task would have left."""
    result = dict[str, Any](digest=f"{task.stage} {task.unit}")
    outputs = {f"work/{task.stage}/{task.unit}/out": "d" * 64}
    if task.stage == "outline":
        col, row = map(int, task.unit.split("_"))
        x, y = (col + 0.5) * TILE, (row + 0.5) * TILE
        place = {"bounds": [x, y, x + 9, y + 9], "point": [x + 4, y + 4], "neighbours": [], "neighbour_tiles": []}
        unit = {"id": f"h{task.unit}", "digest": task.unit, "path": next(iter(outputs)), "start": 0, "length": 1}
        result["units"] = [unit | place]
    return Record(
        task.stage, task.unit, 1, task.digest, task.version, Status.DONE, "", outputs, result, task.parameters, task.inputs
    )  # fmt: skip


@pytest.fixture(scope="module")
def ended() -> list[tuple[str, str]]:
    """Tasks in the order in which they end, as the engine submits them and Dask runs them."""
    source = town()
    ready, flying, found, count = Ready(source.initial()), list[tuple[int, int, Task]](), list[tuple[str, str]](), 0
    while True:
        while len(flying) < IN_FLIGHT and (one := ready.next()) is not None:
            heapq.heappush(flying, (one[1], count := count + 1, one[0]))
        if not flying:
            return found
        rank, _, task = heapq.heappop(flying)
        found.append((task.stage, task.unit))
        ready.add(source.after(task, record_of(task)), rank)


def district_of(tile: str) -> tuple[int, int]:
    col, row = map(int, tile.split("_"))
    return col // 8, row // 8


def test_the_first_products_come_before_later_districts_begin(ended: list[tuple[str, str]]) -> None:
    first = next(k for k, (stage, _) in enumerate(ended) if stage == "export")
    assert len(ended) > 4 * COLS * ROWS
    assert first < 4 * IN_FLIGHT, f"of {len(ended)} tasks"
    assert {district_of(unit) for stage, unit in ended[:first] if stage == "surface"} == {(0, 0)}
    merged = ended.index(("export", "8x8_0_0"))
    begun = {district_of(unit) for stage, unit in ended[:merged] if stage == "surface"}
    # the rim of its neighbour, which its own tiles need
    assert begun == {(0, 0), (1, 0)}


def test_few_tiles_and_districts_are_begun_and_not_ended(ended: list[tuple[str, str]]) -> None:
    tiles, districts, most_tiles, most_districts = set[str](), dict[tuple[int, int], int](), 0, 0
    for stage, unit in ended:
        if stage == "surface":
            tiles.add(unit)
        elif stage == "export" and unit[:2] == "8x":
            del districts[tuple(map(int, unit.split("_")[1:]))]  # type: ignore[arg-type]
        elif stage == "export" and unit != "city":
            tiles.discard(unit)
            districts[district_of(unit)] = districts.get(district_of(unit), 0) + 1
        most_tiles, most_districts = max(most_tiles, len(tiles)), max(most_districts, len(districts))
    assert not tiles
    assert not districts
    assert most_districts <= 3
    # what is in flight, and what four files of 16 tiles lie under
    assert most_tiles <= IN_FLIGHT + 4 * 16, most_tiles

"""Tiles of a real survey as the map of its run."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Silent
from cityflow.flow.run_news import RunNews
from cityflow.flow.task import Record, Task
from cityflow.runs.current import walked
from cityflow.runs.run_folder import open_run
from cityflow.workflow.followed import FollowedCity
from cityflow.workflow.tile_places import TilePlaces


def test_every_task_of_a_flight_but_files_lies_on_a_tile_and_all_tiles_are_closed(flight_run: Path) -> None:
    wanted = open_run(str(flight_run))
    source = wanted.source()
    news = RunNews(Silent(), TilePlaces(cast(FollowedCity, SimpleNamespace(city=source))))
    nowhere: set[str] = set()

    def visit(task: Task, record: Record) -> None:
        news.ready(task)
        news.finished(record, fresh=False)
        if not news.places.of(task.stage, task.unit):
            nowhere.add(task.stage)

    with Ledger.open(wanted.store) as ledger:
        records = walked(source, ledger, visit)
    assert nowhere <= {"ingest", "match", "frame", "export"}, (
        "files, reference images, tiles of frames, and what joins the city"
    )
    places = news.changed_places()
    assert set(records.units("export")) & set(source.city.tiles) <= {name for name, n in places.items() if n[3]}
    assert sum(n[0] for n in places.values()) > len(records.units("texture"))
    assert all(ready == finished for ready, finished, *_ in places.values())

"""A run of the toy town that tells of itself: some buildings fail, and its tiles stand on a map."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from distributed import Client

from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import Silent
from cityflow.flow.run_news import RunNews
from cityflow.flow.run_page import publisher
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from flow.toy_sources import Town

TILES, BUILDINGS = 4, 3


@dataclass
class TownPlaces:
    """Two columns of tiles, and one in the north-east that nobody works on."""

    def all(self) -> Iterable[str]:
        return ["0_0", "1_0", "0_1", "1_1", "2_2"]

    def of(self, stage: str, unit: str) -> str:
        number = unit.split("/")[0]
        return f"{int(number) % 2}_{int(number) // 2}" if number.isdigit() else ""

    def is_closed_by(self, record: Record) -> bool:
        return record.unit.endswith("/0000")


@dataclass
class Unlucky(Town):
    """The last building of the tile 1_1 is never done."""

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        for following in super().after(task, record):
            bad = following.unit == f"003/{BUILDINGS - 1:04d}"
            yield replace(following, function="flow.toy_stages:unusable") if bad else following


def run_town(client: Client, store: Store, run: str) -> RunNews:
    """Run it; what it has told stays with the scheduler."""
    news = RunNews(Silent(), TownPlaces())
    news.tell_to(publisher(client, run), 0.1)
    with Ledger.open(store) as ledger:
        run_tasks(Unlucky(TILES, BUILDINGS), client, store, ledger, progress=news)
    news.close()
    return news

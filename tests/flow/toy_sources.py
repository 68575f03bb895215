"""Sources of toy tasks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from cityflow.flow.task import Limits, Record, Task
from flow.toy_stages import toy


@dataclass
class Given:
    """A list of tasks that wait for nothing; remembers what was told."""

    tasks: Iterable[Task]
    told: list[tuple[Task, Record]] = field(default_factory=list)
    pulled: int = 0

    def initial(self) -> Iterator[Task]:
        for task in self.tasks:
            self.pulled += 1
            yield task

    def after(self, task: Task, record: Record) -> Iterable[Task]:
        self.told.append((task, record))
        return ()


@dataclass
class Town:
    """Tiles; each makes buildings ready, whose inputs are the digests of what the tile gave; all of them one export."""

    tiles: int = 4
    buildings: int = 5
    version: int = 1
    function: str = "square"
    sleep_s: float = 0.0
    retries: int = 0
    told: list[str] = field(default_factory=list)
    digests: dict[str, str] = field(default_factory=dict)

    def initial(self) -> Iterator[Task]:
        for i in range(self.tiles):
            yield toy(f"{i:03d}", "square", "surface", arguments={"number": i, "sleep_s": self.sleep_s})

    def after(self, task: Task, record: Record) -> Iterator[Task]:
        self.told.append(task.name)
        if task.stage == "surface":
            return self._buildings(task, record)
        if task.stage == "reconstruct":
            self.digests[task.unit] = "".join(record.outputs.values())
            if len(self.digests) == self.tiles * self.buildings:
                return iter([toy("all", "square", "export", inputs=dict(sorted(self.digests.items())))])
        return iter(())

    def _buildings(self, tile: Task, record: Record) -> Iterator[Task]:
        for k in range(self.buildings):
            yield toy(
                f"{tile.unit}/{k:04d}",
                self.function,
                "reconstruct",
                version=self.version,
                inputs={"surface": next(iter(record.outputs.values()))},
                arguments={"number": record.result["square"] + k, "sleep_s": self.sleep_s},
                limits=Limits(30, 2000, self.retries),
            )

    @property
    def size(self) -> int:
        return self.tiles + self.tiles * self.buildings + 1

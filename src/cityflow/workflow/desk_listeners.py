"""Pages at the desk that hear what happens, as it happens."""

from __future__ import annotations

import queue
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

HEARD_EVERY_S = 10.0

Json = Any


@dataclass(slots=True)
class Listeners:
    """Pages that hear what happens."""

    queues: list[queue.SimpleQueue[tuple[str, Json]]] = field(default_factory=list)

    def tell(self, name: str, value: Json) -> None:
        for one in [*self.queues]:
            one.put((name, value))

    def listen(self) -> Iterator[tuple[str, Json] | None]:
        own: queue.SimpleQueue[tuple[str, Json]] = queue.SimpleQueue()
        self.queues.append(own)
        try:
            while True:
                try:
                    yield own.get(timeout=HEARD_EVERY_S)
                except queue.Empty:
                    yield None
        finally:
            self.queues.remove(own)

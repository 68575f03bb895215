"""What a unit of each stage takes, as far as one can say before it ran."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cityflow.flow.ledger import Ledger
from cityflow.flow.progress_counts import Expected
from cityflow.stages.city import CitySource


@dataclass(frozen=True, slots=True)
class Cost:
    """Of one unit on one core: seconds, memory of its process, disk that it leaves."""

    stage: str
    seconds: float
    memory_mb: float
    disk_mb: float

    def measured(self, ledger: Ledger) -> Cost:
        """With the figures of the units that the RUN has already done, where there are any."""
        seconds, peak = ledger.mean_seconds(self.stage), ledger.peak_mb(self.stage)
        return Cost(self.stage, seconds or self.seconds, peak or self.memory_mb, self.disk_mb)


COSTS = {
    "ingest": Cost("ingest", 1.0, 400.0, 4.0),
    "match": Cost("match", 10.0, 1500.0, 10.0),
    "fuse": Cost("fuse", 10.0, 1500.0, 10.0),
    "surface": Cost("surface", 6.0, 900.0, 4.0),
    "ortho": Cost("ortho", 5.0, 1000.0, 20.0),
    "frame": Cost("frame", 10.0, 1500.0, 20.0),
    "walls": Cost("walls", 10.0, 1500.0, 2.0),
    "outline": Cost("outline", 0.2, 400.0, 0.2),
    "split": Cost("split", 0.5, 600.0, 0.01),
    "units": Cost("units", 0.2, 400.0, 0.1),
    "reconstruct": Cost("reconstruct", 0.3, 500.0, 0.02),
    "texture": Cost("texture", 3.0, 900.0, 2.0),
    "windows": Cost("windows", 0.5, 500.0, 0.05),
    "atlas": Cost("atlas", 3.0, 900.0, 8.0),
    "export": Cost("export", 5.0, 600.0, 4.0),
}
"""Of LiDAR, measured on Delft (15 points per m², tiles of 250 m); replaced by the RUN's own figures as soon as it has some."""


def costs_of(ledger: Ledger | None) -> dict[str, Cost]:
    """What a task of each stage takes: as the RUN has measured it, else as by experience."""
    return {stage: cost.measured(ledger) if ledger else cost for stage, cost in COSTS.items()}


def expected_tasks(source: CitySource, costs: Mapping[str, Cost]) -> dict[str, Expected]:
    """What a run will take as far as one can know it now, by stage in the order of the flow."""
    return {
        stage: Expected(count or 0, costs[stage].seconds, count is not None)
        for stage, count in source.expected_units().items()
    }

"""Expected time and memory of a unit of each stage, before it ran."""

from __future__ import annotations

from collections.abc import Mapping

from cityflow.flow.ledger import Ledger
from cityflow.flow.progress_counts import Expected
from cityflow.flow.stage import Cost, Stage
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.pipeline import PIPELINE
from cityflow.survey.city import City


def costs_of(ledger: Ledger | None) -> dict[str, Cost]:
    """What a task of each stage takes: as the RUN has measured it, else as by experience."""
    return {s.name: _measured(s, ledger) if ledger else s.cost for s in PIPELINE}


def usual_mb(costs: Mapping[str, Cost]) -> dict[str, float]:
    """Memory that a task of each stage asks for before more is known, MB."""
    return {stage: cost.memory_mb for stage, cost in costs.items()}


def _measured(stage: Stage[City], ledger: Ledger) -> Cost:
    cost, tally = stage.cost, ledger.tally(stage.name)
    return Cost(tally.mean_seconds or cost.seconds, tally.peak_mb or cost.memory_mb, cost.disk_mb)


def expected_tasks(source: CitySource, costs: Mapping[str, Cost]) -> dict[str, Expected]:
    """What a run will take as far as one can know it now, by stage in the order of the flow."""
    return {
        stage: Expected(count or 0, costs[stage].seconds, count is not None)
        for stage, count in source.expected_units().items()
    }

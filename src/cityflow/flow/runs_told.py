"""What drivers have told of their runs, on the scheduler's side: the newest runs, their places, and how fast they go."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

MOST_RUNS = 10
"""Runs that are kept, those told of last."""
PACE_S = 60.0
"""Span over which the pace of a stage is measured, seconds."""
SAMPLES = 90


@dataclass
class Told:
    """One run: counts and failures as told last, all its places, when it was told, and counts of the last minute."""

    news: Mapping[str, Any]
    heard: float
    places: dict[str, list[int]] = field(default_factory=dict)
    past: deque[tuple[float, Mapping[str, int]]] = field(default_factory=lambda: deque(maxlen=SAMPLES))

    def a_minute(self, stage: str) -> float:
        """Units of a stage that end in a minute, at the pace of the last one; those of earlier runs left out.

        >>> told = Told({}, 30.0, past=deque([(0.0, {"match": 4}), (30.0, {"match": 10})]))
        >>> told.a_minute("match"), told.a_minute("fuse")
        (12.0, 0.0)
        """
        if len(self.past) < 2:
            return 0.0
        (begin, before), (end, now) = self.past[0], self.past[-1]
        return 60.0 * (now.get(stage, 0) - before.get(stage, 0)) / max(end - begin, 1.0)


class RunsTold:
    """Runs by name, the one told of last at the end."""

    def __init__(self) -> None:
        self.runs: dict[str, Told] = {}

    def hear(self, run: str, news: Mapping[str, Any], places: Mapping[str, list[int]], now: float) -> None:
        """Take what a driver tells; a driver that begins anew tells all places again.

        Parameters
        ----------
        places : name → numbers, of those that changed
        now : seconds since the epoch
        """
        told = self.runs.pop(run, None)
        if told is None or told.news["driver"] != news["driver"]:
            told = Told(news, now)
        told.news, told.heard = news, now
        told.places.update(places)
        told.past.append((now, {s: n["finished"] - n["from_before"] for s, n in news["stages"].items()}))
        while now - told.past[0][0] > PACE_S:
            told.past.popleft()
        self.runs[run] = told
        while len(self.runs) > MOST_RUNS:
            del self.runs[next(iter(self.runs))]

    def as_json(self) -> dict[str, Any]:
        """Counts of all runs, without the map."""
        return {run: {**told.news, "places": len(told.places)} for run, told in self.runs.items()}

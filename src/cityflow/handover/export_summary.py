"""What a tile or a district leaves for the merge above it: small, whatever there is below."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from heapq import nsmallest
from typing import Any

from cityflow.core.building import Status
from cityflow.core.grid import Bounds
from cityflow.core.verdicts import PROBABILITY_KEY, VERDICT_KEY, Verdict
from cityflow.flow.typed import TaskInputs, as_json, from_json
from cityflow.io.city_models.tiles3d_tree import TileRoot

SUMMARY = "summary.json"
MOST_WORST = 64


@dataclass(frozen=True, slots=True)
class Worst(TaskInputs):
    """A unit whose verdict is not good: its id and tile, and what it is ranked by."""

    id: str
    tile: str
    is_poor: bool
    good_probability: float
    rmse: float

    @property
    def rank(self) -> tuple[bool, float, float, str]:
        """The worst comes first; as in the report's review list."""
        return not self.is_poor, self.good_probability, -self.rmse, self.id


@dataclass(frozen=True, slots=True)
class Summary(TaskInputs):
    """A tile, or several.

    Attributes
    ----------
    bounds : metres
    tiles : their number
    counts : what is counted → value → number of units (`unit_counts`)
    box : of its STAC items, west, south, east, north in degrees; None in a local frame
    roots : file name of a set of 3D Tiles → its root
    mosaics : raster → bounds of the part of it that is there, metres
    worst : units to look at first, at most `MOST_WORST`
    """

    name: str
    bounds: Bounds
    tiles: int
    counts: Mapping[str, Mapping[str, int]]
    box: tuple[float, ...] | None
    roots: Mapping[str, TileRoot]
    mosaics: Mapping[str, Bounds]
    worst: tuple[Worst, ...]


def encode_summary(summary: Summary) -> bytes:
    """As JSON; floats are exact."""
    return json.dumps(as_json(summary), ensure_ascii=False, separators=(",", ":"), sort_keys=True).encode()


def decode_summary(data: bytes, path: str) -> Summary:
    return from_json(Summary, json.loads(data), path)


def worst_of(tile: str, rows: Mapping[str, Mapping[str, Any]]) -> tuple[Worst, ...]:
    """Of the units of a tile; those without a model are not among them, since records name them."""
    found = [
        Worst(unit, tile, attributes[VERDICT_KEY] == Verdict.POOR, float(attributes.get(PROBABILITY_KEY) or 0.0), float(attributes.get("rmse") or 0.0))
        for unit, row in rows.items()
        if row["status"] in (Status.DONE, Status.DEGRADED)
        and (attributes := row["attributes"] or {}).get(VERDICT_KEY) in (Verdict.LOOK, Verdict.POOR)
    ]  # fmt: skip
    return first_of(found)


def first_of(worst: Iterable[Worst]) -> tuple[Worst, ...]:
    """The worst of some, in the order of their rank."""
    return tuple(nsmallest(MOST_WORST, worst, key=lambda one: one.rank))


def added(counts: Iterable[Mapping[str, Mapping[str, int]]]) -> dict[str, dict[str, int]]:
    """The counts of several summaries as one.

    >>> added([{"status": {"done": 2}}, {"status": {"done": 1, "failed": 1}}])
    {'status': {'done': 3, 'failed': 1}}
    """
    found: dict[str, Counter[str]] = {}
    for one in counts:
        for what, numbers in one.items():
            found.setdefault(what, Counter()).update(numbers)
    return {what: dict(sorted(numbers.items())) for what, numbers in sorted(found.items())}


def around(bounds: Iterable[Bounds]) -> Bounds:
    """The rectangle over some rectangles; at least one."""
    x_min, y_min, x_max, y_max = zip(*bounds, strict=True)
    return min(x_min), min(y_min), max(x_max), max(y_max)

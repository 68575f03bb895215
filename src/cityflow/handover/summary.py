"""What a tile or a district leaves for the merge above it: small, whatever there is below."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from cityflow.core.grid import Bounds
from cityflow.flow.typed import TaskInputs, as_json, from_json
from cityflow.io.city_models.tiles3d_tree import TileRoot

SUMMARY = "summary.json"


@dataclass(frozen=True, slots=True)
class Summary(TaskInputs):
    """A tile, or several.

    Attributes
    ----------
    bounds : metres
    tiles : their number
    counts : what is counted → value → number of units: ``status``, ``verdict``, ``method``, ``lod``
    box : of its STAC items, west, south, east, north in degrees; None in a local frame
    roots : file name of a set of 3D Tiles → its root
    mosaics : raster → bounds of the part of it that is there, metres
    """

    name: str
    bounds: Bounds
    tiles: int
    counts: Mapping[str, Mapping[str, int]]
    box: tuple[float, ...] | None
    roots: Mapping[str, TileRoot]
    mosaics: Mapping[str, Bounds]


def encode_summary(summary: Summary) -> bytes:
    """As JSON; floats are exact."""
    return json.dumps(as_json(summary), ensure_ascii=False, separators=(",", ":"), sort_keys=True).encode()


def decode_summary(data: bytes, path: str) -> Summary:
    return from_json(Summary, json.loads(data), path)


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

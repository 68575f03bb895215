"""Counts of units by what their rows say. They add up over tiles, and give medians of a whole city without its buildings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from cityflow.core.building import Status
from cityflow.core.verdicts import PROBABILITY_KEY, VERDICT_KEY, Verdict

TEXTS = ("method", "lod", "roof_type", "windows_missing")
NUMBERS = (
    "planes", "nmad", "rmse", "bias", "le95", "share_explained", "claimed_rmse_m", PROBABILITY_KEY, "windows", "storeys_by_windows",
    "window_to_wall_ratio",
)  # fmt: skip
"""Attributes whose values are counted."""
STATUS, VERDICT, REACHES, OVERHANGS = "status", "verdict", "reach_m", "with_overhangs"
"""How units ended; verdicts, of failed ones poor; overhangs of single edges; units by whether they have some, where these were searched."""


def counts_of(rows: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, int]]:
    """What is counted → value → units with it, of rows of `handover.export_rows`; numbers are rounded (`rounded`)."""
    found = {name: Counter[str]() for name in (STATUS, VERDICT, REACHES, OVERHANGS, *TEXTS, *NUMBERS)}
    for row in rows:
        for name, value in _counted(row):
            found[name][value] += 1
    return {name: dict(sorted(numbers.items())) for name, numbers in found.items()}


def rounded(value: float) -> str:
    """To thousandths below 1, to hundredths below 10, else to tenths: a city has few thousand different values.

    >>> rounded(0.02345), rounded(3.14159), rounded(12.0)
    ('0.023', '3.14', '12.0')
    """
    size = abs(value)
    return f"{value:.{3 if size < 1 else 2 if size < 10 else 1}f}"


def _counted(row: Mapping[str, Any]) -> Iterable[tuple[str, str]]:
    attributes: Mapping[str, Any] = row["attributes"] or {}
    yield STATUS, row["status"]
    if row["status"] != Status.REFUSED:
        failed = row["status"] == Status.FAILED
        yield VERDICT, Verdict.POOR.value if failed else str(attributes.get(VERDICT_KEY) or "")
    for name in TEXTS:
        if attributes.get(name):
            yield name, str(attributes[name])
    for name in NUMBERS:
        value = attributes.get(name)
        if isinstance(value, int | float) and not isinstance(value, bool):
            yield name, rounded(float(value))
    reaches = [float(edge[4]) for edge in row.get("overhangs", [])]
    if "overhang_max_m" in attributes:
        yield OVERHANGS, "yes" if reaches else "no"
    for reach in reaches:
        yield REACHES, rounded(reach)

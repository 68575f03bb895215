"""Figures of the windows of a run, from the attributes of buildings."""

from __future__ import annotations

from collections import Counter
from typing import Any

from cityflow.viewer.unit_figures import COUNT, MISSING, RATIO, STOREYS, UnitFigures, quantile

MANY_STOREYS = 8


def window_figures(found: UnitFigures) -> dict[str, Any] | None:
    """Buildings at which one could look, their windows, the ratio of window to wall, buildings by storeys, and why others say nothing.

    None without a search for windows: what a source says of storeys is no window.
    """
    ratios, storeys, counts = (found.values[key] for key in (RATIO, STOREYS, COUNT))
    missing = found.texts[MISSING]
    if not counts and not missing:
        return None
    rows = Counter(round(s) for s in storeys if s > 0)
    low = [{"storeys": str(n), "count": rows[n]} for n in range(1, MANY_STOREYS) if rows[n]]
    high = sum(n for s, n in rows.items() if s >= MANY_STOREYS)
    return {
        "buildings": len(counts),
        "with_windows": sum(n > 0 for n in counts),
        "windows": int(sum(counts)),
        "with_ratio": len(ratios),
        "ratio_median": quantile(ratios, 0.5),
        "ratio_5": quantile(ratios, 0.05),
        "ratio_95": quantile(ratios, 0.95),
        "storeys": [*low, *([{"storeys": f"{MANY_STOREYS} or more", "count": high}] if high else [])],
        "missing": [
            {"reason": why, "count": n} for why, n in sorted(missing.items(), key=lambda row: (-row[1], row[0]))
        ],
    }

"""What a run says of windows, where it has looked for them: read from the buildings' attributes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from cityflow.viewer.rows import UnitRow

RATIO, STOREYS, COUNT = "window_to_wall_ratio", "storeys", "windows"
MANY_STOREYS = 8


def window_figures(units: Sequence[UnitRow]) -> dict[str, Any] | None:
    """Buildings with windows, their number, the ratio of window to wall, and buildings by storeys; None where no building says."""
    ratios, storeys, counts = (_known(units, key) for key in (RATIO, STOREYS, COUNT))
    if not ratios and not storeys:
        return None
    rows = Counter(round(s) for s in storeys if s > 0)
    low = [{"storeys": str(n), "count": rows[n]} for n in range(1, MANY_STOREYS) if rows[n]]
    high = sum(n for s, n in rows.items() if s >= MANY_STOREYS)
    return {
        "buildings": len(ratios) or len(storeys),
        "windows": int(sum(counts)) if counts else None,
        "ratio_median": _quantile(ratios, 0.5),
        "ratio_5": _quantile(ratios, 0.05),
        "ratio_95": _quantile(ratios, 0.95),
        "storeys": [*low, *([{"storeys": f"{MANY_STOREYS} or more", "count": high}] if high else [])],
    }


def _known(units: Sequence[UnitRow], key: str) -> list[float]:
    values = (u.attributes.get(key) for u in units)
    return [float(v) for v in values if isinstance(v, int | float) and not isinstance(v, bool) and v == v]


def _quantile(values: Sequence[float], share: float) -> float | None:
    return float(np.quantile(values, share)) if values else None

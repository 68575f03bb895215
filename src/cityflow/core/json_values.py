"""Numbers as JSON values."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

PLAIN = frozenset((str, int, bool, type(None)))
"""Types that JSON says as they are."""


def finite(value: Any) -> Any:
    """The same JSON value with None for numbers that JSON cannot say.

    >>> finite({"a": (1.0, float("nan"))})
    {'a': [1.0, None]}
    """
    kind = type(value)
    if kind in PLAIN:
        return value
    if kind is float:
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(k): finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, np.generic):
        return finite(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def rounded(value: float, decimals: int = 3) -> float | None:
    """A figure to so many decimals (a millimetre where nothing is said); None where it is not finite."""
    return round(float(value), decimals) if math.isfinite(value) else None

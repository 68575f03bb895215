"""Values of EXIF tags, which may be damaged, as numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

MM_PER_UNIT = {2: 25.4, 3: 10.0, 4: 1.0, 5: 0.001}
"""EXIF's units of the focal plane: inch, centimetre, millimetre, micrometre."""


def exif_degrees(parts: Any, side: Any, negative: str) -> float | None:
    numbers = [exif_number(p) for p in parts] if isinstance(parts, tuple) and len(parts) == 3 else [None]
    if any(n is None for n in numbers):
        return None
    value = sum(n / 60**i for i, n in enumerate(numbers) if n is not None)
    return -value if str(side).strip("\0 ").upper() == negative else value


def exif_number(value: Any) -> float | None:
    """EXIF's rationals may be 0/0."""
    try:
        number = float(value)
    except (TypeError, ValueError, ZeroDivisionError):
        return None
    return number if np.isfinite(number) else None

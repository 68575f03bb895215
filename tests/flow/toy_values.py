"""A function of values that workers can import: some have no answer, one kills its worker."""

from __future__ import annotations

import os

from cityflow.errors import CatalogError

BAD, MISSING, DEADLY = 5, 7, 11


def half_of(value: int) -> int:
    if value == BAD:
        raise CatalogError("odd", where=str(value))
    if value == MISSING:
        raise FileNotFoundError(value)
    if value == DEADLY:
        os._exit(3)
    return value // 2

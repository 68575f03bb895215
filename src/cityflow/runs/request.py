"""What the command line asks of a run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Request:
    """Which run, of what.

    Attributes
    ----------
    trust : import functions that overrides in the RUN name, too
    allow_outside : the catalog may name files elsewhere, wherever it comes from
    """

    workflow: Path
    catalog: str
    out: str
    settings: tuple[str, ...] = ()
    aoi: str = ""
    trust: bool = False
    allow_outside: bool = False

"""A short text on the surveyed share of the requested ground."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

WHOLE = 0.995
"""A share from here on is all of it."""
NEARLY = 0.95
"""Of surveyed ground, a share below this belongs into the headline."""


def shortfall(images: Mapping[str, Any] | None) -> str:
    """For the headline: what is missing of the area asked for, of its surface and of its ortho; nothing where little is.

    >>> shortfall({"shown_share": 0.9, "completeness_mean": 0.98, "ortho_seen_mean": 0.65})
    ' The flight shows 90 % of the area asked for. Of the surveyed ground, 65 % has a colour in the true ortho.'
    """
    if images is None:
        return ""
    shown, found = images["shown_share"], []
    if images["completeness_mean"] is not None and images["completeness_mean"] < NEARLY:
        found.append(f"{_percent(images['completeness_mean'])} has a height")
    if images["ortho_seen_mean"] is not None and images["ortho_seen_mean"] < NEARLY:
        found.append(f"{_percent(images['ortho_seen_mean'])} has a colour in the true ortho")
    area = f" The flight shows {_percent(shown)} of the area asked for." if shown is not None and shown < WHOLE else ""
    return area + (f" Of the surveyed ground, {' and '.join(found)}." if found else "")


def what_was_surveyed(images: Mapping[str, Any] | None) -> str:
    """Area asked for, share that enough images see, and what of it has heights and colours; nothing before there is a surface."""
    if images is None or not images["surveyed_m2"]:
        return ""
    asked, shown = images["asked_m2"], images["shown_share"]
    known = [(images["completeness_mean"], "a height"), (images["ortho_seen_mean"], "a colour in the true ortho")]
    of = f"{_percent(shown)} of the {_hectares(asked)} asked for" if asked and shown is not None else ""
    have = " and ".join(f"{_percent(share)} has {what}" for share, what in known if share is not None)
    surveyed = f"Of the tiles worked on, {_hectares(images['surveyed_m2'])} are seen by enough images"
    return ". ".join([part for part in (of, surveyed + (f": {have}" if have else "")) if part]) + "."


def _percent(share: float) -> str:
    """Never all where something is missing.

    >>> _percent(0.9996), _percent(0.5)
    ('99.9 %', '50 %')
    """
    if share >= NEARLY:
        return f"{int(1000 * share + 1e-6) / 10:.1f} %" if share < 1 else "100 %"
    return f"{100 * share:.0f} %"


def _hectares(m2: float) -> str:
    return f"{m2 / 1e4:,.2f} ha"

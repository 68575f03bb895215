"""Flights as they are flown, by name."""

from __future__ import annotations

import math
from typing import Any

from cityflow.core.parameters import merged
from cityflow.errors import CityflowError
from cityflow.synthetic.flight import Direction, FlightParameters, Head

SIDES: tuple[Direction, ...] = ("forward", "right", "back", "left")


def _obliques(tilt_deg: float, focal_factor: float, sides: tuple[Direction, ...] = SIDES) -> tuple[Head, ...]:
    return tuple(Head(name=s, direction=s, tilt_deg=tilt_deg, focal_factor=focal_factor) for s in sides)


def _crossing() -> FlightParameters:
    """Nadir and two obliques at 36° in crossing strips (Dahlke 2017 §2): 5 cm nadir, 15 cm oblique from fewer, wider pixels."""
    size = 0.5
    factor = (1 / 3) / math.cos(math.radians(36))
    sides = tuple(
        Head(name=s, direction=s, tilt_deg=36, focal_factor=factor, size_factor=size) for s in ("left", "right")
    )
    return FlightParameters(gsd_m=0.05, heads=(Head(), *sides), forward_overlap=0.8, side_overlap=0.8, crossing=True)


PRESETS: dict[str, FlightParameters] = {
    # the obliques' longer lens makes up for their distance: the same GSD in the image centre
    "five_cameras": FlightParameters(gsd_m=0.08, heads=(Head(), *_obliques(45, math.sqrt(2)))),
    "crossing": _crossing(),
    # the longer lens that is customary for 45 degrees: obliques finer than the nadir images in their centre
    "five_heads": FlightParameters(
        gsd_m=0.14, heads=(Head(), *_obliques(45, 1.6)), forward_overlap=0.8, side_overlap=0.5
    ),
    "nadir": FlightParameters(gsd_m=0.08, heads=(Head(),), forward_overlap=0.55, side_overlap=0.2),
}


def preset(name: str, **changes: Any) -> FlightParameters:
    """A preset with some fields changed.

    >>> preset("nadir", gsd_m=0.1).gsd_m
    0.1

    Raises
    ------
    CityflowError
        No preset has this name.
    """
    if name not in PRESETS:
        raise CityflowError(f"no flight is called {name!r}", remedy=f"one of {', '.join(PRESETS)}")
    return FlightParameters.model_validate(merged(PRESETS[name].model_dump(), changes))

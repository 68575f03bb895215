"""Features of places by what changes there in surfaces and pictures: columns of the one table that a roof's shape alone leaves unknown."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.place_evidence import Across, Place, Usual
from cityflow.splitting.borders.station_features import FEATURES, SHAPE
from cityflow.splitting.scores.roof_step import RoofStep
from cityflow.splitting.strips.axis_strips import AxisStrip

LEAST_STEP_M, STEP_SIGMAS = 0.08, 2.0
"""Parts of the depth step that step by more."""
UNREST_SIGMAS = 1.5
SAME_SLOPE = 0.12
"""Roofs whose slopes along the row differ by more are lit differently: their colours cannot be compared."""
BENT_NOISE = 2.5
"""By how much less a change of hue says, which such roofs have too."""
IN_LIGHT = 0.15
"""What is left of a change of colour where the ground beside changes alike."""
ALIKE = 2.0
"""Changes of so many times what is usual are hardly alike."""
CLEAR = 3.0
"""A change of so many times what is usual is 63 % clear."""
STEEP_VALLEY = 0.5
"""Slope that is clear."""
STOREY_M = (2.0, 2.6)
STEP_M, RIDGE_STEP_M = (0.2, 0.8), (0.3, 1.0)
"""Steps that are clear; and by which a ridge across the row is none: two roofs end there."""
SHORT_M = 12.0


def picture_table(places: list[Place], usual: Usual, strip: AxisStrip, free: tuple[bool, bool]) -> FloatArray:
    """(P, F) a row for each place, a column for each of `FEATURES`; NaN where not known.

    Parameters
    ----------
    free : whether the row ends with the strip, at its first and last chord; the length of one that goes on is not known
    """
    rows = []
    for place in places:
        known = dict(zip([f.name for f in SHAPE], place.shape.tolist(), strict=True))
        known |= _of_roof(place, usual) | _of_facades(place, usual) | _of_slices(place)
        known |= {
            "narrower_m": place.narrower_m,
            "smaller_m2": place.smaller_m2,
            "short_m": max(SHORT_M - strip.chain_m, 0.0),
        }
        known["ridge"] *= 1.0 - _ramp(place.near.step.size, RIDGE_STEP_M)
        known |= _of_all(place, usual, known)
        if not all(free):
            known["lengthwise"] = np.nan
        rows.append([known[f.name] for f in FEATURES])
    return np.array(rows, np.float64).reshape(-1, len(FEATURES))


def _of_roof(place: Place, usual: Usual) -> dict[str, float]:
    near, step = place.near, place.near.step
    return {
        "valley_slope": max(min(-step.before, step.after), 0.0), "ridge_slope": max(min(step.before, -step.after), 0.0),
        "saw": _saw(step),
        "roof_far_sigmas": _roof_sigmas(place.far, usual),
        "hue_sigmas": _coloured(near) * near.roof.hue / (BENT_NOISE * usual.roof),
        "turned_step": place.turned * _ramp(step.size, STEP_M),
    }  # fmt: skip


def _facade_sigmas(place: Place, usual: Usual) -> list[float]:
    """Of the façades that are known, the greater first."""
    dim = _dimmed(place.near) / usual.facade
    return sorted((dim * f.counts * f.size for f in place.facades if np.isfinite(f.size)), reverse=True)


def _of_facades(place: Place, usual: Usual) -> dict[str, float]:
    known, dim = [f for f in place.facades if np.isfinite(f.size)], _dimmed(place.near)
    return {
        "other_facade_sigmas": ([*_facade_sigmas(place, usual), np.nan, np.nan])[1],
        "facade_hue_sigmas": max((dim * f.counts * f.hue / usual.facade for f in known), default=np.nan),
        "facade_alike": max((_alike(dim * f.size / usual.facade) for f in known), default=np.nan),
    }  # fmt: skip


def _of_slices(place: Place) -> dict[str, float]:
    """The edge of a shadow is a segment, too, on walls and on roofs."""
    dim = _dimmed(place.near)
    return {
        "upright": dim * max(place.vertical), "other_upright": dim * min(place.vertical), "sloped": dim * place.sloped,
        "pipe": max(place.pipes), "other_pipe": min(place.pipes),
    }  # fmt: skip


def _of_all(place: Place, usual: Usual, known: dict[str, float]) -> dict[str, float]:
    """How far kinds of evidence agree, or speak against each other."""
    steps = _clear(_step_sigmas(place.near, usual))
    shape = max(steps, min(known["valley_slope"] / STEEP_VALLEY, 1.0), _known(known["marked"]))
    colour = max(_clear(_roof_sigmas(place.near, usual)), _clear(known["hue_sigmas"]))
    facade = max((_clear(s) for s in _facade_sigmas(place, usual)), default=0.0)
    return {
        "clearest": max(shape, colour, facade),
        "storey_alike": _ramp(place.near.step.size, STOREY_M) * (1.0 - max(colour, facade)),
    }


def _roof_sigmas(across: Across, usual: Usual) -> float:
    return _level(across) * _coloured(across) * across.roof.size / usual.roof


def _step_sigmas(across: Across, usual: Usual) -> float:
    step = across.step
    if not len(step.groups):
        return float("nan")
    noise = float(np.hypot(usual.height_m, UNREST_SIGMAS * step.unrest))
    return step.size / noise * float((np.abs(step.groups) > max(LEAST_STEP_M, STEP_SIGMAS * noise)).mean()) ** 2


def _saw(step: RoofStep) -> float:
    """Slope of the flatter of two roofs that rise alike along the row, where the step leads back down."""
    if step.before * step.after <= 0 or float(np.median(step.groups)) * step.before >= 0:
        return 0.0
    return min(abs(step.before), abs(step.after))


def _level(across: Across) -> float:
    """How far the colours of both roofs can be compared: 1 where they have one slope along the row."""
    return float(np.exp(-((across.step.bend / SAME_SLOPE) ** 2)))


def _coloured(across: Across) -> float:
    """What a change of colour says; nothing where the darker roof may lie in the shadow of a higher one, whether it steps here or not."""
    return across.roof.alike**2 * min(_dimmed(across), _in_light(across.shaded))


def _dimmed(across: Across) -> float:
    """What steps is no edge of a shadow."""
    return 1.0 if _step_sigmas(across, Usual()) > 1.0 else _in_light(max(float(across.light), across.shaded))


def _in_light(shadow: float) -> float:
    return 1.0 - (1.0 - IN_LIGHT) * shadow


def _alike(sigmas: float) -> float:
    """1 for no change at all; NaN where not known."""
    return float(np.exp(-((sigmas / ALIKE) ** 2)))


def _clear(sigmas: float) -> float:
    return float(1.0 - np.exp(-((sigmas / CLEAR) ** 2))) if np.isfinite(sigmas) else 0.0


def _known(value: float) -> float:
    return value if np.isfinite(value) else 0.0


def _ramp(value: float, between: tuple[float, float]) -> float:
    return float(np.clip((value - between[0]) / (between[1] - between[0]), 0.0, 1.0))

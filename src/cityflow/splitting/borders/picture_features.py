"""Features of places by what changes there in surfaces and pictures: columns of the one table that a roof's shape alone leaves unknown."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.splitting.borders.place_evidence import Across, Place, Usual
from cityflow.splitting.borders.station_features import FEATURES
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
STEEP_VALLEY, SLICED, UPRIGHT = 0.5, (0.35, 0.75), (0.3, 0.8)
"""Slope, share of the depth and share of the height with segments that are clear; of the latter two, below the first they say nothing."""
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
        known = dict(zip([f.name for f in FEATURES], place.shape.tolist(), strict=True))
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
    level = _level(near)
    return {
        "valley_slope": max(min(-step.before, step.after), 0.0), "ridge_slope": max(min(step.before, -step.after), 0.0),
        "saw": _saw(step),
        "roof_sigmas": level * _coloured(near) * near.roof / usual.roof,
        "roof_far_sigmas": _level(place.far) * _coloured(place.far) * place.far.roof / usual.roof,
        "hue_sigmas": _coloured(near) * near.hue / (BENT_NOISE * usual.roof),
        "roof_alike": _alike(_dimmed(near) * near.roof / usual.roof) if level > 0.5 else np.nan,
        "turned_step": place.turned * _ramp(step.size, STEP_M),
    }  # fmt: skip


def _of_facades(place: Place, usual: Usual) -> dict[str, float]:
    known = [(size, counts) for size, counts in place.near.facades if np.isfinite(size)]
    dim = _dimmed(place.near)
    clear = sorted((dim * counts * size / usual.facade for size, counts in known), reverse=True)
    return {
        "facade_sigmas": clear[0] if clear else np.nan, "other_facade_sigmas": clear[1] if len(clear) > 1 else np.nan,
        "facade_change": max((dim * counts * size for size, counts in known), default=np.nan),
        "facade_alike": max((_alike(dim * size / usual.facade) for size, _ in known), default=np.nan),
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
    colour = max(_clear(known["roof_sigmas"]), _clear(known["hue_sigmas"]))
    facades = _clear(known["facade_sigmas"]), _clear(known["other_facade_sigmas"])
    segments = 0.5 * (_ramp(known["sloped"], SLICED) + _ramp(known["upright"], UPRIGHT) + _clear(max(place.pipes)))
    return {
        "clearest": max(shape, colour, *facades),
        "second": sorted((shape, colour, *facades, min(segments, 1.0)))[-2],
        "storey_alike": _ramp(place.near.step.size, STOREY_M) * (1.0 - max(colour, facades[0])),
    }


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
    return across.alike**2 * _dimmed(across)


def _dimmed(across: Across) -> float:
    """What steps is no edge of a shadow."""
    return IN_LIGHT if across.light and not _step_sigmas(across, Usual()) > 1.0 else 1.0


def _alike(sigmas: float) -> float:
    """1 for no change at all; NaN where not known."""
    return float(np.exp(-((sigmas / ALIKE) ** 2)))


def _clear(sigmas: float) -> float:
    return float(1.0 - np.exp(-((sigmas / CLEAR) ** 2))) if np.isfinite(sigmas) else 0.0


def _known(value: float) -> float:
    return value if np.isfinite(value) else 0.0


def _ramp(value: float, between: tuple[float, float]) -> float:
    return float(np.clip((value - between[0]) / (between[1] - between[0]), 0.0, 1.0))

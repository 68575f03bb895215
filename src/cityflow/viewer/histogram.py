"""Histograms as plain geometry: bars, ticks and the median in the units of an SVG drawing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cityflow.viewer.unit_figures import quantile

WIDTH, HEIGHT = 360, 190
LEFT, RIGHT, TOP, BOTTOM = 46, 10, 24, 34
MOST_BARS = 24


@dataclass(frozen=True, slots=True)
class Bar:
    """One bar: position and size in the drawing, and what it says."""

    x: float
    y: float
    width: float
    height: float
    label: str


@dataclass(frozen=True, slots=True)
class Histogram:
    """A histogram ready to be drawn.

    Attributes
    ----------
    title, axis : what is shown, name of the horizontal axis with its unit
    bars : those that are not empty
    ticks : (x, text) along the horizontal axis;  levels : (y, text) of the horizontal lines
    median : (x, text), or None without values
    counted : what the heights of the bars count
    """

    title: str
    axis: str
    bars: tuple[Bar, ...]
    ticks: tuple[tuple[float, str], ...]
    levels: tuple[tuple[float, str], ...]
    median: tuple[float, str] | None
    counted: str = ""


def histogram(
    title: str, axis: str, values: Sequence[float], *, counted: str = "", unit: str = "", whole: bool = False
) -> Histogram:
    """Bars of equal width up to about the 98th percentile; what lies beyond is gathered in the last one.

    Parameters
    ----------
    values : finite, in the unit that `axis` names;  counted : what they are of;  unit : written after the median
    whole : values are whole numbers, one bar each where they are few
    """
    if not values:
        return Histogram(title, axis, (), (), (), None, counted)
    width = _bar_width(values, whole)
    first = math.floor(min(0.0, *values) / width) if not whole else int(min(values))
    count = max(min(math.ceil((quantile(values, 0.98) or 0) / width + 1e-9) - first + whole, MOST_BARS), 1)
    places = np.floor(np.asarray(values) / width + 1e-9).astype(int) - first
    sizes = np.bincount(np.clip(places, 0, count), minlength=count + 1)
    total = count + int(sizes[count] > 0)
    step = (WIDTH - LEFT - RIGHT) / total
    top = _nice(float(sizes.max()), 4)
    texts = [_range_text((first + i) * width, width, whole) for i in range(count)]
    texts.append(f"{(first + count) * width:g} or more")
    bars = [_bar(i, int(n), step, top, texts[i]) for i, n in enumerate(sizes) if n]
    middle = quantile(values, 0.5) or 0.0
    at = LEFT + min(max(middle / width - first + (0.5 if whole else 0), 0), total) * step
    return Histogram(
        title,
        axis,
        tuple(bars),
        _ticks(first, width, count, step, whole),
        _levels(top),
        (at, f"{middle:.3g} {unit}".strip()),
        counted,
    )


def _bar_width(values: Sequence[float], whole: bool) -> float:
    spread = max((quantile(values, 0.98) or 0) - min(0.0, *values), 1e-9)
    if whole:
        return float(max(1, math.ceil((max(quantile(values, 0.98) or 1, 1)) / MOST_BARS)))
    return _nice(spread / 16, 1)


def _nice(value: float, steps: int) -> float:
    """The smallest of 1, 2, 2.5, 5 times a power of ten, times `steps`, that is not below a value."""
    each = max(value / steps, 1e-9)
    power = 10.0 ** math.floor(math.log10(each))
    factor = next(f for f in (1, 2, 2.5, 5, 10) if f * power >= each * (1 - 1e-9))
    if steps > 1:
        return max(math.ceil(factor * power), 1) * steps
    return factor * power


def _bar(i: int, count: int, step: float, top: float, text: str) -> Bar:
    height = max((HEIGHT - TOP - BOTTOM) * count / top, 1.0)
    return Bar(LEFT + i * step + 1, HEIGHT - BOTTOM - height, max(step - 2, 1), height, f"{text}: {count}")


def _range_text(low: float, width: float, whole: bool) -> str:
    if whole and width == 1:
        return f"{low:g}"
    return f"{low:.4g} to {low + width - (1 if whole else 0):.4g}"


def _ticks(first: int, width: float, count: int, step: float, whole: bool) -> tuple[tuple[float, str], ...]:
    every = max(1, math.ceil(count / 6))
    shift = 0.5 if whole and width == 1 else 0.0
    return tuple((LEFT + (i + shift) * step, f"{(first + i) * width:.4g}") for i in range(0, count, every))


def _levels(top: float) -> tuple[tuple[float, str], ...]:
    inner = HEIGHT - TOP - BOTTOM
    return tuple((HEIGHT - BOTTOM - inner * k / 4, f"{top * k / 4:g}") for k in range(5))

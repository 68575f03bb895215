"""Which products of a flight will suffer, and where: what its coverage maps mean for surface, orthos, façades and textures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field
from scipy.ndimage import label

from cityflow.core.arrays import BoolArray
from cityflow.core.grid import Bounds
from cityflow.core.parameters import Parameters
from cityflow.orientation.coverage import Coverage, wall_name
from cityflow.orientation.image_overlap import Overlap
from cityflow.orientation.look_directions import COMPASS

SAFE_VIEWS = 3
"""Two images give a height, the third one checks it."""


class ShortfallParameters(Parameters):
    """When a map is worth a word."""

    least_share: float = Field(0.02, ge=0, le=1, description="share of the area below which nothing is said")
    least_angle_deg: float = Field(6.0, gt=0, le=90, description="smaller largest angles give poor heights, degrees")
    coarse_ratio: float = Field(2.0, gt=1, description="pixels this many times coarser than the median are named")
    places: int = Field(3, ge=1, le=20, description="largest places that are named")


@dataclass(frozen=True, slots=True)
class Shortfall:
    """One thing that will be worse than it could be.

    Attributes
    ----------
    sentence : what, how much, why
    area_m2 : of the ground concerned
    places : boxes of the largest connected parts, largest first
    """

    sentence: str
    area_m2: float
    places: tuple[Bounds, ...]


def shortfalls(
    maps: Coverage, within: BoolArray, parameters: ShortfallParameters, overlap: Sequence[Overlap] = ()
) -> tuple[Shortfall, ...]:
    """What will suffer, the largest area first; overlaps and lone images last.

    Parameters
    ----------
    maps : what the flight sees
    within : (rows, cols) cells that matter, e.g. the area of interest, or where anything is seen at all
    """
    found = []
    for sentence, cells in _kinds(maps, parameters):
        chosen = cells & within
        area = float(chosen.sum()) * maps.grid.cell**2
        if chosen.sum() > parameters.least_share * within.sum():
            text = f"{_hectares(area)}{_whereabouts(chosen, within)} {sentence}"
            found.append(Shortfall(text, area, _places(chosen, maps, parameters.places)))
    found.sort(key=lambda s: -s.area_m2)
    return (*found, *_of_overlaps(overlap), *_of_images(maps))


def _kinds(maps: Coverage, p: ShortfallParameters) -> Iterator[tuple[str, BoolArray]]:
    several = maps.views >= 2
    yield "are seen by no image: no surface, no ortho", maps.views == 0
    yield "are seen by one image only: an ortho on interpolated heights, no points", maps.views == 1
    yield (
        f"are seen by fewer than {SAFE_VIEWS} images: heights unchecked, holes behind houses",
        several & (maps.views < SAFE_VIEWS),
    )
    yield (
        f"are seen only at intersection angles below {p.least_angle_deg:g}°: inaccurate heights",
        several & (maps.angle_deg < p.least_angle_deg),
    )
    middle = float(np.nanmedian(maps.gsd)) if np.isfinite(maps.gsd).any() else np.nan
    coarse = p.coarse_ratio * middle
    yield f"are seen with pixels coarser than {coarse:.2g} m (median {middle:.2g} m): blurred orthos", maps.gsd > coarse
    for k, seen in enumerate(maps.walls):
        yield (
            f"have {wall_name(k)} walls that fewer than two images see: no points on them, blurred textures",
            several & (seen < 2),
        )


def _of_overlaps(overlap: Sequence[Overlap]) -> Iterator[Shortfall]:
    for one in overlap:
        forward = float(np.median(one.forward))
        if forward < 0.6:
            advice = "many points are seen by one image of the strip only, and holes stay behind houses"
            yield Shortfall(f"the forward overlap of {one.direction} is {forward:.0%} in the median: {advice}", 0.0, ())


def _of_images(maps: Coverage) -> Iterator[Shortfall]:
    if maps.alone:
        some = ", ".join(maps.alone[:5]) + (" …" if len(maps.alone) > 5 else "")
        yield Shortfall(f"{len(maps.alone)} images meet no other and are of no use for heights: {some}", 0.0, ())


def _whereabouts(chosen: BoolArray, within: BoolArray) -> str:
    """In which part of the area that matters most of the chosen cells lie; empty if all over it."""
    rows, cols = np.nonzero(within)
    row, col = (a.mean() for a in np.nonzero(chosen))
    north, east = (rows.mean() - row) / max(np.ptp(rows), 1), (col - cols.mean()) / max(np.ptp(cols), 1)
    if np.hypot(north, east) < 0.1:
        return ""
    octant = round(float(np.degrees(np.arctan2(east, north))) / 45.0) % 8
    return f", mostly in the {COMPASS[octant]},"


def _places(cells: BoolArray, maps: Coverage, most: int) -> tuple[Bounds, ...]:
    """Boxes of the largest connected parts."""
    number, count = label(cells)
    sizes = np.bincount(number.ravel(), minlength=count + 1)[1:]
    boxes = []
    for k in np.argsort(-sizes, kind="stable")[:most]:
        rows, cols = np.nonzero(number == k + 1)
        x, y = maps.grid.x_min, maps.grid.y_max
        cell = maps.grid.cell
        boxes.append(
            (x + cols.min() * cell, y - (rows.max() + 1) * cell, x + (cols.max() + 1) * cell, y - rows.min() * cell)
        )
    return tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in boxes)


def _hectares(area_m2: float) -> str:
    return f"{area_m2 / 1e4:,.1f} ha" if area_m2 >= 1000 else f"{area_m2:,.0f} m²"

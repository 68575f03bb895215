"""Patches on pages: pixels, the source image of each, and the new corners of the faces."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import FloatArray
from cityflow.core.texture import FIRST_IMAGE, Patch
from cityflow.texture.placement.place import Placement, Spot


@dataclass(frozen=True, slots=True, eq=False)
class Page:
    """A page of an atlas.

    Attributes
    ----------
    pixels : (rows, cols, 3) uint8
    index : (rows, cols) uint16, as in `Patch`
    owner : (rows, cols) uint32, 1 + the number of the patch that a pixel belongs to, 0 where none is
    """

    pixels: NDArray[np.uint8]
    index: NDArray[np.uint16]
    owner: NDArray[np.uint32]


def pages_of(patches: Sequence[Patch], placement: Placement) -> Iterator[Page]:
    """The pages with their patches on them, one after the other; nothing is resampled, what no patch covers is black."""
    for number, shape in enumerate(placement.pages):
        page = Page(np.zeros((*shape, 3), np.uint8), np.zeros(shape, np.uint16), np.zeros(shape, np.uint32))
        for owner, (patch, spot) in enumerate(zip(patches, placement.spots, strict=True), start=1):
            if spot.page == number:
                _lay(page, patch, spot, owner)
        yield page


def _lay(page: Page, patch: Patch, spot: Spot, owner: int) -> None:
    mask = np.rot90(patch.mask, spot.quarter_turns)
    place = np.s_[spot.row : spot.row + mask.shape[0], spot.col : spot.col + mask.shape[1]]
    page.pixels[place][mask] = np.rot90(patch.pixels, spot.quarter_turns)[mask]
    page.index[place][mask] = np.rot90(patch.index, spot.quarter_turns)[mask]
    page.owner[place][mask] = owner


def trimmed(page: Page) -> Page:
    """Without the empty rows and columns at its lower and right edges; a page is at least one pixel."""
    rows, cols = np.flatnonzero(page.owner.any(axis=1)), np.flatnonzero(page.owner.any(axis=0))
    place = np.s_[: int(rows[-1]) + 1 if len(rows) else 1, : int(cols[-1]) + 1 if len(cols) else 1]
    return Page(page.pixels[place], page.index[place], page.owner[place])


def corners_on_page(corners: FloatArray, shape: tuple[int, int], spot: Spot) -> FloatArray:
    """(n, 3) column, row, d in a patch of `shape` → the same on the page."""
    rows, cols = shape
    x, y = corners[:, 0], corners[:, 1]
    turned = ((x, y), (y, cols - x), (cols - x, rows - y), (rows - y, x))[spot.quarter_turns % 4]
    return np.column_stack([turned[0] + spot.col, turned[1] + spot.row, corners[:, 2]])


def uvd(corners: FloatArray, page: tuple[int, int]) -> FloatArray:
    """(n, 3) column, row, d on a page of (rows, cols) → u, v from the lower left corner, 0 to 1, and d."""
    rows, cols = page
    return np.column_stack([corners[:, 0] / cols, 1.0 - corners[:, 1] / rows, corners[:, 2]])


def merged_names(names: Iterable[Sequence[str]]) -> tuple[str, ...]:
    """All image names of several units, each once, sorted."""
    return tuple(sorted({n for some in names for n in some}))


def renumbered(index: NDArray[np.uint16], old: Sequence[str], new: Mapping[str, int]) -> NDArray[np.uint16]:
    """An index raster that counts the images `old`, counting them as `new` says (name → number)."""
    table = np.arange(FIRST_IMAGE + len(old), dtype=np.uint16)
    table[FIRST_IMAGE:] = [FIRST_IMAGE + new[n] for n in old]
    return np.asarray(table[index])

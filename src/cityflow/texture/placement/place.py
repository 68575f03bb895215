"""Pixel sets are placed on the pages of a texture atlas (Frommholz et al. 2017, section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from pydantic import Field, model_validator

from cityflow.core.arrays import BoolArray, IntArray
from cityflow.core.parameters import Parameters
from cityflow.errors import CityflowError
from cityflow.texture.placement.layout import COL, ROW, TURN, Bounds, filled
from cityflow.texture.placement.pixel_runs import TURNS, Patches, patches_of


class PatchTooLarge(CityflowError):
    """A patch is longer than a page; it must be scaled down before it is placed."""


class PatchEmpty(CityflowError):
    """A patch has no pixel."""


class PlacementParameters(Parameters):
    """How large pages are, and how hard a compact arrangement is sought."""

    page_px: int = Field(8192, ge=256, le=16384, description="longest edge of a page, pixels; a power of two")
    first_px: int = Field(256, ge=1, le=16384, description="shortest edge of a page, pixels; a power of two")

    @model_validator(mode="after")
    def _powers_of_two(self) -> Self:
        for name in ("page_px", "first_px"):
            edge = getattr(self, name)
            if edge & (edge - 1):
                raise ValueError(f"{name} is {edge}, which is no power of two")
        if self.first_px > self.page_px:
            raise ValueError(f"first_px {self.first_px} is beyond page_px {self.page_px}")
        return self


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a patch stands.

    Attributes
    ----------
    page : number of the page
    row, col : pixels, upper left corner of the turned mask
    quarter_turns : counter-clockwise, as ``numpy.rot90(mask, quarter_turns)``; 0 … 3
    """

    page: int
    row: int
    col: int
    quarter_turns: int


@dataclass(frozen=True, slots=True)
class Placement:
    """All patches on their pages.

    Attributes
    ----------
    spots : one for each mask, in their order
    pages : (height, width) of each page, pixels, powers of two
    """

    spots: tuple[Spot, ...]
    pages: tuple[tuple[int, int], ...]


def place(masks: Sequence[BoolArray], parameters: PlacementParameters | None = None, *, threads: int = 1) -> Placement:
    """Place pixel sets so that none overlap, turned by quarters only, on as few and small pages as are found.

    Parameters
    ----------
    masks : boolean (rows, cols) each, padding included; a pixel that is False may be another patch's. Empty outer rows and columns are
        allowed, but stay within the page like the rest.
    threads : of this process that share the search; the result is the same for any number.

    Raises
    ------
    PatchTooLarge
        Where an edge of a mask is longer than a page.
    PatchEmpty
        Where a mask has no pixel.
    """
    parameters = parameters or PlacementParameters()
    _refuse_what_cannot_be_placed(masks, parameters)
    patches = patches_of(masks)
    spots: list[Spot | None] = [None] * len(patches)
    pages: list[tuple[int, int]] = []
    left = np.arange(len(patches))
    while len(left):
        found = _page(patches, left, parameters)
        there = left[found[left, TURN] >= 0]
        for patch in there.tolist():
            row, col, turn = found[patch].tolist()
            spots[patch] = Spot(len(pages), row, col, turn)
        pages.append(_page_shape(patches, there, found, parameters))
        left = left[found[left, TURN] < 0]
    return Placement(tuple(s for s in spots if s is not None), tuple(pages))


def _refuse_what_cannot_be_placed(masks: Sequence[BoolArray], parameters: PlacementParameters) -> None:
    for number, mask in enumerate(masks):
        if mask.ndim != 2 or not mask.any():
            raise PatchEmpty("a pixel set without a pixel", where=f"patch {number}", remedy="leave it out")
        if max(mask.shape) > parameters.page_px:
            raise PatchTooLarge(
                f"{mask.shape[0]} × {mask.shape[1]} pixels on a page of {parameters.page_px}",
                where=f"patch {number}",
                remedy="scale it down before it is placed, or allow larger pages (page_px)",
            )


def _page(patches: Patches, left: IntArray, parameters: PlacementParameters) -> IntArray:
    rows, cols = patches.shapes[::TURNS, 0], patches.shapes[::TURNS, 1]
    weight = patches.pixels[left] * np.maximum(rows, cols)[left]
    order = left[np.argsort(-weight, kind="stable")]
    needed = max(np.sqrt(patches.pixels[left].sum() / 0.9), np.minimum(rows, cols)[left].max(), parameters.first_px)
    width = min(_power_of_two(int(np.ceil(needed))), parameters.page_px)
    return filled(patches, order, Bounds(width, min(2 * width, parameters.page_px), parameters.page_px))


def _page_shape(patches: Patches, there: IntArray, found: IntArray, parameters: PlacementParameters) -> tuple[int, int]:
    ends = found[there, ROW : COL + 1] + patches.shapes[TURNS * there + found[there, TURN]]
    height, width = ends.max(axis=0).tolist()
    return max(_power_of_two(height), parameters.first_px), max(_power_of_two(width), parameters.first_px)


def _power_of_two(edge: int) -> int:
    """The smallest that is not below `edge`."""
    return 1 << max(edge - 1, 0).bit_length()

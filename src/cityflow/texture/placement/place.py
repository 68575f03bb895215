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
from cityflow.texture.placement.layout import COL, NOWHERE, ROW, TURN, filled
from cityflow.texture.placement.pixel_runs import TURNS, Patches, patches_of
from cityflow.texture.placement.trials import Edges, Trial, power_of_two, trials


class PatchTooLarge(CityflowError):
    """A patch is longer than a page; it must be scaled down before it is placed."""


class PatchEmpty(CityflowError):
    """A patch has no pixel."""


class PlacementParameters(Parameters):
    """How large pages are, and how hard a compact arrangement is sought."""

    page_px: int = Field(8192, ge=256, le=16384, description="longest edge of a page, pixels; a power of two")
    first_px: int = Field(256, ge=1, le=16384, description="shortest edge of a page, pixels; a power of two")
    effort: float = Field(
        6e9,
        ge=0.0,
        description="bound of the work, in patches times pixels: it limits the compared orders and widths of a page, 24 at most",
    )

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


def place(masks: Sequence[BoolArray], parameters: PlacementParameters | None = None) -> Placement:
    """Place pixel sets so that none overlap, turned by quarters only, on as few and small pages as are found.

    Parameters
    ----------
    masks : boolean (rows, cols) each, padding included; a pixel that is False may be another patch's. Empty outer rows and columns are
        allowed, but stay within the page like the rest.

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
    edges = Edges(parameters.first_px, parameters.page_px)
    spots: list[Spot | None] = [None] * len(patches.pixels)
    pages: list[tuple[int, int]] = []
    left = np.arange(len(patches.pixels))
    while len(left):
        found = _best_page(patches, trials(patches, left, edges, parameters.effort), edges)
        there = left[found[left, TURN] != NOWHERE]
        for patch in there.tolist():
            row, col, turn = found[patch].tolist()
            spots[patch] = Spot(len(pages), row, col, turn)
        height, width = _extent(patches, found)
        pages.append((_edge(height, edges), _edge(width, edges)))
        left = left[found[left, TURN] == NOWHERE]
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


def _best_page(patches: Patches, tried: Sequence[Trial], edges: Edges) -> IntArray:
    """The layout that leaves out least, then that of the smallest page, then the one within the smallest rectangle."""
    return min((filled(patches, *trial) for trial in tried), key=lambda spots: _cost(patches, spots, edges))


def _cost(patches: Patches, spots: IntArray, edges: Edges) -> tuple[int, int, int]:
    height, width = _extent(patches, spots)
    out = int(patches.pixels[spots[:, TURN] == NOWHERE].sum())
    return out, _edge(height, edges) * _edge(width, edges), height * width


def _extent(patches: Patches, spots: IntArray) -> tuple[int, int]:
    """Rows and columns that the placed patches take from the page's corner."""
    there = np.flatnonzero(spots[:, TURN] != NOWHERE)
    ends = spots[there, ROW : COL + 1] + patches.shapes[TURNS * there + spots[there, TURN]]
    height, width = ends.max(axis=0).tolist()
    return height, width


def _edge(length: int, edges: Edges) -> int:
    return max(power_of_two(length), edges.shortest)

"""Figures of the textures of a run: textured shares of roofs and façades, resolution, missing textures."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PlainFaces:
    """Faces without a texture for one reason: how many, and their area (m²)."""

    reason: str
    count: int
    area_m2: float


@dataclass(frozen=True, slots=True)
class SurfaceShare:
    """Faces of one kind (`roofs`, `façades`, `undersides`): their area (m²), and the share of it that has a texture."""

    kind: str
    area_m2: float
    textured: float


@dataclass(frozen=True, slots=True)
class MovedPhotograph:
    """A photograph that shows edges of models beside where its pose has them: at how many buildings, and the mean there, pixels to the right and down."""

    name: str
    buildings: int
    right_px: float
    down_px: float


@dataclass(frozen=True, slots=True)
class TextureFigures:
    """Textures of a run, areas weighted by m².

    Attributes
    ----------
    buildings : with at least one textured face;  asked : whose textures have been asked for so far
    faces : textured ones
    shares : by kind of surface
    gsd_m : median ground sampling distance over the textured area, metres; None where nothing is textured
    interpolated : share of the textured area that no image sees, filled from around
    images : photographs that are in them;  pages : atlas pages of one set
    plain : faces without, by reason, the largest area first
    moved : photographs that were moved to the edges of models, those at most buildings first;  moved_images : how many there are
    read, squares : of how many squares of the atlas shares, areas, images and reasons were read, and how many there are
    """

    buildings: int
    asked: int
    faces: int
    shares: tuple[SurfaceShare, ...]
    gsd_m: float | None
    interpolated: float | None
    images: int
    pages: int
    plain: tuple[PlainFaces, ...]
    read: int = 1
    squares: int = 1
    moved: tuple[MovedPhotograph, ...] = ()
    moved_images: int = 0

"""Appearance of buildings and terrain in one exported file: locations of images, textures of faces."""

from __future__ import annotations

import math
import posixpath
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from cityflow.core.building import Building, Scalar
from cityflow.core.texture import (
    BuildingTexture,
    Colour,
    Drape,
    FaceFigures,
    FaceKey,
    FaceTexture,
    PlainFace,
    Shell,
    TexturePage,
    TextureSet,
)  # fmt: skip
from cityflow.io.attributes import xml_text

THEME = "photographs"
"""Name of the theme in the formats that have themes; its textures and its plain colours belong together."""

TEXTURE_DECIMALS = 7
"""Of texture coordinates: a thousandth of a pixel on a page of 8,192."""

Look = FaceTexture | PlainFace
"""How a face looks if not as it always did."""

Looks = Mapping[int, Look]
"""Looks of the faces of a shell by their number, rising."""

_NOTHING = BuildingTexture({})


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """Textures for one file, or for several in one folder.

    Attributes
    ----------
    folder : of the file, relative to RUN; images are named relative to it
    textures : of its buildings
    drape : ortho on its terrain
    """

    folder: str
    textures: TextureSet | None = None
    drape: Drape | None = None

    def image(self, page: TexturePage) -> str:
        """The page's file as the exported file names it.

        >>> Appearance("products/obj").image(TexturePage("products/textures/a.png", 8, 8, "image/png"))
        '../textures/a.png'
        """
        return posixpath.relpath(page.path, self.folder)

    def pages(self) -> tuple[TexturePage, ...]:
        return () if self.textures is None else self.textures.pages

    def of(self, building: Building) -> BuildingTexture:
        """What is known of a building; nothing where it has no textures."""
        return _NOTHING if self.textures is None else self.textures.buildings.get(building.id, _NOTHING)

    def require_rectified(self, form: str) -> None:
        """Raise ValueError if the textures need a division that readers of `form` do not do."""
        if self.textures is not None and not self.textures.rectified:
            raise ValueError(f"{form} has two texture coordinates per corner: it needs the rectified textures")


BARE = Appearance("")
"""No textures at all."""


def looks_of(texture: BuildingTexture, shell: Shell) -> Looks:
    """How the faces of a shell look, in their order; those that look as they always did are left out."""
    known: dict[FaceKey, Look] = {**texture.plain, **texture.faces}
    numbers = sorted(number for of_shell, number in known if of_shell == shell)
    return {number: known[shell, number] for number in numbers}


def attributes_of_look(look: Look) -> dict[str, Scalar]:
    """Attributes of a face: how well its texture is founded, or why it has none; nothing if none is needed."""
    if isinstance(look, FaceTexture):
        return figure_attributes(look.figures)
    return {"texture_missing": xml_text(look.reason)} if look.reason else {}


def figure_attributes(figures: FaceFigures) -> dict[str, Scalar]:
    """The figures of a texture as attributes of its face; those that are not numbers are left out."""
    attributes = {
        "texture_gsd_m": round(float(figures.gsd_m), 4),
        "texture_incidence_deg": round(float(figures.incidence_deg), 2),
        "texture_candidates": int(figures.candidates),
        "texture_images": int(figures.images),
        "texture_occluded": round(float(figures.occluded), 4),
        "texture_interpolated": round(float(figures.interpolated), 4),
    }
    return {name: value for name, value in attributes.items() if math.isfinite(value)}


def unit_colour(colour: Colour) -> tuple[float, float, float]:
    """Red, green, blue as shares of one, to four decimals."""
    red, green, blue = (round(part / 255, 4) for part in colour)
    return red, green, blue


def coordinates_of(looks: Iterable[Look], closed: bool = False) -> Iterator[list[list[float]]]:
    """Rings of all textured faces in their order: u, v, d of each corner, rounded.

    Parameters
    ----------
    closed : whether every ring ends with its first corner again
    """
    rings = [ring for look in looks if isinstance(look, FaceTexture) for ring in look.rings]
    if not rings:
        return
    # all rings of a building at once: numpy costs as much for four numbers as for four hundred
    rows = (np.concatenate(rings).round(TEXTURE_DECIMALS) + 0.0).tolist()
    start = 0
    for ring in rings:
        corners = rows[start : start + len(ring)]
        start += len(ring)
        yield [*corners, corners[0]] if closed else corners

"""Textures and materials in CityJSON: members of geometries, and the appearance of a feature or of a whole file."""

from __future__ import annotations

import json
import posixpath
from collections.abc import Callable, Sequence, Sized
from typing import Any

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building
from cityflow.core.texture import Colour, Drape, FaceTexture, PlainFace, Shell, TexturePage
from cityflow.io.city_models.appearance import (
    TEXTURE_DECIMALS,
    THEME,
    Appearance,
    Looks,
    coordinates_of,
    looks_of,
    unit_colour,
)

Json = Any
IMAGE_TYPES = {"image/png": "PNG", "image/jpeg": "JPG"}
_DEFAULTS = {"textures": "default-theme-texture", "materials": "default-theme-material"}


class FeatureAppearance:
    """The appearance of one feature, which grows with every geometry that is asked for its members."""

    def __init__(self, appearance: Appearance, building: Building) -> None:
        appearance.require_rectified("CityJSON")
        self._appearance, self._texture = appearance, appearance.of(building)
        self._pages: dict[int, int] = {}
        self._colours: dict[Colour, int] = {}
        self._uv: dict[tuple[float, ...], int] = {}

    def of(self, shell: Shell) -> Looks:
        """How the faces of a shell look."""
        return looks_of(self._texture, shell)

    @property
    def pages(self) -> Sequence[TexturePage]:
        """That textures of faces refer to."""
        return self._appearance.pages()

    def members(self, faces: Sequence[Sized], looks: Looks, in_shell: bool = False) -> dict[str, Json]:
        """``texture`` and ``material`` of a geometry, each only where a face has one.

        Parameters
        ----------
        faces : the rings of each
        in_shell : whether the faces are the only shell of a Solid, whose arrays are one level deeper
        """
        textures, materials = self._textures(faces, looks), self._materials(faces, looks)
        found = {"texture": textures, "material": materials}
        return {name: {THEME: {"values": [values] if in_shell else values}} for name, values in found.items() if values}

    @property
    def json(self) -> dict[str, Json]:
        """The member ``appearance``; empty where nothing has been asked for."""
        pages = self._appearance.pages()
        found: dict[str, Json] = {}
        if self._pages:
            found["textures"] = [texture_json(self._appearance, pages[page]) for page in self._pages]
            found["vertices-texture"] = [list(uv) for uv in self._uv]
        if self._colours:
            found["materials"] = [_material(colour) for colour in self._colours]
        return found | {default: THEME for kind, default in _DEFAULTS.items() if kind in found}

    def _textures(self, faces: Sequence[Sized], looks: Looks) -> list[Json]:
        """For each face and ring the texture and its coordinates; null in rings without."""
        rings = coordinates_of(looks.values())
        values: list[Json] = [[[None] for _ in range(len(face))] for face in faces]
        textured = {i: look for i, look in looks.items() if isinstance(look, FaceTexture)}
        for i, look in textured.items():
            page = self._pages.setdefault(look.page, len(self._pages))
            values[i] = [[page, *self._add(next(rings))] for _ in look.rings]
        return values if textured else []

    def _add(self, ring: list[list[float]]) -> list[int]:
        # equal ones once: walls with openings have those of the walls without, holes those of what fills them
        return [self._uv.setdefault((u, v), len(self._uv)) for u, v, _ in ring]

    def _materials(self, faces: Sequence[Sized], looks: Looks) -> list[Json]:
        plain = {i: look.colour for i, look in looks.items() if isinstance(look, PlainFace)}
        numbers = {i: self._colours.setdefault(colour, len(self._colours)) for i, colour in plain.items()}
        return [numbers.get(i) for i in range(len(faces))] if plain else []


def draped(
    appearance: Appearance, drape: Drape, vertices: FloatArray, triangles: IntArray
) -> tuple[dict[str, Json], dict[str, Json]]:
    """Member ``texture`` of a terrain's surface, and the appearance of its feature: a texture vertex for every vertex."""
    values = [[[0, a, b, c]] for a, b, c in triangles.tolist()]
    uv = drape.uv(vertices).round(TEXTURE_DECIMALS).tolist()
    textures = [texture_json(appearance, drape.page)]
    return {"texture": {THEME: {"values": values}}}, {
        "textures": textures,
        "vertices-texture": uv,
        _DEFAULTS["textures"]: THEME,
    }


def texture_json(appearance: Appearance, page: TexturePage) -> dict[str, str]:
    """A texture object of CityJSON."""
    return {
        "type": IMAGE_TYPES[page.media_type],
        "image": appearance.image(page),
        "wrapMode": "clamp",
        "textureType": "specific",
    }


def _material(colour: Colour) -> dict[str, Json]:
    return {"name": "plain " + "".join(f"{part:02x}" for part in colour), "diffuseColor": list(unit_colour(colour))}


def relocated(line: bytes, source: str, target: str) -> Json:
    """The feature of a line of a file in the folder `source`, its images named as from the folder `target`."""
    feature = json.loads(line)
    for texture in feature.get("appearance", {}).get("textures", []):
        texture["image"] = posixpath.relpath(posixpath.join(source, texture["image"]), target)
    return feature


class Gathered:
    """One appearance for a whole file from those of its features: each image and each colour is there once."""

    def __init__(self) -> None:
        self._textures: dict[str, tuple[int, Json]] = {}
        self._materials: dict[str, tuple[int, Json]] = {}
        self._uv: list[list[float]] = []

    def take(self, feature: Json) -> None:
        """Take the appearance of a feature, and number its geometries' textures and materials anew, in place."""
        appearance = feature.get("appearance", {})
        textures = _numbered(self._textures, appearance.get("textures", []), "image")
        materials = _numbered(self._materials, appearance.get("materials", []), "name")
        start = len(self._uv)
        self._uv += appearance.get("vertices-texture", [])
        for geometry in (g for o in feature["CityObjects"].values() for g in o["geometry"]):
            for theme in geometry.get("texture", {}).values():
                theme["values"] = _each_list(theme["values"], lambda ring: _ring(ring, textures, start))
            for theme in geometry.get("material", {}).values():
                theme["values"] = _each_list(
                    theme["values"], lambda row: [None if m is None else materials[m] for m in row]
                )

    @property
    def json(self) -> dict[str, Json]:
        """The member ``appearance``; empty where no feature had one."""
        found: dict[str, Json] = {}
        if self._textures:
            found["textures"] = [texture for _, texture in self._textures.values()]
            found["vertices-texture"] = self._uv
        if self._materials:
            found["materials"] = [material for _, material in self._materials.values()]
        return found | {default: THEME for kind, default in _DEFAULTS.items() if kind in found}


def _numbered(known: dict[str, tuple[int, Json]], items: Sequence[Json], key: str) -> list[int]:
    return [known.setdefault(item[key], (len(known), item))[0] for item in items]


def _ring(ring: Json, textures: Sequence[int], start: int) -> Json:
    return ring if ring[0] is None else [textures[ring[0]], *(corner + start for corner in ring[1:])]


def _each_list(nested: Json, of: Callable[[Json], Json]) -> Json:
    """Nested lists whose innermost lists are replaced."""
    return [_each_list(part, of) for part in nested] if isinstance(nested[0], list) else of(nested)

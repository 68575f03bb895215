"""Materials of a glTF file: one per page of an atlas, one for all faces without a texture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from cityflow.core.arrays import FloatArray
from cityflow.core.texture import TexturePage
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.gltf_buffer import GltfBuffer

Json = Any
UNLIT = "KHR_materials_unlit"
LINEAR, LINEAR_MIPMAPS, CLAMP = 9729, 9987, 33071
_MATT = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
_LARGEST = 65535


@dataclass(slots=True)
class Materials:
    """The materials of one document as they are asked for.

    Attributes
    ----------
    appearance : where pages stand
    buffer : for pages that are embedded
    pictures : contents of pages by their path; those that are here are embedded, all others are files beside
    """

    appearance: Appearance
    buffer: GltfBuffer
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    materials: list[Json] = field(default_factory=list)
    images: list[Json] = field(default_factory=list)

    def plain(self, name: str, colour: FloatArray | None = None) -> int:
        """Index of a matt material, white where vertices have colours of their own.

        Beside photographs it is as unlit as they are: a viewer's sun would make its shaded walls black among theirs.
        """
        tint = {} if colour is None else {"baseColorFactor": [*map(float, colour), 1.0]}
        is_lit = self.appearance.textures is None
        unlit: dict[str, Json] = {} if is_lit else {"extensions": {UNLIT: {}}}
        self.materials.append({"name": name, "pbrMetallicRoughness": {**tint, **_MATT}, **unlit})
        return len(self.materials) - 1

    def page(self, page: TexturePage) -> int:
        """Index of a material that shows a page as it is: photographs have their light already."""
        self.images.append(self._image(page))
        texture = {"index": len(self.images) - 1}
        self.materials.append({
            "name": page.path.rsplit("/", 1)[-1],
            "pbrMetallicRoughness": {"baseColorTexture": texture, **_MATT},
            "extensions": {UNLIT: {}},
        })  # fmt: skip
        return len(self.materials) - 1

    @property
    def extensions(self) -> list[str]:
        """Names of the extensions that the materials use."""
        return sorted({name for material in self.materials for name in material.get("extensions", ())})

    @property
    def json(self) -> dict[str, Json]:
        """The document's members."""
        textures = [{"source": i, "sampler": 0} for i in range(len(self.images))]
        sampler = {"magFilter": LINEAR, "minFilter": LINEAR_MIPMAPS, "wrapS": CLAMP, "wrapT": CLAMP}
        samplers = [sampler] if textures else []
        return {"materials": self.materials, "textures": textures, "images": self.images, "samplers": samplers}

    def _image(self, page: TexturePage) -> Json:
        name = page.path.rsplit("/", 1)[-1]
        if page.path in self.pictures:
            return {"name": name, "bufferView": self.buffer.view(self.pictures[page.path]), "mimeType": page.media_type}
        return {"name": name, "uri": quote(self.appearance.image(page))}


def linear(colour: NDArray[Any]) -> FloatArray:
    """sRGB, 0 to 255 → linear light, 0 to 1 (IEC 61966-2-1), which glTF's colours count in."""
    share = np.asarray(colour, np.float64) / 255
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)


def srgb(light: FloatArray) -> NDArray[np.uint8]:
    """Linear light, 0 to 1 → sRGB, 0 to 255, rounded.

    >>> srgb(linear(np.arange(256))).tolist() == list(range(256))
    True
    """
    light = np.asarray(light, np.float64)
    share = np.where(light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 0.0) ** (1 / 2.4) - 0.055)
    return np.rint(np.clip(share, 0.0, 1.0) * 255).astype(np.uint8)


def vertex_colours(colour: NDArray[Any]) -> NDArray[np.uint16]:
    """(N, 3) sRGB, 0 to 255 → (N, 4) linear, 16 bits, opaque: eight bits of linear light are too few in the shade."""
    rgb = np.rint(linear(colour) * _LARGEST).astype(np.uint16)
    return np.column_stack([rgb, np.full(len(rgb), _LARGEST, np.uint16)])

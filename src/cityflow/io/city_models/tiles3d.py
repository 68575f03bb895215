"""3D Tiles 1.1: the files of one ground tile, in two sets, and the metadata of a tileset.

The portable set has rectified textures that any viewer shows right; the raw one the atlas in the geometry of its images, with triplets, for
viewers that divide. Both share the terrain. Each has a tileset per ground tile, which can be opened on its own, and hangs in a tree over
all tiles (`tiles3d_tree`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building, Lod
from cityflow.core.coarse import Coarse
from cityflow.core.texture import Drape, TextureSet
from cityflow.io.attributes import xml_text
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.coarse_glb import places_of, write_coarse_glb
from cityflow.io.city_models.gltf import GltfStyle, write_buildings_glb, write_terrain_glb
from cityflow.io.city_models.gltf_buffer import compact_json
from cityflow.io.globe import Placing
from cityflow.io.globe_frame import TileFrame

Json = Any
VERSION = "1.1"
FOLDER = "products/tiles3d"
PORTABLE, RAW = "tileset.json", "tileset_raw.json"
BUILDINGS, BUILDINGS_RAW, TERRAIN, COARSE = "buildings.glb", "buildings_raw.glb", "terrain.glb", "coarse.glb"
SHARE_OF_DIAGONAL = 1 / 8
"""Geometric error of a tile without content, by its diagonal: at 16 pixels of error on a screen of 1,080 a tile of 500 m loads 5 km away."""
SWITCH_PX, SEEN_PX = 16.0, 4.0
"""Viewers show what is finer where a stated error covers the first of these on the screen: the default of CesiumJS, of Cesium for Unreal and Unity, and
of 3d-tiles-renderer. What a coarse content is off covers the second one there; set by measurement (benchmarks/coarse_switch.py)."""

BOX_MARGIN_M = 0.005
"""Around the vertices, since they are rounded to 32 bits."""

_BOX_DECIMALS = 3


@dataclass(frozen=True, slots=True)
class About:
    """What the tilesets of a city say of themselves.

    Attributes
    ----------
    title, attribution, date : as the survey gives them
    crs : code of the CRS that the city was made in, or ``local``
    placing : how it came to the globe; None in a local frame
    """

    title: str
    attribution: str = ""
    date: str = ""
    crs: str = "local"
    placing: Placing | None = None

    def metadata(self) -> dict[str, str | float]:
        """Name → text or metres; what is empty is left out."""
        texts = {"title": self.title, "attribution": self.attribution, "date": self.date, "source_crs": self.crs}
        known: dict[str, str | float] = {name: xml_text(text) for name, text in texts.items() if text}
        return known | ({} if self.placing is None else self.placing.as_metadata())


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """What stands on a ground tile.

    Attributes
    ----------
    name : of the tile, also of its folder
    buildings : with their party walls cut
    terrain : (V, 3) vertices, world metres, and (T, 3) triangles
    rectified, raw : textures of the buildings, drape : ortho on the terrain; None where there is none
    coarse : the same from far away; None where only what is near is written
    """

    name: str
    buildings: Sequence[Building]
    terrain: tuple[FloatArray, IntArray]
    rectified: TextureSet | None = None
    raw: TextureSet | None = None
    drape: Drape | None = None
    coarse: Coarse | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Content:
    """A file of a tile: its URI from the tileset, and lower and upper corner (3,) of what is in it, in the tile's frame."""

    uri: str
    lower: FloatArray
    upper: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FarContent:
    """A file that stands for all others of a tile where that is seen from far away, and the geometric error that is stated for it, metres."""

    content: Content
    error: float


def tile_files(scene: Scene, frame: TileFrame, about: About) -> Mapping[str, bytes]:
    """The files of a ground tile by their path in RUN; the raw set only where the scene has raw textures.

    Parameters
    ----------
    frame : from `globe_frame.frame_at` in the middle of the tile
    """
    return dict(_files(scene, frame, about))


def _files(scene: Scene, frame: TileFrame, about: About) -> Iterator[tuple[str, bytes]]:
    folder = f"{FOLDER}/{scene.name}"
    style = GltfStyle(attribution=about.attribution)
    terrain = write_terrain_glb(TERRAIN, *scene.terrain, frame, Appearance(folder, drape=scene.drape), style)
    if terrain:
        yield f"{folder}/{TERRAIN}", terrain
    far = None if scene.coarse is None else write_coarse_glb(COARSE, scene.coarse, frame, about.attribution)
    if far:
        yield f"{folder}/{COARSE}", far
    sets = [(PORTABLE, BUILDINGS, scene.rectified)]
    if scene.raw is not None:
        sets.append((RAW, BUILDINGS_RAW, scene.raw))
    for tileset, file, textures in sets:
        buildings = write_buildings_glb(scene.name, scene.buildings, frame, Appearance(folder, textures), style)
        if buildings:
            yield f"{folder}/{file}", buildings
        contents = [*_contents(scene, frame, file if buildings else "", TERRAIN if terrain else "")]
        if contents:
            yield (
                f"{folder}/{tileset}",
                write_tileset(contents, frame, about, _far(scene.coarse if far else None, frame)),
            )


def _contents(scene: Scene, frame: TileFrame, buildings: str, terrain: str) -> Iterator[Content]:
    if terrain:
        yield _content(terrain, scene.terrain[0], frame)
    if buildings:
        shells = [b.solids[Lod.LOD22] for b in scene.buildings if Lod.LOD22 in b.solids]
        shells += [b.beyond for b in scene.buildings if b.beyond is not None]
        yield _content(buildings, np.concatenate([shell.vertices for shell in shells]), frame)


def _far(coarse: Coarse | None, frame: TileFrame) -> FarContent | None:
    return None if coarse is None else FarContent(_content(COARSE, places_of(coarse), frame), stated(coarse.error))


def stated(error: float) -> float:
    """Geometric error that a tileset states for a coarse content, metres to the centimetre, from how far that is off: where the latter covers `SEEN_PX`,
    viewers go on to what is finer."""
    return round(error * SWITCH_PX / SEEN_PX, 2)


def _content(uri: str, xyz: FloatArray, frame: TileFrame) -> Content:
    local = frame.local(xyz)
    return Content(uri, local.min(axis=0) - BOX_MARGIN_M, local.max(axis=0) + BOX_MARGIN_M)


def write_tileset(contents: Sequence[Content], frame: TileFrame, about: About, far: FarContent | None = None) -> bytes:
    """A tileset whose root stands where `frame` stands and has a child for each content; `far` is shown in place of all of them.

    Many viewers read one content per tile only, so several are children.
    """
    every = [*contents, *([] if far is None else [far.content])]
    lower = np.min([content.lower for content in every], axis=0)
    upper = np.max([content.upper for content in every], axis=0)
    children = [
        {"boundingVolume": {"box": box_of(c.lower, c.upper)}, "geometricError": 0, "content": {"uri": c.uri}}
        for c in contents
    ]
    box = box_of(lower, upper)
    shown: dict[str, Json] = (
        {"geometricError": error_of(box), "refine": "ADD"}
        if far is None
        else {"geometricError": far.error, "refine": "REPLACE", "content": {"uri": far.content.uri}}
    )
    root = {"transform": frame.matrix, "boundingVolume": {"box": box}, **shown, "children": children}
    return tileset_json(root, about)


def tileset_json(root: dict[str, Json], about: About) -> bytes:
    """A tileset around its root tile, with metadata."""
    metadata = about.metadata()
    properties = {
        name: {"type": "STRING"} if isinstance(value, str) else {"type": "SCALAR", "componentType": "FLOAT64"}
        for name, value in metadata.items()
    }
    whole = {
        "asset": {"version": VERSION},
        "schema": {"id": "cityflow_tileset", "classes": {"tileset": {"properties": properties}}},
        "metadata": {"class": "tileset", "properties": metadata},
        "geometricError": max(size_of(root["boundingVolume"]["box"]), root["geometricError"]),
        "root": root,
    }
    return compact_json(whole) + b"\n"


def box_of(lower: FloatArray, upper: FloatArray, axes: FloatArray | None = None) -> list[float]:
    """A box of 3D Tiles, centre and three half axes, from its corners along `axes` (rows; those of the frame by default)."""
    rows = np.eye(3) if axes is None else axes
    half = np.ceil((upper - lower) / 2 * 10**_BOX_DECIMALS + 0.5) / 10**_BOX_DECIMALS
    centre = ((lower + upper) / 2) @ rows
    sides = half[:, None] * rows
    if axes is None:
        return [round(float(v), _BOX_DECIMALS) for v in (*centre, *sides.reshape(-1))]
    return [float(v) for v in (*centre, *sides.reshape(-1))]


def size_of(box: Sequence[float]) -> float:
    """Diagonal of a box, metres to the centimetre: the error where nothing of it is shown."""
    return round(2 * math.hypot(*box[3:]), 2)


def error_of(box: Sequence[float]) -> float:
    """Geometric error of a tile with this box and no content, metres to the centimetre."""
    return round(2 * math.hypot(*box[3:]) * SHARE_OF_DIAGONAL, 2)

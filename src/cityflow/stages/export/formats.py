"""One tile of the city in each export format: what files it becomes, and where they stand."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building
from cityflow.core.grid import Bounds
from cityflow.core.reference import Reference
from cityflow.core.texture import Drape, TextureSet
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.city_models.cityjson import Transform, feature_line
from cityflow.io.city_models.cityjson_sequence import Bounds3, extent_of, header_line, terrain_feature_line
from cityflow.io.city_models.obj import write_obj
from cityflow.io.city_models.openings import NO_OPENINGS, Openings
from cityflow.io.city_models.tiles3d import About, Scene, tile_files
from cityflow.io.globe import Globe, globe_of
from cityflow.io.globe_frame import frame_at
from cityflow.surface.tin import Tin
from cityflow.surface.tin_parts import connected_parts

Files = Iterator[tuple[str, bytes]]
"""RUN-relative path, contents."""

CITYJSON_FOLDER = "products/cityjson"


@dataclass(frozen=True, slots=True)
class CityTile:
    """What is exported of one tile: buildings with their party walls cut, the terrain, and what the files say of themselves."""

    name: str
    bounds: Bounds
    buildings: tuple[Building, ...]
    terrain: Tin
    reference: Reference
    title: str
    date: str
    attribution: str = ""
    city: Bounds | None = None
    raw: TextureSet | None = None
    rectified: TextureSet | None = None
    drape: Drape | None = None
    openings: Openings = field(default_factory=lambda: NO_OPENINGS)


def cityjson(tile: CityTile) -> Files:
    """``cityjson/TILE.city.jsonl``: header, a line per building, the terrain."""
    transform, look = Transform.over(tile.bounds), Appearance(CITYJSON_FOLDER, tile.rectified, tile.drape)
    lines = [header_line(tile.reference, _extent(tile), transform, tile.title, tile.date)]
    lines += [feature_line(b, transform, look, tile.openings) for b in tile.buildings]
    lines += [terrain_feature_line(*part, transform, appearance=look) for part in _relief(tile)]
    yield f"{CITYJSON_FOLDER}/{tile.name}.city.jsonl", b"".join(lines)


def citygml(tile: CityTile) -> Files:
    """``citygml/TILE.gml``."""
    target, look = io.BytesIO(), Appearance("products/citygml", tile.rectified, tile.drape)
    write_citygml(
        target,
        tile.buildings,
        tile.reference,
        _extent(tile),
        _relief(tile),
        tile.title,
        appearance=look,
        openings=tile.openings,
    )
    yield f"products/citygml/{tile.name}.gml", target.getvalue()


def obj(tile: CityTile) -> Files:
    """``obj/TILE.obj`` with materials and a sidecar of attributes; its texture coordinates are triplets."""
    return _obj(tile, "products/obj", tile.raw)


def obj_rectified(tile: CityTile) -> Files:
    """``obj_rectified/TILE.obj``: the same for programs that do not divide."""
    return _obj(tile, "products/obj_rectified", tile.rectified)


def _obj(tile: CityTile, folder: str, textures: TextureSet | None) -> Files:
    look = Appearance(folder, textures, tile.drape)
    files = write_obj(
        tile.name, tile.buildings, tile.reference, Transform.over(tile.bounds), _relief(tile), appearance=look
    )
    for name, data in files.items():
        yield f"{folder}/{name}", data


def tiles3d(tile: CityTile) -> Files:
    """``tiles3d/TILE/``: a tileset of its own with rectified textures, and one with triplets for viewers that divide."""
    globe = globe_of(tile.reference, tile.city or tile.bounds)
    x_min, y_min, x_max, y_max = tile.bounds
    frame = frame_at(globe, ((x_min + x_max) / 2, (y_min + y_max) / 2, 0.0))
    scene = Scene(
        tile.name, tile.buildings, (tile.terrain.vertices, tile.terrain.triangles),
        tile.rectified, tile.raw, tile.drape,
    )  # fmt: skip
    yield from tile_files(
        scene, frame, about_tiles(tile.title, tile.attribution, tile.date, tile.reference, globe)
    ).items()


def about_tiles(title: str, attribution: str, date: str, reference: Reference, globe: Globe | None) -> About:
    """What tilesets say of themselves."""
    code = "local" if reference.is_local else reference.code
    return About(title, attribution, date, code, None if globe is None else globe.placing)


def _extent(tile: CityTile) -> Bounds3 | None:
    return extent_of(tile.buildings, [tile.terrain.vertices])


def terrain_name(tile: CityTile) -> str:
    return f"terrain-{tile.name}"


def _relief(tile: CityTile) -> list[tuple[str, FloatArray, IntArray]]:
    """A surface is in one piece: a terrain with gaps that part it is several, the first with the plain name."""
    parts = connected_parts(tile.terrain.vertices, tile.terrain.triangles)
    return [(terrain_name(tile) + (f"-{n}" if n else ""), *part) for n, part in enumerate(parts)]


WRITERS: Mapping[str, Callable[[CityTile], Files]] = {
    "cityjson": cityjson,
    "citygml": citygml,
    "obj": obj,
    "obj_rectified": obj_rectified,
    "tiles3d": tiles3d,
}

"""CityJSONSeq 2.0: one line per building, exact to the bit, also used between stages.

Coordinates are integers of 0.1 mm from a translation of whole metres. A coordinate of the model is the float64 nearest
to its decimal; an integer divided by 10,000 gives exactly that one back, so a line read again is the same building.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from shapely import LineString, Polygon

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building, EdgeOverhang, Face, Lod, Polyhedron, RoofPlane, Semantic, Status
from cityflow.core.openings import UnitOpenings
from cityflow.io.attributes import GROUND_KEY, OVERHANGS_KEY, PLANES_KEY, REASON_KEY, STATUS_KEY, described
from cityflow.io.city_models.appearance import BARE, Appearance, Looks
from cityflow.io.city_models.cityjson_appearance import FeatureAppearance
from cityflow.io.city_models.cityjson_installations import installation_objects, installations_of
from cityflow.io.city_models.cityjson_openings import geometry_with_openings
from cityflow.io.city_models.exported_openings import (
    NO_OPENINGS,
    AttributesOfFaces,
    Openings,
    attributes_of_faces,
    attributes_of_walls,
)
from cityflow.io.city_models.roof_plane_attributes import (
    counted_points,
    number_or_none,
    plane_attributes,
    plane_json,
    plane_of,
)

Json = Any
UNITS_PER_METRE = 10_000
EMPTY: Mapping[str, Json] = MappingProxyType({})
_SOLID_LODS = (Lod.LOD12, Lod.LOD13, Lod.LOD22)


@dataclass(frozen=True, slots=True)
class Transform:
    """Where the integer coordinates of a file count from: whole metres; the scale is always 0.1 mm."""

    x: int = 0
    y: int = 0
    z: int = 0

    @classmethod
    def over(cls, bounds: Sequence[float], step: int = 1000) -> Transform:
        """From the multiple of `step` metres below x_min, y_min of `bounds`.

        >>> Transform.over((84967.5, 447497.4, 85312.0, 447800.0))
        Transform(x=84000, y=447000, z=0)
        """
        return cls(math.floor(bounds[0] / step) * step, math.floor(bounds[1] / step) * step, 0)

    @classmethod
    def of_header(cls, header: Mapping[str, Json]) -> Transform:
        """The transform of a header that `header_line` wrote."""
        x, y, z = (round(v) for v in header["transform"]["translate"])
        return cls(x, y, z)

    @property
    def json(self) -> dict[str, list[float]]:
        return {"scale": [1 / UNITS_PER_METRE] * 3, "translate": [float(self.x), float(self.y), float(self.z)]}

    def encode(self, xyz: FloatArray) -> IntArray:
        """(N, 3) world metres → (N, 3) integers."""
        return np.rint(np.asarray(xyz, np.float64) * UNITS_PER_METRE).astype(np.int64) - self.shift

    def decode(self, integers: Json) -> FloatArray:
        """(N, 3) integers → (N, 3) float64 world metres, bit for bit those that were multiples of 0.1 mm."""
        return (np.asarray(integers, np.int64).reshape(-1, 3) + self.shift) / float(UNITS_PER_METRE)

    @property
    def shift(self) -> IntArray:
        """(3,) the origin in integer units."""
        return np.array([self.x, self.y, self.z], np.int64) * UNITS_PER_METRE


ORIGIN = Transform()
"""The transform of what stages hand to each other: it depends on no survey's extent."""


class _Vertices:
    """The shared vertex list of one feature: equal points of different solids are stored once."""

    def __init__(self, transform: Transform) -> None:
        self._transform = transform
        self._index: dict[tuple[int, int, int, int], int] = {}

    def add(self, xyz: FloatArray) -> list[int]:
        """Indices of points; points that are equal among themselves stay apart, as their solid has them."""
        seen: dict[tuple[int, int, int], int] = {}
        indices = []
        for x, y, z in self._transform.encode(xyz).tolist():
            copy = seen.get((x, y, z), 0)
            seen[x, y, z] = copy + 1
            indices.append(self._index.setdefault((x, y, z, copy), len(self._index)))
        return indices

    @property
    def json(self) -> list[list[int]]:
        return [[x, y, z] for x, y, z, _ in self._index]

    @property
    def extent(self) -> list[float]:
        points = self._transform.decode(self.json)
        return [*points.min(axis=0).tolist(), *points.max(axis=0).tolist()]


def feature_line(
    building: Building,
    transform: Transform = ORIGIN,
    appearance: Appearance = BARE,
    openings: Openings = NO_OPENINGS,
) -> bytes:
    """One CityJSONFeature with LoD 0, 1.2, 1.3 and 2.2, as a line of UTF-8 JSON that ends with a newline.

    With rectified textures LoD 2.2 is textured, and each of its faces that the textures know is a surface of its own. Where the building has
    windows its surfaces are there once more at LoD 3, with the same textures.
    """
    vertices, look = _Vertices(transform), FeatureAppearance(appearance, building)
    found = openings.get(building.id)
    solids = {
        lod: _solid(building, lod, vertices, look, found) for lod in reversed(_SOLID_LODS) if lod in building.solids
    }
    footprint = [] if building.footprint.is_empty else [_footprint(building, vertices)]
    beyond = [] if building.beyond is None else [_beyond(building, building.beyond, vertices, look, found)]
    opened = geometry_with_openings(building, found, vertices.add, look)
    attributes: dict[str, Json] = {**described(building), PLANES_KEY: [plane_json(p) for p in building.planes]}
    if building.overhangs:
        attributes[OVERHANGS_KEY] = overhang_rows(building.overhangs)
    city_object: dict[str, Json] = {
        "type": "Building",
        "attributes": attributes,
        "geometry": footprint
        + [solids[lod] for lod in _SOLID_LODS if lod in solids]
        + beyond
        + ([opened] if opened else []),
    }
    if solids or footprint:
        city_object["geographicalExtent"] = vertices.extent
    parts = installation_objects(building, vertices.add)
    if parts:
        city_object["children"] = [*parts]
    return object_line(building.id, city_object, vertices.json, look.json, parts)


def read_feature(line: bytes | str, transform: Transform = ORIGIN) -> Building:
    """The building of a line that `feature_line` wrote with the same transform.

    Vertices, faces, semantics, planes and footprint come back bit for bit; vertices that no face uses are gone.
    """
    feature = json.loads(line)
    city_object = feature["CityObjects"][feature["id"]]
    vertices = transform.decode(feature["vertices"])
    attributes = dict(city_object["attributes"])
    planes = tuple(plane_of(p) for p in attributes.pop(PLANES_KEY))
    overhangs = tuple(map(_overhang, attributes.pop(OVERHANGS_KEY, ())))
    geometry = {g["lod"]: g for g in city_object["geometry"] if g["lod"] == "0" or g["type"] == "Solid"}
    beyond = [g for g in city_object["geometry"] if g["lod"] == Lod.LOD22.value and g["type"] == "MultiSurface"]
    return Building(
        id=feature["id"],
        footprint=_polygon(geometry["0"], vertices) if "0" in geometry else Polygon(),
        ground_height=attributes.pop(GROUND_KEY),
        solids={lod: _polyhedron(geometry[lod], vertices) for lod in _SOLID_LODS if lod in geometry},
        planes=planes,
        status=Status(attributes.pop(STATUS_KEY)),
        reason=attributes.pop(REASON_KEY),
        attributes=attributes,
        overhangs=overhangs,
        beyond=_polyhedron(beyond[0], vertices) if beyond else None,
        installations=installations_of(feature, lambda geometry: _polyhedron(geometry, vertices)),
    )


def overhang_rows(overhangs: Sequence[EdgeOverhang]) -> list[Json]:
    """x, y of both ends of an edge, reach, standard deviation (null where unknown) and share seen."""
    return [
        [*map(float, (*o.line.coords[0], *o.line.coords[-1])), o.reach_m, number_or_none(o.sigma_m), o.seen]
        for o in overhangs
    ]


def _overhang(row: Sequence[Json]) -> EdgeOverhang:
    return EdgeOverhang(LineString([row[0:2], row[2:4]]), row[4], math.nan if row[5] is None else row[5], row[6])


def _solid(
    building: Building, lod: Lod, vertices: _Vertices, look: FeatureAppearance, found: UnitOpenings | None
) -> Json:
    looks = look.of("solid") if lod is Lod.LOD22 else {}
    walls = attributes_of_walls(found, "solid", building.solids[lod]) if lod is Lod.LOD22 else {}
    surfaces = _surfaces_of(building.solids[lod], building, lod, vertices, looks, walls)
    semantics = {**surfaces["semantics"], "values": [surfaces["semantics"]["values"]]}
    members = look.members([f.rings for f in building.solids[lod].faces], looks, in_shell=True)
    return {**surfaces, "type": "Solid", "boundaries": [surfaces["boundaries"]], "semantics": semantics, **members}


def _beyond(
    building: Building, shell: Polyhedron, vertices: _Vertices, look: FeatureAppearance, found: UnitOpenings | None
) -> Json:
    looks = look.of("beyond")
    surfaces = _surfaces_of(shell, building, Lod.LOD22, vertices, looks, attributes_of_walls(found, "beyond", shell))
    return {**surfaces, **look.members([f.rings for f in shell.faces], looks)}


def _surfaces_of(
    solid: Polyhedron, building: Building, lod: Lod, vertices: _Vertices, looks: Looks, walls: AttributesOfFaces
) -> dict[str, Json]:
    """The faces as a MultiSurface with their semantics; a face of which textures or windows say something has one of its own."""
    used = sorted({i for face in solid.faces for ring in face.rings for i in ring})
    index = dict(zip(used, vertices.add(solid.vertices[used]), strict=True))
    attributes = attributes_of_faces(looks, walls)
    kinds: dict[tuple[Semantic, int, str | None, int | None, int], int] = {}
    values = [
        kinds.setdefault((f.semantic, f.plane, f.neighbour, f.points, i if i in attributes else -1), len(kinds))
        for i, f in enumerate(solid.faces)
    ]
    surfaces = [
        _surface(s, p, n, building.planes) | counted_points(c) | attributes.get(i, {}) for s, p, n, c, i in kinds
    ]
    return {
        "type": "MultiSurface",
        "lod": lod.value,
        "boundaries": [[[index[i] for i in ring] for ring in face.rings] for face in solid.faces],
        "semantics": {"surfaces": surfaces, "values": values},
    }


def _surface(semantic: Semantic, plane: int, neighbour: str | None, planes: Sequence[RoofPlane]) -> dict[str, Json]:
    surface: dict[str, Json] = {"type": semantic.value}
    if plane >= 0:
        surface["plane"] = int(plane)
    if 0 <= plane < len(planes):
        surface |= plane_attributes(planes[plane])
    if neighbour is not None:
        surface |= {"is_party_wall": True, "neighbour": neighbour}
    return surface


def _footprint(building: Building, vertices: _Vertices) -> Json:
    rings = [building.footprint.exterior, *building.footprint.interiors]
    boundaries = []
    for ring in rings:
        xy = np.asarray(ring.coords)[:-1, :2]
        boundaries.append(vertices.add(np.column_stack([xy, np.full(len(xy), building.ground_height)])))
    return {"type": "MultiSurface", "lod": Lod.LOD0.value, "boundaries": [boundaries]}


def _polygon(geometry: Json, vertices: FloatArray) -> Polygon:
    shell, *holes = (vertices[ring, :2] for ring in geometry["boundaries"][0])
    return Polygon(shell, holes)


def _polyhedron(geometry: Json, vertices: FloatArray) -> Polyhedron:
    """The shell of a Solid, or the surfaces of a MultiSurface."""
    is_solid, semantics = geometry["type"] == "Solid", geometry["semantics"]
    shell, values = (g[0] if is_solid else g for g in (geometry["boundaries"], semantics["values"]))
    used = sorted({i for face in shell for ring in face for i in ring})
    index = {old: new for new, old in enumerate(used)}
    surfaces = [semantics["surfaces"][value] for value in values]
    faces = tuple(
        Face(
            rings=tuple(tuple(index[i] for i in ring) for ring in face),
            semantic=Semantic(surface["type"]),
            plane=surface.get("plane", -1),
            neighbour=surface.get("neighbour"),
            points=surface.get("points") if "plane" not in surface else None,
        )
        for face, surface in zip(shell, surfaces, strict=True)
    )
    return Polyhedron(vertices[used], faces)


def object_line(
    name: str, city_object: Json, vertices: list[list[int]], appearance: Json = None, parts: Mapping[str, Json] = EMPTY
) -> bytes:
    """A CityJSONFeature of one city object and of its parts; `appearance` if it has any."""
    objects = {name: city_object, **parts}
    feature = {"type": "CityJSONFeature", "id": name, "CityObjects": objects, "vertices": vertices}
    return json_line({**feature, "appearance": appearance} if appearance else feature)


def json_line(value: Json) -> bytes:
    """Compact JSON in UTF-8 with a newline, and no other character that some readers take for one."""
    text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    for other in "\x85\u2028\u2029":
        text = text.replace(other, f"\\u{ord(other):04x}")
    return text.encode("utf-8", "replace") + b"\n"

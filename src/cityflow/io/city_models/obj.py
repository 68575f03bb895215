"""Wavefront OBJ: an object per building, materials by surface type or page, a local origin; JSON for attributes and CRS.

Triangles and convex quadrangles are written as they are; every other face as triangles, since readers of OBJ differ on
concave faces and know no holes. A corner of a textured face has the triplet (u·d, v·d, d) as its texture coordinate
(Frommholz 2017, section 5): what is linear over a face, so that triangles of it show the same as the whole.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Face, Lod, Polyhedron
from cityflow.core.reference import Reference
from cityflow.core.texture import FaceTexture, Shell
from cityflow.geometry.polyhedron import triangulate
from cityflow.io.attributes import described, ncname, xml_text
from cityflow.io.city_models.appearance import (
    BARE,
    TEXTURE_DECIMALS,
    Appearance,
    Looks,
    attributes_of_look,
    coordinates_of,
    looks_of,
)
from cityflow.io.city_models.citygml import Tin
from cityflow.io.city_models.cityjson import Transform
from cityflow.io.city_models.obj_materials import MATERIALS, material_of, materials_file
from cityflow.io.crs import crs_of, vertical_datum

__all__ = ["MATERIALS", "write_obj"]

_FACE_COLUMNS = ["shell", "face", "polygons", "semantic", "material", "texture"]
"""Of every face of an object, in the order of the file: `polygons` is the number of its ``f`` lines."""


def write_obj(
    name: str,
    buildings: Sequence[Building],
    reference: Reference,
    origin: Transform,
    terrain: Iterable[Tin] = (),
    lod: Lod = Lod.LOD22,
    appearance: Appearance = BARE,
) -> dict[str, bytes]:
    """The files ``name.obj``, ``name.mtl`` and ``name.json``, by name.

    Parameters
    ----------
    name : without extension, an ASCII file name
    origin : world position of the local origin that the OBJ counts from
    appearance : textures in their root images' geometry (triplets), or rectified (third number 1); LoD2.2 shows them
    """
    tins = list(terrain)
    scene = _Scene(origin, appearance)
    for building in buildings:
        if lod in building.solids:
            scene.add_building(building, lod)
    for tin in tins:
        scene.add_terrain(tin)
    return {
        f"{name}.obj": "\n".join([*_head(name, reference, origin, appearance), *scene.lines, ""]).encode(),
        f"{name}.mtl": materials_file(scene.materials, appearance).encode(),
        f"{name}.json": _sidecar(buildings, reference, scene, tins).encode(),
    }


def _head(name: str, reference: Reference, origin: Transform, appearance: Appearance) -> Iterator[str]:
    yield f"# x east, y north, z up, metres; heights: {vertical_datum(reference)}; CRS: {reference.code}"
    yield f"# add the offset {origin.x} {origin.y} {origin.z} to get world coordinates; attributes in {name}.json"
    if appearance.textures is not None and not appearance.textures.rectified:
        yield "# vt is (u*d, v*d, d): divide the first two by the third at every pixel, after interpolation;"
        yield "# a program that does not divide needs the format obj, in which the third number is 1"
    elif appearance.textures is not None:
        yield "# vt is (u, v, 1): rectified textures, nothing to divide"
    yield f"mtllib {name}.mtl"


class _Scene:
    """Lines of an OBJ file, the numbers of vertices and texture coordinates so far, and what is said of faces."""

    def __init__(self, origin: Transform, appearance: Appearance) -> None:
        self.origin, self.appearance = origin, appearance
        self.lines: list[str] = []
        self.materials: dict[str, None] = {}
        self.faces: dict[str, list[list[Any]]] = {}
        self._vertices = self._coordinates = 0

    def add_building(self, building: Building, lod: Lod) -> None:
        """An object: the solid, and at LoD2.2 what lies beyond its walls and what is fixed to them."""
        self.lines.append(f"o {ncname('b', building.id)}")
        texture = self.appearance.of(building)
        parts: list[tuple[Shell, Polyhedron]] = [("solid", building.solids[lod])]
        if lod is Lod.LOD22 and building.beyond is not None:
            parts.append(("beyond", building.beyond))
        parts += [
            ("installation", one.surfaces) for one in building.installations if lod is Lod.LOD22 and not one.is_of_solid
        ]
        for shell, polyhedron in parts:
            looks = looks_of(texture, shell) if lod is Lod.LOD22 else {}
            rows = self._add_faces(polyhedron, looks)
            self.faces.setdefault(ncname("b", building.id), []).extend([shell, *row] for row in rows)

    def add_terrain(self, tin: Tin) -> None:
        """An object of triangles, with the ortho on them where there is one."""
        name, vertices, triangles = tin
        self.lines.append(f"o {ncname('terrain', name)}")
        first = self._add_vertices(vertices)
        rows = (np.asarray(triangles, np.int64) + first).tolist()
        if self.appearance.drape is None:
            drawn = [f"f {a} {b} {c}" for a, b, c in rows]
        else:
            shift = self._coordinates + 1 - first
            uv = self.appearance.drape.uv(vertices).round(TEXTURE_DECIMALS).tolist()
            self._add_coordinates([[u, v, 1.0] for u, v in uv])
            drawn = [f"f {a}/{a + shift} {b}/{b + shift} {c}/{c + shift}" for a, b, c in rows]
        self.lines += ["usemtl terrain", *drawn]

    def _add_faces(self, polyhedron: Polyhedron, looks: Looks) -> list[list[Any]]:
        """The faces of a shell; of each its number, polygons, semantic, material and figures."""
        first = self._add_vertices(polyhedron.vertices)
        coordinates = self._add_textures(polyhedron.faces, looks)
        before, rows = "", []
        for i, (face, polygons) in enumerate(zip(polyhedron.faces, _drawable(polyhedron), strict=True)):
            look = looks.get(i)
            if (material := material_of(face, look)) != before:
                before = material
                self.materials[material] = None
                self.lines.append(f"usemtl {material}")
            corner = coordinates.get(i)
            for polygon in polygons:
                self.lines.append("f " + " ".join(_corner(first, v, corner) for v in polygon))
            rows.append(
                [i, len(polygons), face.semantic.value, material, {} if look is None else attributes_of_look(look)]
            )
        return rows

    def _add_textures(self, faces: Sequence[Face], looks: Looks) -> dict[int, dict[int, int]]:
        """For each textured face the number of the texture coordinate of each of its vertices."""
        rings, found = coordinates_of(looks.values()), {}
        for i, look in looks.items():
            if isinstance(look, FaceTexture):
                corners = list(chain.from_iterable(next(rings) for _ in look.rings))
                numbers = range(self._coordinates + 1, self._coordinates + 1 + len(corners))
                found[i] = dict(zip(chain.from_iterable(faces[i].rings), numbers, strict=True))
                self._add_coordinates([[u * d, v * d, d] for u, v, d in corners])
        return found

    def _add_coordinates(self, triplets: list[list[float]]) -> None:
        self._coordinates += len(triplets)
        self.lines += [f"vt {u:.7f} {v:.7f} 1" if d == 1.0 else f"vt {u:.7f} {v:.7f} {d:.7f}" for u, v, d in triplets]

    def _add_vertices(self, xyz: FloatArray) -> int:
        """Add them; the number of the first."""
        first = self._vertices + 1
        self._vertices += len(xyz)
        tenths = self.origin.encode(xyz) / 10_000
        self.lines += [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in tenths.tolist()]
        return first


def _corner(first: int, vertex: int, coordinates: Mapping[int, int] | None) -> str:
    return f"{first + vertex}" if coordinates is None else f"{first + vertex}/{coordinates[vertex]}"


def _drawable(solid: Polyhedron) -> list[list[tuple[int, ...]]]:
    """For each face its polygons of three or four corners, as vertex indices."""
    plain = [_is_plain(solid, face) for face in solid.faces]
    drawn = [[face.rings[0]] if whole else [] for face, whole in zip(solid.faces, plain, strict=True)]
    if all(plain):
        return drawn
    cut = [i for i, whole in enumerate(plain) if not whole]
    mesh = triangulate(Polyhedron(solid.vertices, tuple(solid.faces[i] for i in cut)))
    for face, (a, b, c) in zip(mesh.faces.tolist(), mesh.triangles.tolist(), strict=True):
        drawn[cut[face]].append((a, b, c))
    return drawn


def _is_plain(solid: Polyhedron, face: Face) -> bool:
    """A triangle, or a quadrangle whose corners all turn the same way."""
    if len(face.rings) > 1 or len(face.rings[0]) > 4:
        return False
    if len(face.rings[0]) == 3:
        return True
    a, b, c, d = solid.ring(face.rings[0]).tolist()
    turns = [_cross(p, q, r) for p, q, r in ((a, b, c), (b, c, d), (c, d, a), (d, a, b))]
    x, y, z = turns[0]
    return all(x * turn[0] + y * turn[1] + z * turn[2] > 0 for turn in turns[1:])


def _cross(p: list[float], q: list[float], r: list[float]) -> tuple[float, float, float]:
    """(q − p) × (r − q); plain numbers, as arrays of three cost ten times as much."""
    ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    bx, by, bz = r[0] - q[0], r[1] - q[1], r[2] - q[2]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


def _sidecar(buildings: Sequence[Building], reference: Reference, scene: _Scene, terrain: Sequence[Tin]) -> str:
    crs, origin = crs_of(reference), scene.origin
    metadata: dict[str, Any] = {
        "crs": None if reference.is_local else reference.code,
        "crs_wkt": None if crs is None else crs.to_wkt(),
        "vertical_datum": vertical_datum(reference),
        "offset": [origin.x, origin.y, origin.z],
        "axes": "x east, y north, z up",
        "units": "m",
        "terrain": [ncname("terrain", name) for name, _, _ in terrain],
    }
    objects = {ncname("b", b.id): {"id": xml_text(b.id), "attributes": described(b)} for b in buildings}
    if scene.appearance.textures is None:
        return json.dumps(metadata | {"objects": objects}, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    metadata |= {
        "textures": [scene.appearance.image(p) for p in scene.appearance.pages()],
        "face_columns": _FACE_COLUMNS,
    }
    named = {name: attributes_of | {"faces": scene.faces.get(name, [])} for name, attributes_of in objects.items()}
    return _line_by_line(metadata, named)


def _line_by_line(metadata: dict[str, Any], objects: dict[str, dict[str, Any]]) -> str:
    """JSON with a line for each object: indented, its hundreds of thousands of faces would be most of the writing time."""
    head = json.dumps(metadata, indent=1, ensure_ascii=False, allow_nan=False).removesuffix("\n}")
    lines = (f"  {_compact(name)}: {_compact(value)}" for name, value in objects.items())
    return head + ',\n "objects": {\n' + ",\n".join(lines) + "\n }\n}\n"


def _compact(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)

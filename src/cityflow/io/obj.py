"""Wavefront OBJ: an object per building, materials by surface type, a local origin; JSON with what OBJ cannot say.

Triangles and convex quadrangles are written as they are; every other face as triangles, since readers of OBJ differ on
concave faces and know no holes.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Face, Lod, Polyhedron, Semantic
from cityflow.core.reference import Reference
from cityflow.geometry.polyhedron import triangulate
from cityflow.io.attributes import described, ncname, xml_text
from cityflow.io.citygml import Tin
from cityflow.io.cityjson import Transform
from cityflow.io.reference import crs_of, vertical_datum

MATERIALS = {
    "roof": (0.70, 0.26, 0.20),
    "wall": (0.85, 0.82, 0.75),
    "party_wall": (0.55, 0.52, 0.60),
    "ground": (0.45, 0.45, 0.45),
    "outer_ceiling": (0.75, 0.70, 0.55),
    "terrain": (0.50, 0.60, 0.40),
}
_MATERIAL_OF = {
    Semantic.ROOF: "roof",
    Semantic.WALL: "wall",
    Semantic.GROUND: "ground",
    Semantic.OUTER_CEILING: "outer_ceiling",
}


def write_obj(
    name: str,
    buildings: Sequence[Building],
    reference: Reference,
    origin: Transform,
    terrain: Iterable[Tin] = (),
    lod: Lod = Lod.LOD22,
) -> dict[str, bytes]:
    """The files ``name.obj``, ``name.mtl`` and ``name.json``, by name.

    Parameters
    ----------
    name : without extension, an ASCII file name
    origin : world position of the local origin that the OBJ counts from
    """
    tins = list(terrain)
    lines = [*_head(name, reference, origin)]
    used = 0
    for building in buildings:
        if lod in building.solids:
            lines.append(f"o {ncname('b', building.id)}")
            beyond = building.beyond if lod is Lod.LOD22 else None
            for shell in (building.solids[lod], *(() if beyond is None else (beyond,))):
                lines += _faces(shell, origin, used)
                used += len(shell.vertices)
    for tin in tins:
        lines += _terrain(tin, origin, used)
        used += len(tin[1])
    return {
        f"{name}.obj": "\n".join([*lines, ""]).encode(),
        f"{name}.mtl": _materials().encode(),
        f"{name}.json": _sidecar(buildings, reference, origin, tins).encode(),
    }


def _head(name: str, reference: Reference, origin: Transform) -> Iterator[str]:
    yield f"# x east, y north, z up, metres; heights: {vertical_datum(reference)}; CRS: {reference.code}"
    yield f"# add the offset {origin.x} {origin.y} {origin.z} to get world coordinates; attributes in {name}.json"
    yield f"mtllib {name}.mtl"


def _faces(solid: Polyhedron, origin: Transform, used: int) -> Iterator[str]:
    yield from _vertices(solid.vertices, origin)
    material = ""
    for face, polygons in zip(solid.faces, _drawable(solid), strict=True):
        if (of_face := "party_wall" if face.neighbour is not None else _MATERIAL_OF[face.semantic]) != material:
            material = of_face
            yield f"usemtl {material}"
        for polygon in polygons:
            yield "f " + " ".join(str(used + 1 + i) for i in polygon)


def _terrain(tin: Tin, origin: Transform, used: int) -> Iterator[str]:
    name, vertices, triangles = tin
    yield f"o {ncname('terrain', name)}"
    yield from _vertices(vertices, origin)
    yield "usemtl terrain"
    yield from (f"f {a} {b} {c}" for a, b, c in (np.asarray(triangles, np.int64) + used + 1).tolist())


def _vertices(xyz: FloatArray, origin: Transform) -> Iterator[str]:
    tenths = origin.encode(xyz) / 10_000
    return (f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in tenths.tolist())


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


def _materials() -> str:
    return "".join(f"newmtl {name}\nKd {r:.2f} {g:.2f} {b:.2f}\n\n" for name, (r, g, b) in MATERIALS.items())


def _sidecar(buildings: Sequence[Building], reference: Reference, origin: Transform, terrain: Sequence[Tin]) -> str:
    crs = crs_of(reference)
    said: dict[str, Any] = {
        "crs": None if reference.is_local else reference.code,
        "crs_wkt": None if crs is None else crs.to_wkt(),
        "vertical_datum": vertical_datum(reference),
        "offset": [origin.x, origin.y, origin.z],
        "axes": "x east, y north, z up",
        "units": "m",
        "terrain": [ncname("terrain", name) for name, _, _ in terrain],
        "objects": {ncname("b", b.id): {"id": xml_text(b.id), "attributes": described(b)} for b in buildings},
    }
    return json.dumps(said, indent=1, ensure_ascii=False, allow_nan=False) + "\n"

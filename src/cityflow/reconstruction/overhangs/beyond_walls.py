"""What of a roof lies beyond the walls, as surfaces of their own beside the solid that ends at the walls (SIG 3D's way of modelling overhangs)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.core.building import VERTEX_DECIMALS, Face, Polyhedron, Semantic

LEAST_M2, LEAST_WIDTH_M = 1e-4, 2e-3
"""Less is what rounding leaves along the walls."""

Ring = list[tuple[float, float, float]]


def beyond_walls(solid: Polyhedron, outline: Polygon) -> Polyhedron | None:
    """The surfaces beyond the outline of a closed solid with overhangs; None where there are none.

    Roof faces are cut at the outline: the parts lie in the plane of their roof. Undersides and rims are taken as they are, those within the outline left out.

    Parameters
    ----------
    solid : as `with_overhangs` makes it
    outline : where the walls stand, world

    Returns
    -------
    An open polyhedron: it has a boundary, at the walls.
    """
    index: dict[tuple[float, float, float], int] = {}
    faces = []
    for face, rings in _pieces(solid, outline):
        numbered = tuple(tuple(index.setdefault(point, len(index)) for point in ring) for ring in rings)
        faces.append(Face(numbered, face.semantic, face.plane))
    return Polyhedron(np.array(list(index)), tuple(faces)) if faces else None


def _pieces(solid: Polyhedron, outline: Polygon) -> Iterator[tuple[Face, list[Ring]]]:
    inside = shapely.buffer(outline, LEAST_WIDTH_M)
    for face in solid.faces:
        if face.semantic is Semantic.ROOF:
            yield from ((face, rings) for rings in _cut_off(solid, face, outline))
        elif face.semantic is not Semantic.GROUND and not shapely.covers(inside, _foot(solid, face)):
            # undersides and rims; ceilings over a void of the building itself are the solid's
            yield face, [_points(solid.ring(ring)) for ring in face.rings]


def _foot(solid: Polyhedron, face: Face) -> shapely.LineString:
    """The border of a face in plan."""
    xy = solid.ring(face.rings[0])[:, :2]
    return shapely.LineString(np.concatenate([xy, xy[:1]]))


def _cut_off(solid: Polyhedron, face: Face, outline: Polygon) -> Iterator[list[Ring]]:
    """Rings of the parts of a roof face beyond the outline, counter-clockwise from above."""
    rings = [solid.ring(r) for r in face.rings]
    polygon = Polygon(rings[0][:, :2], [r[:, :2] for r in rings[1:]])
    if shapely.covers(outline, polygon):
        return
    known = {(x, y): z for x, y, z in np.concatenate(rings).tolist()}
    plane = _plane(np.concatenate(rings))
    for part in shapely.get_parts(shapely.difference(polygon, outline)):
        if isinstance(part, Polygon) and part.area > LEAST_M2 and not part.buffer(-LEAST_WIDTH_M / 2).is_empty:
            turned = orient(part)
            yield [_lifted(ring, plane, known) for ring in (turned.exterior, *turned.interiors)]


def _lifted(ring: shapely.LinearRing, plane: FloatArray, known: dict[tuple[float, float], float]) -> Ring:
    """Vertices of the face keep their height; those at the walls get it from the plane."""
    xy = shapely.get_coordinates(ring)[:-1]
    on_plane = np.column_stack([xy - plane[3:], np.ones(len(xy))]) @ plane[:3]
    z = [known.get((x, y), found) for (x, y), found in zip(xy.tolist(), on_plane.tolist(), strict=True)]
    return _points(np.column_stack([xy, z]))


def _plane(xyz: FloatArray) -> FloatArray:
    """(5,) slopes and height of the plane through a face, and the place that it counts from."""
    middle = xyz[:, :2].mean(axis=0)
    design = np.column_stack([xyz[:, :2] - middle, np.ones(len(xyz))])
    return np.concatenate([np.linalg.lstsq(design, xyz[:, 2], rcond=None)[0], middle])


def _points(xyz: FloatArray) -> Ring:
    return [(x, y, z) for x, y, z in np.round(xyz, VERTEX_DECIMALS).tolist()]

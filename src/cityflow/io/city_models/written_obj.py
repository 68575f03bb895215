"""Reads every object of a Wavefront OBJ, independently of cityflow's writer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from cityflow.core.written_geometry import GeometryKind, WrittenGeometry


def written_in_obj(lines: Iterable[bytes]) -> Iterator[WrittenGeometry]:
    """Faces of each object (`o`), in the file's frame, metres; the format says neither what they are together nor a level of detail.

    Raises
    ------
    ValueError
        A face names a vertex that the file does not have.
    """
    places: list[list[float]] = []
    faces: dict[str, list[list[int]]] = {}
    owner = ""
    for line in lines:
        kind, _, rest = line.decode().partition(" ")
        if kind == "v":
            places.append([float(v) for v in rest.split()[:3]])
        elif kind == "o":
            owner = rest.strip()
        elif kind == "f":
            faces.setdefault(owner, []).append([int(corner.split("/")[0]) for corner in rest.split()])
    vertices = np.asarray(places, np.float64).reshape(-1, 3)
    for name, rings in faces.items():
        if min(map(min, rings)) < 1 or max(map(max, rings)) > len(vertices):
            raise ValueError(f"{name}: a face names a vertex that is not there")
        polygons = tuple((vertices[np.asarray(ring) - 1],) for ring in rings)
        yield WrittenGeometry(name, GeometryKind.MULTI_SURFACE, "", polygons)

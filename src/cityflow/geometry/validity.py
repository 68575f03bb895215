"""Is a polyhedron a valid solid in the sense of ISO 19107?

Rules are checked from rings to shells, and a level is looked at only where the one below is sound: a bow tie would
otherwise show up as a dozen faults of the shell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Polyhedron
from cityflow.geometry.faults import Fault, Tolerances
from cityflow.geometry.polyhedron import (
    FaceArrays,
    Mesh,
    arrays_of_rings,
    face_arrays,
    mesh_of,
    plane_distances,
    project,
    projection_normals,
    volume,
)
from cityflow.geometry.recent import remembered
from cityflow.geometry.self_intersection import meeting_groups
from cityflow.geometry.validity_faces import inspect_faces, normal_turns, snap
from cityflow.geometry.validity_shells import topology_faults

DEFAULT = Tolerances()
Polygon = Sequence[FloatArray]
"""A polygon in space by its rings: exterior, then holes, (n, 3) metres each, without the repeated last point."""
MOST_PAIRS = 20
"""Pairs of faces that are reported to cross: a shell turned inside out has thousands."""


def check_polyhedron(polyhedron: Polyhedron, tolerances: Tolerances = DEFAULT) -> list[Fault]:
    """Faults of one closed outer shell, sorted; empty for a valid solid.

    >>> check_polyhedron(Polyhedron(np.zeros((0, 3)), ()))
    [Fault(code=902, name='EMPTY_PRIMITIVE', where='')]
    """
    return list(_faults_of(polyhedron, tolerances))


@remembered
def _faults_of(polyhedron: Polyhedron, tolerances: Tolerances) -> list[Fault]:
    faults, _ = check_shell(polyhedron, tolerances)
    if not faults and volume(polyhedron) <= 0:
        faults = [Fault.of(405)]
    return faults


def is_valid(polyhedron: Polyhedron, tolerances: Tolerances = DEFAULT) -> bool:
    """True where `check_polyhedron` finds nothing."""
    return not check_polyhedron(polyhedron, tolerances)


def check_shell(polyhedron: Polyhedron, tolerances: Tolerances = DEFAULT) -> tuple[list[Fault], Mesh | None]:
    """Faults of one closed shell, whichever way its normals point, and its triangles where the faces are sound."""
    faults = _input_faults(polyhedron)
    return (faults, None) if faults else _shell_faults(face_arrays(polyhedron), tolerances, closed=True)


def check_surface(polygons: Sequence[Polygon], tolerances: Tolerances = DEFAULT, closed: bool = False) -> list[Fault]:
    """Faults of polygons that are one surface in a piece, such as a terrain: all that a shell must be, a border allowed unless `closed`."""
    return _ring_input_faults(polygons) or _shell_faults(arrays_of_rings(polygons), tolerances, closed)[0]


def check_polygons(polygons: Sequence[Polygon], tolerances: Tolerances = DEFAULT) -> list[Fault]:
    """Faults of polygons each by itself: what the members of a MultiSurface must be."""
    return _ring_input_faults(polygons) or _sound_faces(arrays_of_rings(polygons), tolerances)[0]


def _shell_faults(arrays: FaceArrays, tolerances: Tolerances, closed: bool) -> tuple[list[Fault], Mesh | None]:
    faults, mesh, snapped = _sound_faces(arrays, tolerances)
    if mesh is None:
        return faults, None
    faults = topology_faults(snapped, mesh.triangles, closed)
    if not faults:
        pairs = meeting_groups(mesh.vertices, mesh.triangles, mesh.faces, tolerances.touch_m, MOST_PAIRS)
        faults = [Fault.of(306, f"face={a}|face={b}") for a, b in pairs]
    return sorted(faults), mesh


def _sound_faces(arrays: FaceArrays, tolerances: Tolerances) -> tuple[list[Fault], Mesh | None, FaceArrays]:
    """Faults of faces each by itself, their triangles where there are none, and the faces with snapped corners."""
    snapped = _snapped(arrays, tolerances)
    faults = _polygon_faults(snapped, tolerances)
    if faults:
        return sorted(faults), None, snapped
    triangles, faces = mesh_of(snapped)
    turns = normal_turns(snapped.vertices, triangles, faces, snapped.face_count)
    faults = [Fault.of(204, f"face={f}") for f in np.flatnonzero(turns > tolerances.normals_deg)]
    return faults, None if faults else Mesh(snapped.vertices, triangles, faces), snapped


def check_polygon(rings: Polygon, tolerances: Tolerances = DEFAULT) -> list[Fault]:
    """Faults of one polygon in space: exterior, then holes, (n, 3) metres each, without the repeated last point."""
    return check_polygons([rings], tolerances)


def _ring_input_faults(polygons: Sequence[Polygon]) -> list[Fault]:
    if not polygons:
        return [Fault.of(902)]
    return [
        Fault.of(901, f"face={f}|ring={r}")
        for f, rings in enumerate(polygons)
        for r, ring in enumerate(rings)
        if not np.isfinite(ring).all()
    ]


def _input_faults(polyhedron: Polyhedron) -> list[Fault]:
    if not polyhedron.faces or any(not face.rings for face in polyhedron.faces):
        return [Fault.of(902)]
    vertices = np.asarray(polyhedron.vertices)
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    faults = [Fault.of(901, f"vertex={i}") for i in bad]
    for f, face in enumerate(polyhedron.faces):
        if any(not 0 <= i < len(vertices) for ring in face.rings for i in ring):
            faults.append(Fault.of(901, f"face={f}"))
    return faults


def _snapped(arrays: FaceArrays, tolerances: Tolerances) -> FaceArrays:
    """The same faces with every vertex replaced by the first one within the snap tolerance."""
    representative: IntArray = snap(arrays.vertices, tolerances.snap_m)
    if np.array_equal(representative, np.arange(len(representative))):
        return arrays
    return replace(arrays, corners=representative[arrays.corners])


def _polygon_faults(arrays: FaceArrays, tolerances: Tolerances) -> list[Fault]:
    if not len(arrays.corners):
        return [Fault.of(101, f"face={f}") for f in range(arrays.face_count)]
    distances = plane_distances(arrays)
    xy = project(arrays, projection_normals(arrays))
    limits = np.array([tolerances.planarity_m, tolerances.touch_m])
    found = inspect_faces(xy, arrays.corners, arrays.ring_start, arrays.face_start, distances, limits)
    return [Fault.of(int(code), f"face={f}" if ring < 0 else f"face={f}|ring={ring}") for code, f, ring in found]

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
    face_arrays,
    mesh_of,
    plane_distances,
    project,
    projection_normals,
    volume,
)
from cityflow.geometry.self_intersection import meeting_groups
from cityflow.geometry.validity_faces import inspect_faces, normal_turns, snap
from cityflow.geometry.validity_shells import topology_faults

DEFAULT = Tolerances()
MOST_PAIRS = 20
"""Pairs of faces that are reported to cross: a shell turned inside out has thousands."""


def check_polyhedron(polyhedron: Polyhedron, tolerances: Tolerances = DEFAULT) -> list[Fault]:
    """Faults of one closed outer shell, sorted; empty for a valid solid.

    >>> check_polyhedron(Polyhedron(np.zeros((0, 3)), ()))
    [Fault(code=902, name='EMPTY_PRIMITIVE', where='')]
    """
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
    if faults:
        return faults, None
    arrays = _snapped(face_arrays(polyhedron), tolerances)
    faults = _polygon_faults(arrays, tolerances)
    if faults:
        return sorted(faults), None
    triangles, faces = mesh_of(arrays)
    mesh = Mesh(arrays.vertices, triangles, faces)
    turns = normal_turns(mesh.vertices, triangles, faces, arrays.face_count)
    faults = [Fault.of(204, f"face={f}") for f in np.flatnonzero(turns > tolerances.normals_deg)]
    if faults:
        return faults, None
    faults = topology_faults(arrays, triangles)
    if not faults:
        pairs = meeting_groups(mesh.vertices, triangles, faces, tolerances.touch_m, MOST_PAIRS)
        faults = [Fault.of(306, f"face={a}|face={b}") for a, b in pairs]
    return sorted(faults), mesh


def check_closed_ring(points: FloatArray, tolerances: Tolerances = DEFAULT) -> list[Fault]:
    """Faults of one ring as GML writes it, (n, 3) metres with the first point repeated at the end."""
    points = np.asarray(points, np.float64).reshape(-1, 3)
    if len(points) < 2 or np.linalg.norm(points[0] - points[-1]) > tolerances.snap_m:
        return [Fault.of(103, "ring=0")]
    return check_polygon([points[:-1]], tolerances)


def check_polygon(rings: Sequence[FloatArray], tolerances: Tolerances = DEFAULT) -> list[Fault]:
    """Faults of one polygon in space: exterior, then holes, (n, 3) metres each, without the repeated last point."""
    sizes = np.array([len(r) for r in rings], np.int64)
    points = np.concatenate([np.asarray(r, np.float64).reshape(-1, 3) for r in rings])
    origin = points[0] if len(points) else np.zeros(3)
    ring_start = np.concatenate([[0], np.cumsum(sizes)])
    arrays = FaceArrays(points - origin, origin, np.arange(len(points)), ring_start, np.array([0, len(sizes)]))
    arrays = _snapped(arrays, tolerances)
    faults = _polygon_faults(arrays, tolerances)
    if faults:
        return sorted(faults)
    triangles, faces = mesh_of(arrays)
    turns = normal_turns(arrays.vertices, triangles, faces, 1)
    return [Fault.of(204, "face=0")] if turns[0] > tolerances.normals_deg else []


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
    return replace(arrays, corners=representative[arrays.corners])


def _polygon_faults(arrays: FaceArrays, tolerances: Tolerances) -> list[Fault]:
    if not len(arrays.corners):
        return [Fault.of(101, f"face={f}") for f in range(arrays.face_count)]
    distances = plane_distances(arrays)
    xy = project(arrays, projection_normals(arrays))
    limits = np.array([tolerances.planarity_m, tolerances.touch_m])
    found = inspect_faces(xy, arrays.corners, arrays.ring_start, arrays.face_start, distances, limits)
    return [Fault.of(int(code), f"face={f}" if ring < 0 else f"face={f}|ring={ring}") for code, f, ring in found]

"""The faces of an atlas cell, with and without texture, as flat arrays: for figures and for pictures."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.flow.store import Store
from cityflow.geometry.polyhedron import FaceArrays, ring_area_vectors
from cityflow.handover.texture_files import ATLAS_CELL
from cityflow.io.city_models.gltf_surfaces import UNTEXTURED
from cityflow.runs.current import CurrentRecords
from cityflow.stages import atlas

SET = "raw"
"""The faces of both sets are the same; these coordinates are those of the photographs."""


@dataclass(frozen=True, slots=True, eq=False)
class AtlasCellFaces:
    """Faces of the units of an atlas cell.

    Attributes
    ----------
    arrays : corners and rings, local to `arrays.origin`
    uvd : (C, 3) of every corner; (0, 0, 1) where the face has no texture
    page : (F,) among `pages`, or `UNTEXTURED`
    colour : (F, 3) of faces without a texture, 0 to 255
    unit, reason : of each face; the reason why it has no texture
    gsd_m, interpolated : (F,) NaN where the face has no texture
    pages : files of the pages;  images : names of the photographs
    """

    arrays: FaceArrays
    uvd: FloatArray
    page: IntArray
    colour: IntArray
    unit: tuple[str, ...]
    reason: tuple[str, ...]
    gsd_m: FloatArray
    interpolated: FloatArray
    pages: tuple[str, ...]
    images: tuple[str, ...]

    def area_vectors(self) -> FloatArray:
        """(F, 3) outward normals times area, m², holes taken off."""
        rings = ring_area_vectors(self.arrays)
        return np.asarray(np.add.reduceat(rings, self.arrays.face_start[:-1], axis=0))


def atlas_cell_files(records: CurrentRecords) -> dict[str, str]:
    """Atlas cell → the file that says where each of its faces is."""
    return {r.unit: p for r in records.of(atlas.NAME) for p in r.outputs if p.endswith(f"/{ATLAS_CELL}")}


def read_atlas_cells(store: Store, paths: Iterable[str]) -> Iterator[AtlasCellFaces]:
    """Leaves with at least one face, in the order of the paths."""
    for _, data in store.read_many(paths):
        found = _faces(json.loads(data))
        if found is not None:
            yield found


def _faces(manifest: Mapping[str, Any]) -> AtlasCellFaces | None:
    made = manifest["sets"][SET]
    plain = [(unit, *row) for unit, rows in sorted(manifest["plain"].items()) for row in rows]
    rings = [f["rings"] for f in made["faces"]] + [r for _, r, _, _ in plain]
    if not rings:
        return None
    textured, bare = made["faces"], len(plain)
    nothing = np.full(bare, np.nan)
    corners = sum(len(ring) for row in plain for ring in row[1])
    uvd = _rows(f["uvd"] for f in textured)
    return AtlasCellFaces(
        _arrays(rings), np.concatenate([uvd, np.tile([0.0, 0.0, 1.0], (corners, 1))]),
        np.array([f["page"] for f in textured] + [UNTEXTURED] * bare, np.int64),
        np.array([(0, 0, 0)] * len(textured) + [colour for _, _, colour, _ in plain], np.int64).reshape(-1, 3),
        (*(f["unit"] for f in textured), *(unit for unit, *_ in plain)),
        (*("" for _ in textured), *(reason for *_, reason in plain)),
        np.concatenate([[f["figures"]["gsd_m"] for f in textured], nothing]),
        np.concatenate([[f["figures"]["interpolated"] for f in textured], nothing]),
        tuple(p["path"] for p in made["pages"]), tuple(manifest["images"]),
    )  # fmt: skip


def _arrays(faces: Sequence[Sequence[Sequence[Sequence[float]]]]) -> FaceArrays:
    """Rings of points as flat arrays, each face with corners of its own."""
    points = _rows(faces)
    ring_start = np.cumsum([0, *(len(ring) for face in faces for ring in face)])
    face_start = np.cumsum([0, *(len(face) for face in faces)])
    origin = points[0].copy()
    return FaceArrays(points - origin, origin, np.arange(len(points)), ring_start, face_start)


def _rows(faces: Iterable[Iterable[Sequence[Sequence[float]]]]) -> FloatArray:
    points = list(chain.from_iterable(chain.from_iterable(faces)))
    return np.array(points, np.float64).reshape(-1, 3)

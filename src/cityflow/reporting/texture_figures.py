"""Figures of textures for the report, from the atlas cells."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.flow.store import Store
from cityflow.io.city_models.gltf_surfaces import UNTEXTURED
from cityflow.reporting.atlas_cell_faces import SET, AtlasCellFaces, atlas_cell_files, read_atlas_cells
from cityflow.runs.current import CurrentRecords
from cityflow.stages import atlas, texture
from cityflow.survey.survey import Survey
from cityflow.viewer.texture_rows import MovedPhotograph, PlainFaces, SurfaceShare, TextureFigures

MOST_ATLAS_CELLS = 64
"""Of more, so many are read, evenly spread over the city: shares do not change for the others, but time would."""
UPRIGHT = 0.1
"""Faces whose normal climbs or falls by no more than this are façades."""
MOST_MOVED = 20
"""Photographs that are named."""
KINDS = ("roofs", "façades", "undersides")


@dataclass
class _Sums:
    """What is added up, atlas cell by atlas cell, so that no more than one atlas cell is in memory."""

    images: set[str] = field(default_factory=set)
    interpolated: float = 0.0
    area: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))
    textured: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))
    gsds: list[FloatArray] = field(default_factory=list)
    weights: list[FloatArray] = field(default_factory=list)
    plain: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))

    def add(self, atlas_cell: AtlasCellFaces) -> None:
        vectors = atlas_cell.area_vectors()
        area = np.linalg.norm(vectors, axis=1)
        wanted = (atlas_cell.page != UNTEXTURED) | np.array([bool(r) for r in atlas_cell.reason])
        has = atlas_cell.page != UNTEXTURED
        climb = vectors[:, 2] / np.maximum(area, 1e-12)
        for kind, of_kind in zip(KINDS, (climb > UPRIGHT, np.abs(climb) <= UPRIGHT, climb < -UPRIGHT), strict=True):
            self.area[kind] += float(area[wanted & of_kind].sum())
            self.textured[kind] += float(area[has & of_kind].sum())
        self.images |= set(atlas_cell.images)
        self.interpolated += float((area[has] * atlas_cell.interpolated[has]).sum())
        self.gsds.append(atlas_cell.gsd_m[has])
        self.weights.append(area[has])
        for reason, m2 in zip(atlas_cell.reason, area.tolist(), strict=True):
            if reason:
                self.plain[reason].append(m2)


@dataclass
class _Moved:
    """Photographs that were moved to the edges of models, by name: buildings, and sums of hundredths of pixels to the right and down, whole in any order."""

    sums: dict[str, list[int]] = field(default_factory=lambda: defaultdict(lambda: [0, 0, 0]))

    def counted(self, result: Mapping[str, Any]) -> int:
        """Textured faces of a building, whose photographs are added."""
        for name, (right, down) in (result.get("moved") or {}).items():
            more = 1, round(100 * right), round(100 * down)
            self.sums[name] = [a + b for a, b in zip(self.sums[name], more, strict=True)]
        return int(result.get("textured", 0))

    def rows(self) -> tuple[MovedPhotograph, ...]:
        rows = (
            MovedPhotograph(name, n, round(right / n / 100, 2), round(down / n / 100, 2))
            for name, (n, right, down) in self.sums.items()
        )
        return tuple(sorted(rows, key=lambda r: (-r.buildings, r.name)))


def texture_figures(store: Store, survey: Survey, records: CurrentRecords) -> TextureFigures | None:
    """None where the run makes no textures."""
    if not survey.textures:
        return None
    sums = _Sums()
    paths = sorted(atlas_cell_files(records).values())
    read = [
        paths[i] for i in np.linspace(0, len(paths) - 1, min(len(paths), MOST_ATLAS_CELLS)).round().astype(int).tolist()
    ]
    for atlas_cell in read_atlas_cells(store, read):
        sums.add(atlas_cell)
    # of a million buildings the results are gigabytes, so each goes when it is counted
    good = (r for r in records.as_stored(texture.NAME) if r.status in (Status.DONE, Status.DEGRADED))
    off = _Moved()
    faces = np.array([off.counted(r.result) for r in good], np.int64)
    textured = sum(sums.textured.values())
    shares = tuple(SurfaceShare(k, sums.area[k], sums.textured[k] / sums.area[k]) for k in KINDS if sums.area[k] > 0)
    plain = (PlainFaces(reason, len(areas), sum(areas)) for reason, areas in sums.plain.items())
    return TextureFigures(
        int(np.count_nonzero(faces)), len(faces), int(faces.sum()), shares,
        _median(sums.gsds, sums.weights), sums.interpolated / textured if textured else None, len(sums.images),
        sum(int((r.result.get(SET) or {}).get("pages", 0)) for r in records.as_stored(atlas.NAME)),
        tuple(sorted(plain, key=lambda p: (-p.area_m2, p.reason))), len(read), len(paths),
        off.rows()[:MOST_MOVED], len(off.sums),
    )  # fmt: skip


def _median(values: Sequence[FloatArray], weights: Sequence[FloatArray]) -> float | None:
    """Weighted median; None of nothing."""
    if not sum(len(v) for v in values):
        return None
    value, weight = np.concatenate(values), np.concatenate(weights)
    order = np.argsort(value, kind="stable")
    reached = np.searchsorted(np.cumsum(weight[order]), 0.5 * weight.sum())
    return float(value[order][min(int(reached), len(value) - 1)])

"""What the leaves of the atlas say of textures, as the report wants it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.flow.store import Store
from cityflow.stages import texture
from cityflow.stages.survey import Survey
from cityflow.viewer.texture_rows import PlainFaces, SurfaceShare, TextureFigures
from cityflow.workflow.current import CurrentRecords
from cityflow.workflow.leaf_faces import UNTEXTURED, LeafFaces, leaf_files, read_leaves

UPRIGHT = 0.1
"""Faces whose normal climbs or falls by no more than this are façades."""
KINDS = ("roofs", "façades", "undersides")


@dataclass
class _Sums:
    """What is added up, leaf by leaf, so that no more than one leaf is in memory."""

    units: set[str] = field(default_factory=set)
    images: set[str] = field(default_factory=set)
    pages: int = 0
    faces: int = 0
    interpolated: float = 0.0
    area: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))
    textured: dict[str, float] = field(default_factory=lambda: dict.fromkeys(KINDS, 0.0))
    gsds: list[FloatArray] = field(default_factory=list)
    weights: list[FloatArray] = field(default_factory=list)
    plain: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))

    def add(self, leaf: LeafFaces) -> None:
        vectors = leaf.area_vectors()
        area = np.linalg.norm(vectors, axis=1)
        wanted = (leaf.page != UNTEXTURED) | np.array([bool(r) for r in leaf.reason])
        has = leaf.page != UNTEXTURED
        climb = vectors[:, 2] / np.maximum(area, 1e-12)
        for kind, of_kind in zip(KINDS, (climb > UPRIGHT, np.abs(climb) <= UPRIGHT, climb < -UPRIGHT), strict=True):
            self.area[kind] += float(area[wanted & of_kind].sum())
            self.textured[kind] += float(area[has & of_kind].sum())
        self.units |= {u for u, textured in zip(leaf.unit, has.tolist(), strict=True) if textured}
        self.images |= set(leaf.images)
        self.pages += len(leaf.pages)
        self.faces += int(has.sum())
        self.interpolated += float((area[has] * leaf.interpolated[has]).sum())
        self.gsds.append(leaf.gsd_m[has])
        self.weights.append(area[has])
        for reason, m2 in zip(leaf.reason, area.tolist(), strict=True):
            if reason:
                self.plain[reason].append(m2)


def texture_figures(store: Store, survey: Survey, records: CurrentRecords) -> TextureFigures | None:
    """None where the run makes no textures."""
    if not survey.textures:
        return None
    sums = _Sums()
    for leaf in read_leaves(store, sorted(leaf_files(records).values())):
        sums.add(leaf)
    asked = sum(r.status in (Status.DONE, Status.DEGRADED) for r in records.of(texture.STAGE))
    textured = sum(sums.textured.values())
    shares = tuple(SurfaceShare(k, sums.area[k], sums.textured[k] / sums.area[k]) for k in KINDS if sums.area[k] > 0)
    plain = (PlainFaces(reason, len(areas), sum(areas)) for reason, areas in sums.plain.items())
    return TextureFigures(
        len(sums.units), max(asked, len(sums.units)), sums.faces, shares, _median(sums.gsds, sums.weights),
        sums.interpolated / textured if textured else None, len(sums.images), sums.pages,
        tuple(sorted(plain, key=lambda p: (-p.area_m2, p.reason))),
    )  # fmt: skip


def _median(values: Sequence[FloatArray], weights: Sequence[FloatArray]) -> float | None:
    """Weighted median; None of nothing."""
    if not sum(len(v) for v in values):
        return None
    value, weight = np.concatenate(values), np.concatenate(weights)
    order = np.argsort(value, kind="stable")
    reached = np.searchsorted(np.cumsum(weight[order]), 0.5 * weight.sum())
    return float(value[order][min(int(reached), len(value) - 1)])

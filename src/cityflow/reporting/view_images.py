"""Images of a building's textures and their shares, from the index pages of the atlas."""

from __future__ import annotations

import io
import json
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from cityflow.core.texture import FIRST_IMAGE
from cityflow.flow.store import Store
from cityflow.flow.task import Record, digest_of
from cityflow.handover.texture_files import ATLAS_CELL, PAGES, SETS
from cityflow.runs.current import CurrentRecords
from cityflow.stages import atlas

Json = Any
IMAGES_VERSION = 1
PAGES_OF = "rectified"


@dataclass(frozen=True, slots=True)
class AtlasCell:
    """An atlas cell: its name, its file that says where each face is, and a digest of all of it."""

    name: str
    path: str
    digest: str


def atlas_cells(records: CurrentRecords) -> list[AtlasCell]:
    """Leaves that have pages."""
    return [atlas_cell for record in records.of(atlas.NAME) for atlas_cell in _atlas_cell(record)]


def _atlas_cell(record: Record) -> Iterator[AtlasCell]:
    for path in record.outputs:
        if path.endswith(f"/{ATLAS_CELL}"):
            yield AtlasCell(record.unit, path, digest_of([IMAGES_VERSION, dict(record.outputs)]))


def page_pixels(records: CurrentRecords) -> dict[str, int]:
    """Pixels of all pages, by the set that they belong to: what a viewer's memory must hold, or shrink."""
    made = [record.result for record in records.of(atlas.NAME)]
    return {name: sum(int(found.get(name, {}).get("page_pixels", 0)) for found in made) for name in SETS}


def images_of_atlas_cell(store: Store, atlas_cell: AtlasCell) -> dict[str, list[list[Json]]]:
    """Unit → [image, share of the unit's textured pixels], the greatest first; nothing where the atlas cell's file is gone."""
    try:
        manifest = json.loads(store.read_bytes(atlas_cell.path))
    except FileNotFoundError:
        return {}
    made = manifest["sets"][PAGES_OF]
    counted: dict[str, Counter[int]] = {f["unit"]: Counter() for f in made["faces"]}
    for number in range(len(made["pages"])):
        index = _page(store, f"{PAGES}/{atlas_cell.name}.{PAGES_OF}.{number}.index.png")
        for face in (f for f in made["faces"] if f["page"] == number):
            counted[face["unit"]].update(_pixels(index, face["uvd"]))
    return {unit: _shares(count, manifest["images"]) for unit, count in sorted(counted.items())}


def _page(store: Store, path: str) -> NDArray[np.uint16]:
    """A page of the index; one pixel of nothing where somebody has removed it."""
    try:
        with Image.open(io.BytesIO(store.read_bytes(path))) as image:
            return np.asarray(image).astype(np.uint16)
    except (FileNotFoundError, UnidentifiedImageError):
        return np.zeros((1, 1), np.uint16)


def _pixels(index: NDArray[np.uint16], uvd: Json) -> Mapping[int, int]:
    """How many pixels of a face come from each entry of the index."""
    rows, cols = index.shape[:2]
    rings = [np.array([[u * cols, (1 - v) * rows] for u, v, _ in ring]) for ring in uvd]
    low = np.floor(np.concatenate(rings).min(axis=0)).astype(int).clip(0, [cols - 1, rows - 1])
    high = np.ceil(np.concatenate(rings).max(axis=0)).astype(int).clip(low + 1, [cols, rows])
    mask = np.zeros((high[1] - low[1], high[0] - low[0]), np.uint8)
    cv2.fillPoly(mask, [np.round(ring - low - 0.5).astype(np.int32) for ring in rings], 1)
    values, counts = np.unique(index[low[1] : high[1], low[0] : high[0]][mask > 0], return_counts=True)
    return dict(zip(values.tolist(), counts.tolist(), strict=True))


def _shares(count: Counter[int], names: Json) -> list[list[Json]]:
    """Shares to a tenth of a percent; what came from no image is not counted."""
    known = {names[i - FIRST_IMAGE]: n for i, n in count.items() if FIRST_IMAGE <= i < FIRST_IMAGE + len(names)}
    whole = sum(known.values())
    return [[name, round(n / whole, 3)] for name, n in sorted(known.items(), key=lambda e: (-e[1], e[0]))]

"""Sheets of models for the gallery: every kind of building of the synthetic towns, and some of a LiDAR survey, in plan and from three sides.

    python benchmarks/gallery.py OUT [--points drawn] [--methods model] [--delft DATA]

Evidence is that of `reconstruct_town.py` and `rare_models.py`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import shapely
from PIL import Image

from cityflow.core.arrays import ByteArray
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.evaluation.models import TrueModel, compare_model
from cityflow.evaluation.models_planes import model_surfaces
from delft_reconstruction import read_units
from reconstruct_methods import method_of
from town_models import CACHE, model_of, unit_names, unit_of
from unit_pictures import parts_of, side_view

TOWNS = ((7, 200), (11, 200), (13, 200), (1, 400), (2, 400))
TILE_PX, TEXT_PX = 240, 26
SIDES_DEG = (0.0, 120.0, 240.0)
ROWS, COLOURS = 6, 96
SHEETS = (
    ("houses", ("gable", "hip", "half-hip", "pyramid", "shed", "flat")),
    ("wings", ("L", "T", "terrace gable", "terrace flat", "corner pyramid", "corner flat")),
    ("large", ("church", "hall", "hall saw-tooth", "stepped", "tower", "slab")),
    ("round", ("round cone", "round flat", "curved gable", "curved flat", "garage")),
)


def first_of(shape: str, kind: str, cache: Path) -> tuple[int, Evidence, TrueModel] | None:
    """The unit of a shape with the most surfaces in the first town that has one."""
    for seed, size in TOWNS:
        names = [n for n, s in unit_names(seed, kind, size, cache, None) if s == shape]
        if names:
            units = [unit_of(seed, kind, n, size, cache, None) for n in names[:12]]
            evidence, truth = max(units, key=lambda pair: len(pair[1].surfaces))
            return seed, evidence, truth
    return None


def row_of(title: str, evidence: Evidence, candidate: Candidate) -> ByteArray:
    """(rows, cols, 3): a line of text above plan and three sides."""
    assert candidate.solid is not None
    tiles = [_fitted(plan_of(evidence, candidate))]
    tiles += [_fitted(side_view(parts_of(candidate), turn, 2 * TILE_PX)) for turn in SIDES_DEG]
    strip = np.concatenate(tiles, axis=1)
    text = np.full((TEXT_PX, strip.shape[1], 3), 255, np.uint8)
    cv2.putText(text, title, (6, TEXT_PX - 8), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (30, 30, 30), 1, cv2.LINE_AA)
    return np.concatenate([text, strip])


def plan_of(evidence: Evidence, candidate: Candidate) -> ByteArray:
    """The ortho (or heights of the points) with the edges of the model's roof."""
    x_0, y_0, x_1, y_1 = shapely.buffer(evidence.outline, 1.5).bounds
    scale = TILE_PX / max(x_1 - x_0, y_1 - y_0)
    rows, cols = round((y_1 - y_0) * scale), round((x_1 - x_0) * scale)
    if evidence.pictures:
        picture = evidence.pictures[0]
        x, y = np.meshgrid(x_0 + (np.arange(cols) + 0.5) / scale, y_1 - (np.arange(rows) + 0.5) / scale)
        col, row = (
            (x - picture.grid.x_min) / picture.grid.cell - 0.5,
            (picture.grid.y_max - y) / picture.grid.cell - 0.5,
        )
        pixels = np.ascontiguousarray(np.moveaxis(picture.pixels[:3], 0, -1)).astype(np.uint8)
        canvas = cv2.remap(pixels, col.astype(np.float32), row.astype(np.float32), cv2.INTER_LINEAR)
    else:
        canvas = _points(evidence, (x_0, y_1), scale, (rows, cols))
    assert candidate.solid is not None
    for polygon, _ in [s for part in parts_of(candidate) for s in model_surfaces(part)]:
        for ring in (polygon.exterior, *polygon.interiors):
            xy = shapely.get_coordinates(ring)
            corners = np.column_stack([(xy[:, 0] - x_0) * scale, (y_1 - xy[:, 1]) * scale])
            cv2.polylines(canvas, [np.rint(corners * 16).astype(np.int32)], True, (255, 255, 255), 1, cv2.LINE_AA, 4)
    return np.asarray(canvas, np.uint8)


def _points(evidence: Evidence, corner: tuple[float, float], scale: float, shape: tuple[int, int]) -> ByteArray:
    canvas = np.full((*shape, 3), 90, np.uint8)
    xyz = evidence.points.xyz
    low, high = np.percentile(xyz[:, 2], [2, 98])
    grey = (70 + 130 * np.clip((xyz[:, 2] - low) / max(high - low, 0.5), 0, 1)).astype(np.uint8)
    for (x, y, _), g in zip(xyz, grey, strict=True):
        place = int((x - corner[0]) * scale), int((corner[1] - y) * scale)
        cv2.circle(canvas, place, 1, (int(g), int(g) // 2 + 40, 60), -1)
    return canvas


def _fitted(picture: ByteArray) -> ByteArray:
    """Shrunk into a square tile."""
    scale = min(TILE_PX / picture.shape[0], TILE_PX / picture.shape[1])
    size = max(1, int(picture.shape[1] * scale)), max(1, int(picture.shape[0] * scale))
    small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
    tile = np.full((TILE_PX, TILE_PX, 3), 255, np.uint8)
    top, left = (TILE_PX - small.shape[0]) // 2, (TILE_PX - small.shape[1]) // 2
    tile[top : top + small.shape[0], left : left + small.shape[1]] = small
    return tile


def write(path: Path, rows: Sequence[ByteArray]) -> None:
    picture = Image.fromarray(np.concatenate(rows)).quantize(COLOURS, dither=Image.Dither.NONE)
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, optimize=True)
    print(path, path.stat().st_size // 1000, "kB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--points", default="drawn")
    parser.add_argument("--methods", default="model")
    parser.add_argument("--cache", type=Path, default=CACHE)
    parser.add_argument("--delft", type=Path)
    asked = parser.parse_args()
    method = method_of(asked.methods)
    for name, shapes in SHEETS:
        rows = []
        for shape in shapes:
            found = first_of(shape, asked.points, asked.cache)
            if found is None:
                continue
            seed, evidence, truth = found
            candidate = method(evidence)
            e = compare_model(truth, model_of(candidate))
            right = "" if e.type_right else f" (is {e.true_type})"
            title = (
                f"{shape}: {e.planes} of {e.true_planes} planes, {e.roof_type}{right}, {100 * e.surface.within:.1f} % within 15 cm, "
                f"RMSE {e.surface.rmse_3d_m:.3f} m, {candidate.method}"
            )
            print(f"town {seed} {evidence.id} {title} {e.fault}", flush=True)
            if candidate.solid is not None:
                rows.append(row_of(title, evidence, candidate))
        write(asked.out / f"gallery_{name}.png", rows)
    if asked.delft:
        _delft(asked.delft, asked.out, method)


def _delft(data: Path, out: Path, method: object) -> None:
    """Large and small ones, by area."""
    units = sorted(read_units(data), key=lambda u: -u.outline.area)
    rows = []
    for k in (0, 6, 20, 45, 90, 140):
        evidence = replace(units[min(k, len(units) - 1)])
        candidate = method(evidence)  # type: ignore[operator]
        if candidate.solid is None:
            continue
        kind = model_of(candidate).roof_type
        title = f"Delft: {evidence.outline.area:.0f} m2, {len(candidate.planes)} planes, {kind}, {candidate.method}"
        print(evidence.id, title, flush=True)
        rows.append(row_of(title, evidence, candidate))
    write(out / "gallery_delft.png", rows)


if __name__ == "__main__":
    main()

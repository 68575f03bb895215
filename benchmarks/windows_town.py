"""Windows of a synthetic town as a run has textured it, against the truth; those of a real survey, to look at; time for a page of an atlas.

python benchmarks/windows_town.py --survey SURVEY --run RUN [--picture FILE]                    # a town, photographed and textured
python benchmarks/windows_town.py --run RUN --picture FILE                                      # a real survey: what was found, to look at
python benchmarks/windows_town.py --atlas                                                       # time for an atlas of 2048 × 1024 pixels

Drawn façades: windows_facades.py.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from shapely import box

from cityflow.core.arrays import BoolArray, FloatArray
from cityflow.core.building import Semantic
from cityflow.core.openings import FaceOpenings
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, FaceFigures, FacePlane, Patch, UnitTexture
from cityflow.evaluation.window_accuracy import WindowCounts, compare_windows, on_face, total
from cityflow.handover.texture_files import decode_unit
from cityflow.stages.windows import planes_of
from cityflow.synthetic.town_facades import WINDOW
from cityflow.windows.facade_picture import picture_of
from cityflow.windows.find_windows import find_unit_windows, find_windows
from cityflow.windows.window_parameters import WindowParameters
from scenes.drawn_facades import STYLES, DrawnFacade, draw_facade
from scenes.facade_errors import ImageErrors

WHOLE = 0.8
"""Share of a true window that a picture has to show before it is asked for."""
SHEET_CELL_M, SHEET_PX = 0.05, (1600, 1100)
YELLOW, CYAN, MAGENTA = (255, 235, 0), (0, 255, 255), (255, 0, 255)


def as_texture(drawn: DrawnFacade) -> tuple[FacePlane, Patch]:
    """A drawn façade as the texture of a wall."""
    wide, high = drawn.size_m
    ring = np.array([[0, 0, 0], [wide, 0, 0], [wide, 0, high], [0, 0, high]], float)
    axes = np.eye(3)
    face = FacePlane(
        ("solid", 0), Semantic.WALL, (ring,), np.zeros(3), axes[0], axes[2], -axes[1], box(0, 0, wide, high)
    )
    corners = np.column_stack([ring[:, 0] / drawn.cell_m, (high - ring[:, 2]) / drawn.cell_m, np.ones(4)])
    index = np.where(drawn.seen, FIRST_IMAGE, INTERPOLATED).astype(np.uint16)
    figures = FaceFigures(drawn.cell_m, 45.0, 1, 1, 0.0, 1 - float(drawn.seen.mean()))
    return face, Patch(face.key, drawn.pixels, index, np.ones_like(drawn.seen), (corners,), figures)


def windows_of(found: FaceOpenings) -> FloatArray:
    return np.array([o.bounds for o in found.openings if o.kind == "window"]).reshape(-1, 4)


def judged_facade(drawn: DrawnFacade, found: FaceOpenings) -> WindowCounts:
    of = drawn.openings[:, 4] == WINDOW
    return compare_windows(windows_of(found), drawn.openings[of][:, [0, 2, 1, 3]], drawn.visible[of] >= WHOLE)


def figures_of(c: WindowCounts) -> dict[str, float]:
    return {
        "precision": round(c.precision, 3), "recall": round(c.recall, 3), "found": c.found, "true": c.true,
        "mean IoU": round(c.iou / c.right, 3) if c.right else 0.0,
    }  # fmt: skip


def units_of(run: Path) -> Iterator[tuple[str, UnitTexture, tuple[FacePlane, ...]]]:
    """Units of a run with their textures."""
    for folder in sorted((run / "work" / "texture").iterdir()):
        newest = max(folder.glob("*/texture.cfa"), key=lambda p: p.stat().st_mtime, default=None)
        if newest is not None:
            texture, rings = decode_unit(newest.read_bytes())
            yield folder.name, texture, planes_of(rings)


def run_table(run: Path, survey: Path | None, picture: Path | None) -> None:
    """Windows of all units; with a survey, against the town that it was made from."""
    truth = None if survey is None else TownTruth(survey, run)
    counts, pictures, seconds, ratios, storeys = [], [], [], [], []
    for _, texture, faces in units_of(run):
        patches = {p.key: p for p in texture.rectified}
        begun = time.process_time()
        unit = find_unit_windows(faces, patches, WindowParameters())
        seconds.append(time.process_time() - begun)
        ratios.append(unit.window_to_wall_ratio)
        storeys.append(unit.storeys)
        planes = {f.key: f for f in faces}
        for found in unit.faces:
            face, patch = planes[found.key], patches[found.key]
            if truth is not None:
                counts.append(truth.judged(face, patch, texture.images, found))
            if found.seen_m2 > 6:
                cell, s_min, t_max = placed(face, patch)
                pictures.append(shown(patch, found, cell, (s_min, t_max)))
    known = [r for r in ratios if r is not None]
    print(json.dumps({
        "units": len(seconds), **(figures_of(total(counts)) if truth is not None else {}), "seconds a unit, median": round(float(np.median(seconds)), 3),
        "most": round(max(seconds), 2), "windows to walls, median": round(float(np.median(known)), 3) if known else None,
        "storeys": {str(k): storeys.count(k) for k in sorted(set(storeys), key=str)},
    }))  # fmt: skip
    sheet(pictures, picture)


def placed(face: FacePlane, patch: Patch) -> tuple[float, float, float]:
    parameters = WindowParameters(finest_m=0.001)
    p = picture_of(face, patch, parameters)
    return p.cell, p.s_min, p.t_max


class TownTruth:
    """Windows of a synthetic town, and what of them the images of a run show."""

    def __init__(self, survey: Path, run: Path) -> None:
        from cityflow.synthetic.town import make_town
        from cityflow.synthetic.town_mesh import opening_corners
        from texture_visibility import Truth
        from texture_world import images_of, parameters_of

        p = parameters_of(survey)
        town = make_town(p.seed, p.whole_town)
        walls = [w for w in town.walls if len(w.openings)]
        self.corners = np.concatenate([opening_corners(w, 0.0)[w.openings[:, 4] == WINDOW] for w in walls])
        self.truth = Truth(town.mesh())
        self.centres = {i.image.name: i.image.centre for i in images_of(survey / "catalog", run)}

    def judged(self, face: FacePlane, patch: Patch, images: Sequence[str], found: FaceOpenings) -> WindowCounts:
        bounds, on = on_face(face, self.corners, 0.6)
        inside = bounds[:, :2] >= np.array(face.polygon.bounds[:2]) - 0.2
        on &= inside.all(axis=1) & (bounds[:, 2:] <= np.array(face.polygon.bounds[2:]) + 0.2).all(axis=1)
        visible = np.array([self._visible(face, patch, images, c) >= WHOLE for c in self.corners[on]], bool)
        return compare_windows(windows_of(found), bounds[on], visible)

    def _visible(self, face: FacePlane, patch: Patch, images: Sequence[str], corners: FloatArray) -> float:
        """Share of a window that is in the texture, and that the image there truly sees."""
        a, b = np.meshgrid(np.linspace(0.1, 0.9, 5), np.linspace(0.1, 0.9, 5))
        xyz = corners[0] + a.reshape(-1, 1) * (corners[1] - corners[0]) + b.reshape(-1, 1) * (corners[3] - corners[0])
        cell, s_min, t_max = placed(face, patch)
        st = face.on_plane(xyz)
        col, row = ((st[:, 0] - s_min) / cell).astype(int), ((t_max - st[:, 1]) / cell).astype(int)
        inside = (col >= 0) & (row >= 0) & (col < patch.index.shape[1]) & (row < patch.index.shape[0])
        index = np.zeros(len(xyz), int)
        index[inside] = patch.index[row[inside], col[inside]]
        return float(self._free(face, images, xyz, index).mean())

    def _free(self, face: FacePlane, images: Sequence[str], xyz: FloatArray, index: np.ndarray) -> BoolArray:
        free = np.zeros(len(xyz), bool)
        for value in np.unique(index[index >= FIRST_IMAGE]).tolist():
            of = index == value
            free[of] = self.truth.free(
                xyz[of] + 0.03 * face.normal, face.normal, self.centres[images[value - FIRST_IMAGE]]
            )
        return free


def shown(patch: Patch, found: FaceOpenings, cell: float, corner: tuple[float, float]) -> np.ndarray:
    """A façade with its windows (yellow; completed ones cyan) and doors (magenta)."""
    scale = cell / SHEET_CELL_M
    pixels = np.where(
        (patch.index >= FIRST_IMAGE)[..., None], patch.pixels, patch.pixels // 2 + np.array([90, 90, 110], np.uint8)
    )
    image = cv2.resize(pixels.astype(np.uint8), None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)
    for o in found.openings:
        s_0, t_0, s_1, t_1 = o.bounds
        at = [round(v / SHEET_CELL_M) for v in (s_0 - corner[0], corner[1] - t_1, s_1 - corner[0], corner[1] - t_0)]
        colour = MAGENTA if o.kind == "door" else CYAN if o.completed else YELLOW
        cv2.rectangle(image, (at[0], at[1]), (at[2], at[3]), colour, 1)
    return image


def sheet(pictures: Sequence[np.ndarray], path: Path | None) -> None:
    if path is None:
        return
    wide, high = SHEET_PX
    page = np.full((high, wide, 3), 255, np.uint8)
    x = y = row = 0
    for image in pictures:
        image = image[: high // 3, : wide // 2]
        if x + image.shape[1] > wide:
            x, y, row = 0, y + row + 6, 0
        if y + image.shape[0] > high:
            break
        page[y : y + image.shape[0], x : x + image.shape[1]] = image
        x, row = x + image.shape[1] + 6, max(row, image.shape[0])
    cv2.imwrite(str(path), page[:, :, ::-1])


def atlas_time() -> None:
    """Façades that fill a page of 2048 × 1024 pixels at 5 cm, as the paper timed one."""
    rng, left, seconds, count = np.random.default_rng(1), 2048 * 1024, 0.0, 0
    while left > 0:
        drawn = draw_facade(STYLES[count % len(STYLES)], ImageErrors(gsd_m=0.05), rng)  # type: ignore[arg-type]
        face, patch = as_texture(drawn)
        begun = time.process_time()
        find_windows(face, patch, WindowParameters())
        seconds, left, count = seconds + time.process_time() - begun, left - drawn.seen.size, count + 1
    print(json.dumps({"façades": count, "pixels": 2048 * 1024 - left, "seconds of one core": round(seconds, 2)}))


def main() -> None:
    cv2.setNumThreads(1)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--survey", type=Path)
    parser.add_argument("--run", type=Path)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--atlas", action="store_true")
    asked = parser.parse_args()
    if asked.run is not None:
        run_table(asked.run, asked.survey, asked.picture)
    if asked.atlas:
        atlas_time()


if __name__ == "__main__":
    main()

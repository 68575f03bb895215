"""Terraces put together from given footprints and split again from LiDAR alone, on a real survey.

    python benchmarks/split_delft.py [FOLDER] [PICTURES]

FOLDER holds the survey's .laz files and one .gpkg of footprints. Footprints that stand wall to wall are united, every complex is
split, and the cut lines are judged against the borders between the footprints (`evaluation.units`). Sheds are footprints, too, but
smaller than any unit is allowed to be: borders between footprints of at least 20 m² are judged, and all of them as a second figure.
PICTURES: a folder for one picture of each complex.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import shapely
from shapely import LineString, Polygon

from cityflow.core.building import Outline
from cityflow.core.grid import grown
from cityflow.core.local_frame import LocalFrame
from cityflow.core.points import PointCloud, concatenate
from cityflow.core.reference import Reference
from cityflow.core.splitting import FrameRasters, SplitEvidence, Splitting
from cityflow.evaluation.outlines import united_by_adjacency
from cityflow.evaluation.unit_accuracy import FoundUnits, UnitsAccuracy, UnitsParameters, compare_units
from cityflow.evaluation.unit_borders import Border, borders_of
from cityflow.io.points.las import read_points
from cityflow.io.tables.vector import read_polygons
from cityflow.outlines.given.given import clean_outlines
from cityflow.outlines.noded.noding import node_outlines
from cityflow.splitting.split import SplitParameters, split
from cityflow.surface.sample import sample
from cityflow.surface.tile_surface import SurfaceParameters, TileSurface, surface_of_tile

DELFT = Path(__file__).parents[1] / "catalogs" / "delft" / "data"
RD_NEW = Reference("EPSG:7415", 28992, 5709, "Amersfoort / RD New + NAP height")
NADIR = LocalFrame("nadir", np.eye(3), np.zeros(3))
AROUND_M = 2.0
UNIT_M2 = 20.0
"""Smallest unit that splitting may make."""
STEP_M = 0.5
"""A border with a step this high in the points is one that LiDAR can show."""
BESIDE_M = (0.4, 2.0)


def footprints(path: Path) -> list[Polygon]:
    """Cleaned and noded as those of a run are."""
    clean, _ = clean_outlines([Outline("", p) for p in read_polygons(path, RD_NEW)])
    return [o.polygon for o in node_outlines(clean)]


def surface_over(points: PointCloud) -> TileSurface:
    """Of the whole survey at once: it is one small tile."""
    low, high = np.floor(points.xyz[:, :2].min(axis=0)), np.ceil(points.xyz[:, :2].max(axis=0))
    parameters = SurfaceParameters()
    return surface_of_tile(points, (*low.tolist(), *high.tolist()), parameters.halo_m, parameters)


def evidence_of(name: str, outline: Polygon, points: PointCloud, surface: TileSurface) -> SplitEvidence:
    xy = shapely.get_coordinates(shapely.segmentize(outline, 1.0))
    ground = float(np.nanmin(sample(surface.grid, surface.dtm, xy[:, 0], xy[:, 1])))
    frame = FrameRasters(NADIR, surface.grid, surface.dsm_filled)
    return SplitEvidence(name, outline, (frame,), ground, points.within(grown(outline.bounds, AROUND_M)))


@dataclass(frozen=True)
class Complex:
    outline: Polygon
    result: Splitting
    seconds: float


def split_all(outlines: Sequence[Polygon], points: PointCloud, surface: TileSurface) -> list[Complex]:
    found = []
    for number, outline in enumerate(outlines):
        evidence = evidence_of(str(number), outline, points, surface)
        start = time.process_time()
        result = split(evidence, SplitParameters())
        found.append(Complex(outline, result, time.process_time() - start))
    return found


def judged(found: Sequence[Complex], units: Sequence[Polygon], least_m2: float) -> UnitsAccuracy:
    """Lines along borders of smaller footprints are neither right nor wrong: no unit may be so small."""
    large = [u for u in units if u.area >= least_m2]
    lines = [c.line for f in found for c in f.result.cut_lines]
    small = [b for b in borders_of(units) if min(units[k].area for k in b.units) < least_m2]
    kept = [line for line in lines if not _along_any(line, small)]
    everything = FoundUnits([f.outline for f in found], [u for f in found for u in f.result.units], kept)
    return compare_units(everything, large, borders_of(large), UnitsParameters())


def _along_any(line: LineString, borders: Sequence[Border]) -> bool:
    near = [shapely.intersection(line, shapely.buffer(b.line, 1.0)).length for b in borders]
    return bool(near) and max(near) > 0.5 * line.length


def step_across(line: LineString, points: PointCloud) -> float:
    """Difference of the median heights on both sides of a border, the largest of three parts along it, metres."""
    p, q = shapely.get_coordinates(line)[[0, -1]]
    length = float(np.hypot(*(q - p)))
    along = (q - p) / max(length, 1e-9)
    xy = points.xyz[:, :2] - p
    u, v = xy @ along, xy @ np.array([-along[1], along[0]])
    steps = [0.0]
    for k in range(3):
        part = (u > k * length / 3) & (u < (k + 1) * length / 3) & (np.abs(v) > BESIDE_M[0]) & (np.abs(v) < BESIDE_M[1])
        left, right = points.xyz[part & (v > 0), 2], points.xyz[part & (v < 0), 2]
        if len(left) > 5 and len(right) > 5:
            steps.append(abs(float(np.median(left) - np.median(right))))
    return max(steps)


def report(name: str, a: UnitsAccuracy) -> None:
    print(
        f"{name:<34}{a.all_borders.borders:5d}{a.all_borders.hits:6d}{len(a.missed):7d}{len(a.false_alarms):6d}"
        f"{a.all_borders.share:8.2f}{a.false_share:7.2f}{a.position_m:7.2f}{a.angle_deg:7.2f}{a.iou_mean:7.2f}{a.same_share:7.2f}"
    )


def by_step(a: UnitsAccuracy, borders: Sequence[Border], points: PointCloud) -> None:
    """Which borders LiDAR shows at all."""
    counted = sorted({h.border for h in a.hits} | set(a.missed))
    steps = {k: step_across(borders[k].line, points) for k in counted}
    hit = {h.border for h in a.hits}
    for text, chosen in (
        (f"step of {STEP_M:g} m or more", [k for k in counted if steps[k] >= STEP_M]),
        ("lower step or none", [k for k in counted if steps[k] < STEP_M]),
    ):
        print(f"  borders with {text}: {sum(k in hit for k in chosen)} of {len(chosen)} hit")


def picture(found: Complex, units: Sequence[Polygon], surface: TileSurface, path: Path) -> None:
    """Shaded surface, footprints' borders white, accepted lines red, rejected candidates blue."""
    scale = 16
    x_min, y_min, x_max, y_max = grown(found.outline.bounds, AROUND_M)
    row_0, col_0 = surface.grid.indices(np.array([x_min]), np.array([y_max]))
    row_1, col_1 = surface.grid.indices(np.array([x_max]), np.array([y_min]))
    part = surface.dsm_filled[int(row_0[0]) : int(row_1[0]) + 1, int(col_0[0]) : int(col_1[0]) + 1]
    gy, gx = np.gradient(part)
    shade = np.clip(140 + 60 * (gx + gy) + 4 * (part - np.nanmean(part)), 20, 235)
    image = cv2.cvtColor(
        cv2.resize(np.nan_to_num(shade).astype(np.uint8), None, fx=scale, fy=scale), cv2.COLOR_GRAY2BGR
    )
    corner = np.array(
        [surface.grid.x_min + col_0[0] * surface.grid.cell, surface.grid.y_max - row_0[0] * surface.grid.cell]
    )

    def draw(line: LineString, colour: tuple[int, int, int], width: int) -> None:
        xy = (shapely.get_coordinates(line) - corner) * [1, -1] * scale / surface.grid.cell
        cv2.polylines(image, [np.round(xy).astype(np.int32)], False, colour, width, cv2.LINE_AA)

    for unit in units:
        if unit.intersects(found.outline):
            draw(unit.exterior, (255, 255, 255), 5)
    for cut in found.result.rejected:
        draw(cut.line, (255, 120, 0), 1)
    for cut in found.result.cut_lines:
        draw(cut.line, (0, 0, 255), 2)
    cv2.imwrite(str(path), image)


def main(folder: Path, pictures: Path | None) -> None:
    cv2.setNumThreads(1)
    points = concatenate([read_points(p) for p in sorted(folder.rglob("*.laz"))])
    units = footprints(next(iter(sorted(folder.rglob("*.gpkg")))))
    surface = surface_over(points)
    found = split_all(united_by_adjacency(units), points, surface)
    print(f"{'':<34} true  hits missed false  sensit. false%  pos.   angle    IoU  >0.7")
    for name, least in ((f"footprints of {UNIT_M2:g} m² or more", UNIT_M2), ("all footprints", 0.0)):
        accuracy = judged(found, units, least)
        report(name, accuracy)
        by_step(accuracy, borders_of([u for u in units if u.area >= least]), points)
    seconds = np.array([f.seconds for f in found])
    print(f"{len(found)} complexes, seconds each: median {np.median(seconds):.2f}, longest {seconds.max():.2f}")
    print("not split:", dict(Counter(f.result.reason for f in found if f.result.reason)))
    for number, f in enumerate(found if pictures else []):
        if f.outline.area > 2 * UNIT_M2 and pictures is not None:
            picture(f, units, surface, pictures / f"complex_{number:03d}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else DELFT, Path(sys.argv[2]) if len(sys.argv) > 2 else None)

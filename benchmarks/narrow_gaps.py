"""Blocks that stand close together, scanned from the air: are they found as two, and blocks without a gap as one?

    python benchmarks/narrow_gaps.py [--seeds 11 12 13]

Each seed makes nine pairs of blocks (flat, gabled, of unlike heights and depths) for each width of gap, at headings of their own. Told are
the share of pairs that came out as asked, and the mean IoU of each block.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.core.points import PointCloud
from cityflow.evaluation.outlines import compare_outlines
from cityflow.outlines.find_outlines import RegionSurface, find_outlines
from cityflow.surface.tile_surface import surface_of_tile
from cityflow.synthetic import roofs
from cityflow.synthetic.known_terrain import make_terrain, unbroken
from cityflow.synthetic.roofs import LocalFace, Placement
from cityflow.synthetic.town_lidar import TownLidarParameters, town_lidar
from scenes import simple_roofs
from scenes.prism_scene import PrismScene, TruthBuilding, trees_beside

GAPS_M = (0.0, 0.8, 1.1, 1.5, 2.0)
PITCH_M, SIDE = 56.0, 3
SOUTH_WEST = 85000.0, 447000.0


@dataclass(frozen=True)
class Pairs:
    """A survey of pairs of blocks, and the truth."""

    points: PointCloud
    bounds: tuple[float, float, float, float]
    pairs: tuple[tuple[Polygon, Polygon], ...]


def pairs_of_blocks(seed: int, gap_m: float, density_m2: float) -> Pairs:
    """The houses depend on the seed alone; the gap moves the second of each pair away from the first."""
    size = PITCH_M * SIDE
    rng = np.random.default_rng([seed, 5])
    bounds = (*SOUTH_WEST, SOUTH_WEST[0] + size, SOUTH_WEST[1] + size)
    terrain = unbroken(make_terrain(rng, bounds, 0.0))
    buildings: list[TruthBuilding] = []
    for number in range(SIDE * SIDE):
        buildings += _pair(rng, terrain.z, (bounds[0], bounds[1]), number, gap_m)
    scene = PrismScene(bounds, terrain, tuple(buildings), trees_beside(rng, terrain, buildings))
    scan = town_lidar(scene, seed, TownLidarParameters(density_m2=density_m2))
    shapes = [b.outline for b in buildings]
    return Pairs(scan.points, bounds, tuple(zip(shapes[::2], shapes[1::2], strict=True)))


def _pair(rng, ground, corner, number: int, gap_m: float) -> list[TruthBuilding]:  # type: ignore[no-untyped-def]
    heading = float(rng.uniform(0, np.pi))
    middle = [c + PITCH_M * (k + 0.5) for c, k in zip(corner, divmod(number, SIDE), strict=True)]
    lengths, depths = rng.uniform(10, 18, 2), rng.uniform(9, 14, 2)
    eave = float(rng.uniform(4, 15))
    eaves, gabled = (eave, eave + float(rng.choice([0.0, 0.0, 1.5]))), bool(rng.random() < 0.5)
    slope, shift = float(np.tan(np.radians(rng.uniform(20, 45)))), float(rng.uniform(0, 2))
    made = []
    for k in range(2):
        u_0 = -float(lengths[0]) if k == 0 else gap_m
        u_1, v_0 = u_0 + float(lengths[k]), -float(depths[k]) / 2 + shift * k
        v_1 = v_0 + float(depths[k])
        ring = roofs.rectangle(u_0, v_0, u_1, v_1)
        faces = (
            simple_roofs.gable(u_0, u_1, (v_0, v_1), eaves[k], slope) if gabled else [LocalFace(ring, 0, 0, eaves[k])]
        )
        z = float(ground(np.array([middle[0]]), np.array([middle[1]]))[0])
        place = Placement(middle[0], middle[1], heading, round(z, 2))
        outline = orient(Polygon(place.to_world(ring)))
        prisms = tuple(place.face(f) for f in faces)
        made.append(TruthBuilding(f"p{number}{k}", "block", outline, prisms, prisms, z))
    return made


def measured(seed: int, gap_m: float, density_m2: float) -> tuple[float, float, float]:
    """Share of pairs that came out as asked, mean IoU of each block, number found over number asked."""
    made = pairs_of_blocks(seed, gap_m, density_m2)
    s = surface_of_tile(made.points, made.bounds, 0.0)
    surface = RegionSurface(s.grid, s.ndsm, s.klass, s.holes, None, s.count.astype(np.uint32), None, s.dtm)
    found = [o.polygon for o in find_outlines(surface)]
    true = [b for pair in made.pairs for b in pair] if gap_m else [shapely.union_all(list(p)) for p in made.pairs]
    right = 0
    for pair in made.pairs:
        near = [f for f in found if f.intersects(shapely.union_all(list(pair)))]
        right += len(near) == (2 if gap_m else 1)
    return right / len(made.pairs), compare_outlines(found, true).iou_mean, len(found) / len(true)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[11, 12, 13])
    parser.add_argument("--densities", type=float, nargs="+", default=[8.0, 20.0])
    asked = parser.parse_args()
    print("| pulses per m² | gap m | pairs as asked | IoU of each | found over true |")
    for density in asked.densities:
        for gap in GAPS_M:
            rows = np.array([measured(s, gap, density) for s in asked.seeds])
            print(
                "| " + " | ".join([f"{density:g}", f"{gap:g}", *(f"{v:.3f}" for v in rows.mean(axis=0))]) + " |",
                flush=True,
            )


if __name__ == "__main__":
    main()

"""Parameters judged on a survey without truth: a third of the roof points is held back, models are made from the others.

    python benchmarks/held_back_points.py DATA [--keep 1.0 0.1] [--set orientation_histogram.unevenness=0.04]

DATA holds LAZ files with a building class. Outlines are rough: what lies within 0.6 m of building points, less that margin. A held-back point costs
what a point costs in the labelling: its squared distance in sigmas of 5 cm, halved, at most 4.5. `--keep`: share of the other points that is used.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import laspy
import numpy as np
import shapely

from changed_parameters import changed_parameters
from cityflow.core.arrays import FloatArray
from cityflow.core.points import BUILDING, PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.evaluation.roof_points import unit_distances
from cityflow.geometry.roof_distances import NEAR
from cityflow.reconstruction.choose import choose
from cityflow.reconstruction.planes.plane_labels import OUTLIER
from drawn_town import table

AROUND_M, LEAST_M2, SIGMA_M, HELD_BACK = 0.6, 25.0, 0.05, 1 / 3


def read_units(folder: Path, keep: float) -> list[tuple[Evidence, FloatArray]]:
    """Evidence and held-back points of every patch of building points."""
    clouds = [laspy.read(path) for path in sorted(folder.glob("*.la[sz]"))]
    xyz = np.concatenate([np.stack([c.x, c.y, c.z], axis=1)[np.asarray(c.classification) == BUILDING] for c in clouds])
    patches = shapely.union_all(shapely.buffer(shapely.points(xyz[:, :2]), AROUND_M, quad_segs=2)).buffer(-AROUND_M)
    draw = np.random.default_rng(0).random((len(xyz), 2))
    units: list[tuple[Evidence, FloatArray]] = []
    for patch in shapely.get_parts(patches.buffer(0).simplify(0.3)):
        outline = shapely.geometry.polygon.orient(patch) if isinstance(patch, shapely.Polygon) else shapely.Polygon()
        if outline.area < LEAST_M2:
            continue
        inside = shapely.contains_xy(outline, xyz[:, 0], xyz[:, 1])
        held = inside & (draw[:, 0] < HELD_BACK)
        used = xyz[inside & ~held & (draw[:, 1] < keep)]
        floor = float(xyz[inside, 2].min()) - 3
        units.append((Evidence(f"{len(units)}", outline, PointCloud.of(used, BUILDING), floor), xyz[held]))
    return units


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("data", type=Path)
    options.add_argument("--keep", type=float, nargs="+", default=[1.0, 0.1])
    options.add_argument(
        "--set", action="append", nargs="*", metavar="KEY=VALUE", help="a row with these values; again for another row"
    )
    asked = options.parse_args()
    rows = []
    for keep in asked.keep:
        units = read_units(asked.data, keep)
        for pairs in asked.set or [[]]:
            parameters = changed_parameters(pairs)
            choices = [choose(evidence, parameters) for evidence, _ in units]
            away = np.concatenate(
                [
                    unit_distances(e.outline, c.candidate.solid, held)
                    for (e, held), c in zip(units, choices, strict=True)
                ]
            )
            cost = np.minimum(np.nan_to_num(away, nan=np.inf) ** 2 / (2 * SIGMA_M**2), OUTLIER)
            planes = sum(len(c.candidate.planes) for c in choices)
            rows.append(
                [
                    f"{keep:g}",
                    " ".join(pairs),
                    str(len(units)),
                    str(planes),
                    f"{np.mean(np.abs(away) <= NEAR):.1%}",
                    f"{cost.mean():.3f}",
                ]
            )
    table("held-back points", ["keep", "parameters", "units", "planes", "within 20 cm", "nats a point"], rows)


if __name__ == "__main__":
    main()

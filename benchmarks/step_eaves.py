"""Eaves over lower roofs of the same unit, against those of a synthetic town.

python benchmarks/step_eaves.py --seeds 41 [--level 2] [--size 250]     # exact points of five heads with noise, true outlines
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import numpy as np
import shapely
from shapely import Polygon

from cityflow.core.arrays import FloatArray
from cityflow.evaluation.models_overhangs import (
    BARE_SHARE,
    INVENTED_M,
    NONE_M,
    STATED_SHARE,
    found_overhang,
    true_overhang,
    wall_edges,
)
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.synthetic.roofs import HULL_KINDS
from cityflow.synthetic.town import TownParameters, make_town
from cityflow.synthetic.town_shapes import Volume
from cityflow.synthetic.town_units import Unit
from discontinuities import Views

DROP_M, OUT_M, PLACES = 1.5, 0.05, 9
"""A lower roof is at least so far below the higher one beyond the wall; both are looked at in so many places of an edge."""
GSD_M, NEAR_M = 0.12, 0.1


def true_eaves(unit: Unit) -> list[tuple[FloatArray, FloatArray, float]]:
    """Ends of each wall of a higher body that stands over a lower roof along all of its length, world, and how far its roof stands out there."""
    volumes = [v for v in unit.volumes if v.kind in HULL_KINDS]
    found = []
    for own in volumes:
        walls = Polygon(unit.frame.to_world([*own.ring]))
        roof = shapely.union_all([Polygon(unit.frame.to_world([*f.ring])) for f in own.faces], grid_size=1e-4)
        others = [v for v in volumes if v is not own]
        for a, b in wall_edges(shapely.geometry.polygon.orient(walls)):
            along = (b - a) / np.hypot(*(b - a))
            out = OUT_M * np.array([along[1], -along[0]])
            at = a + np.linspace(0.05, 0.95, PLACES)[:, None] * (b - a)
            beyond, inside = (
                [_highest(unit, of, xy) for xy in at + way * out] for of, way in ((others, 1), ([own], -1))
            )
            if np.all(np.array(beyond) < np.array(inside) - DROP_M) and np.all(np.isfinite(beyond)):
                found.append((a, b, true_overhang(a, b, roof)))
    return found


def _highest(unit: Unit, volumes: Sequence[Volume], xy: FloatArray) -> float:
    """Height of the volumes' roofs within their walls over the base; −∞ where there is none."""
    u, v = _own(unit, xy)
    tops = [
        f.slope_u * u + f.slope_v * v + f.height
        for one in volumes
        for f in one.faces
        if shapely.contains_xy(Polygon(one.ring), u, v) and shapely.contains_xy(Polygon(f.ring), u, v)
    ]
    return max(tops, default=-np.inf)


def _own(unit: Unit, xy: FloatArray) -> FloatArray:
    """World plan to the unit's own."""
    origin, u, v = unit.frame.to_world([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    return np.asarray(np.linalg.solve(np.column_stack([u - origin, v - origin]), xy - origin))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[41])
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument(
        "--eaves", type=float, default=0.5, help="share of buildings whose highest floors stand back that have them"
    )
    parser.add_argument("--size", type=int, default=250)
    parser.add_argument("--most", type=int, default=1000, help="units")
    parser.add_argument("--count", action="store_true", help="only the true ones")
    asked = parser.parse_args()
    for seed in asked.seeds:
        town = make_town(
            seed,
            TownParameters(width_m=asked.size, height_m=asked.size, level=asked.level, eaves=asked.eaves, relief=0.2),
        )
        units = [(u, e) for u in town.units if (e := true_eaves(u))][: asked.most]
        count = sum(r > NONE_M for _, e in units for *_, r in e)
        print(
            f"seed {seed}: {len(units)} units with steps, {count} edges with eaves, {sum(len(e) for _, e in units) - count} without"
        )
        print(sorted({u.shape for u, _ in units}), [round(r, 2) for _, e in units for *_, r in e if r > NONE_M])
        if asked.count:
            continue
        views, seconds = Views(town), 0.0
        true, stated, bare = list[float](), list[float](), list[float]()
        for unit, eaves in units:
            begun = time.process_time()
            candidate = model(views.evidence(unit, seed), ModelParameters()).candidate
            seconds += time.process_time() - begun
            for a, b, reach in eaves:
                has = reach > NONE_M
                got = found_overhang(a, b, candidate.overhangs, STATED_SHARE if has else BARE_SHARE)
                (bare if not has else stated).append(got)
                true += [reach] if has else []
            print(unit.id, unit.shape, candidate.method, candidate.notes.get("step_eaves", 0), flush=True)
        t, s = np.array(true), np.array(stated)
        off, wrong = np.abs(s - t)[s > 0], np.count_nonzero(np.array(bare) > INVENTED_M)
        middle = 100 * np.median(off) if len(off) else np.nan
        print(f"  stated {len(off)} of {len(s)}; off by {middle:.1f} cm in the median, within", end=" ")
        print(
            f"2 GSD {np.count_nonzero(off <= 2 * GSD_M)}, 10 cm {np.count_nonzero(off <= NEAR_M)}; invented {wrong} of {len(bare)}; {seconds:.0f} s"
        )


if __name__ == "__main__":
    main()

"""Verdicts of a run over a synthetic town against its truth.

    python benchmarks/verdicts_run.py RUN TRUTH          # TRUTH: what `cityflow synth` made

Every building is held against the true units of which most stands in its outline, or that hold most of it; the true share counts what it misses of
their walls, and what it has beyond. Where another building of the run stands on a part of such a unit, or is nearer to it, that building is judged there:
a unit cut in two is no fault of a roof, and what is missing at its end is the fault of one of the two.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Lod, Polyhedron
from cityflow.core.verdicts import PROBABILITY_KEY, REASON_KEY, VERDICT_KEY, Verdict
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.town import make_town
from cityflow.synthetic.town_units import Unit
from town_models import buildings_of
from verdict_cases import GOOD_SHARE, true_places, true_share

AROUND_M, MOST = 4.0, 0.5


def units_of(truth: Path) -> tuple[Unit, ...]:
    """All units of a synthetic survey's town."""
    p = SynthParameters.model_validate(json.loads((truth / "synth.json").read_text())["parameters"])
    return make_town(p.seed, p.whole_town).units


def share_of(
    outline: Polygon, solid: Polyhedron, others: Polygon | MultiPolygon, units: tuple[Unit, ...], tree: shapely.STRtree
) -> float:
    """Share of a building's roof within 20 cm of the truth; `others`: outlines of the other buildings around."""
    return true_share(solid, places_of(outline, others, units, tree)[2], outline)


def places_of(
    outline: Polygon, others: Polygon | MultiPolygon, units: tuple[Unit, ...], tree: shapely.STRtree
) -> tuple[list[Unit], list[Unit], FloatArray]:
    """The true units near a building, those that it is held against, and (P, 3) the places where it is judged, with the true heights there."""
    near = [units[k] for k in np.sort(tree.query(outline, predicate="dwithin", distance=AROUND_M))]
    shared = [shapely.intersection(outline, u.wall_outline).area for u in near]
    own = [u for u, m2 in zip(near, shared, strict=True) if m2 > MOST * min(u.wall_outline.area, outline.area)]
    places = true_places(own, outline, near)
    inside = shapely.contains_xy(outline, places[:, 0], places[:, 1])
    points = shapely.points(places[:, :2])
    mine, its = (np.nan_to_num(shapely.distance(points, p), nan=np.inf) for p in (outline, others))
    return near, own, places[inside | (mine <= its)]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("run", type=Path)
    options.add_argument("truth", type=Path)
    asked = options.parse_args()
    units = units_of(asked.truth)
    tree = shapely.STRtree([u.wall_outline for u in units])
    rows = []
    buildings = sorted(buildings_of(asked.run), key=lambda b: b.id)
    for building in buildings:
        others = shapely.union_all([b.footprint for b in buildings if b is not building])
        verdict, share = (
            Verdict(str(building.attributes[VERDICT_KEY])),
            share_of(building.footprint, building.solids[Lod.LOD22], others, units, tree),
        )
        rows.append((verdict is Verdict.GOOD, share >= GOOD_SHARE))
        said = f"{verdict:4} {float(building.attributes[PROBABILITY_KEY] or 0):.3f}"
        print(f"{building.id:30} {said} true {100 * share:5.1f} % {building.attributes[REASON_KEY]}")
    called, good = np.array(rows, bool).reshape(-1, 2).T
    print(
        f"{len(rows)} buildings, {good.sum()} truly good; {called.sum()} called good, {(called & good).sum()} of them truly"
    )


if __name__ == "__main__":
    main()

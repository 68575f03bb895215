"""Whether points of façades show how deep windows and doors lie in their wall: their distance from the wall around them against the true one.

python benchmarks/reveal_depth.py RUN SURVEY      # a run over a synthetic flight, and its survey
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.flow.store import Store
from cityflow.handover.array_file import decode_arrays
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic.town import make_town
from cityflow.synthetic.town_facades import Wall

INSIDE_M, AROUND_M, NEAR_M = 0.15, 0.7, 0.5
"""Points so far from the rim of an opening are in it, or of the wall around it up to so far; points so near to the wall are its own."""
LEAST_POINTS, LEAST_LENGTH_M, FACING = 30, 3.0, 0.9


def points_of(run: Path) -> tuple[FloatArray, FloatArray]:
    """(N, 3) world metres and (N, 2) normals of all façade points of a run."""
    store = Store.open(str(run))
    parts = [decode_arrays(store.read_bytes(p))[0] for p in store.find("work/walls") if p.endswith(".cfa")]
    return np.concatenate([p["xyz"] for p in parts]), np.concatenate([p["normal"] for p in parts])


def depth_of(wall: Wall, xyz: FloatArray, normal: FloatArray) -> float:
    """Distance of what is in a wall's openings from what is around them, medians; NaN where too few points show it."""
    plan = xyz[:, :2] - wall.a
    along, away = plan @ wall.along, plan @ wall.outward
    mine = (along > 0) & (along < wall.length) & (np.abs(away) < NEAR_M) & (normal @ wall.outward > FACING)
    s, t, z = along[mine], away[mine], xyz[mine, 2]
    within, rim, around = (np.zeros(len(s), bool) for _ in range(3))
    for s_0, s_1, z_0, z_1, _ in wall.openings:
        for into, by in ((within, -INSIDE_M), (rim, INSIDE_M), (around, AROUND_M)):
            into |= (s > s_0 - by) & (s < s_1 + by) & (z > z_0 - by) & (z < z_1 + by)
    beside = around & ~rim
    if min(within.sum(), beside.sum()) < LEAST_POINTS:
        return float("nan")
    return float(np.median(t[beside]) - np.median(t[within]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("survey", type=Path)
    asked = parser.parse_args()
    p = SynthParameters.model_validate(json.loads((asked.survey / "synth.json").read_text())["parameters"])
    town = make_town(p.seed, p.whole_town)
    xyz, normal = points_of(asked.run)
    walls = [w for w in town.walls if len(w.openings) and w.length >= LEAST_LENGTH_M]
    rows = np.array([(town.units[w.unit].style.recess_m, depth_of(w, xyz, normal)) for w in walls])
    true, seen = rows[np.isfinite(rows[:, 1])].T
    low, middle, high = 100 * np.percentile(seen, (10, 50, 90))
    print(
        f"{len(seen)} walls: true depth {100 * true.mean():.1f} cm in the mean, seen {middle:.1f} cm in the median (80 % of walls {low:.1f} to {high:.1f});"
        f" correlation of both {np.corrcoef(true, seen)[0, 1]:.2f}"
    )


if __name__ == "__main__":
    main()

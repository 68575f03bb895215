"""Wings of farms that are buildings of their own, and wings of houses, manors and churches that are none: borders found and false lines.

    python benchmarks/split_farms.py [--first 8100] [--seeds 12]      # seeds 8000 to 8023 are in the fit

Drawn groups (`scenes/drawn_farms.py`), half of them without oblique frames, colours of neighbours mostly equal.
"""

from __future__ import annotations

import argparse

import numpy as np
import shapely

from cityflow.splitting.split import SplitParameters, split
from drawn_town import table
from scenes.drawn_farms import KINDS, group_evidence
from split_unbroken import hits_of


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=8100)
    parser.add_argument("--seeds", type=int, default=12)
    asked = parser.parse_args()
    rows = []
    for kind in KINDS:
        true = hits = false = 0
        for seed in range(asked.first, asked.first + asked.seeds):
            evidence, lines = group_evidence(kind, seed)
            middles = np.array([shapely.get_coordinates(line).mean(axis=0) for line in lines]).reshape(-1, 2)
            found = hits_of(split(evidence, SplitParameters()), middles)
            true, hits, false = true + len(lines), hits + found[0], false + found[1]
        rows.append([kind, str(asked.seeds), str(true), str(hits), str(false)])
    table("Groups of buildings", ["kind", "groups", "true borders", "found", "false lines"], rows)


if __name__ == "__main__":
    main()

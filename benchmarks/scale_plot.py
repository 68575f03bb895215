"""Draws what `city_scale.py`, `city_driver.py`, `rerun_one.py` and `million_driver.py` have printed, log-log:
``python benchmarks/scale_plot.py PRINTED … --out FILE.png``.

Slopes are those of straight lines through the points: 1 is linear.
"""

from __future__ import annotations

import argparse
import re
from collections import defaultdict
from pathlib import Path

import numpy as np

from city_scale import OUTLINES_A_SIDE

DRIVER = re.compile(r"^(\d+) buildings, .*: \d+ tasks, ([\d.]+) s of the driver, .* peak (\d+) MB", re.MULTILINE)
WHOLE_DRIVER = re.compile(
    r"^(\d+) buildings, .*\n(?:  .*\n)*\d+ tasks, ([\d.]+) s of the driver, ([\d.]+) ms a task.*\n(?:of which .*\n)?held at the end (\d+) MB",
    re.MULTILINE,
)
LAST_OF_MANY = re.compile(
    r"^the last \d+ of (\d+) buildings, .*\n(?:  .*\n)*\d+ tasks, [\d.]+ s of the driver, ([\d.]+) ms a task",
    re.MULTILINE,
)
OF_A_TOWN = re.compile(r"^(?:the last \d+ of )?(\d+) buildings, ")
TEN_THOUSAND = re.compile(r"^ +\d+ tasks: ([\d.]+) ms each of the last .* resident (\d+) MB")
TOWN = re.compile(r"^(\d+)² tiles,")
TOTAL = re.compile(r"^part: [\d.]+ s, ([\d.]+) s of processor time")
STEP = re.compile(r"^  (opening|status by its note|plan: a walk|plan by the note) +[\d.]+ s +([\d.]+) s")
TITLES = {
    "opening": "opening, warm files",
    "status by its note": "status",
    "plan: a walk": "plan, a walk",
    "plan by the note": "plan by the note",
}
Curves = dict[str, list[tuple[int, float]]]


def read(texts: list[str]) -> tuple[Curves, Curves, Curves]:
    """Seconds of processor time, milliseconds a task, and megabytes: curve → buildings and value."""
    seconds, each, memory = defaultdict(list), defaultdict(list), defaultdict(list)
    for text in texts:
        for buildings, spent, peak in DRIVER.findall(text):
            seconds["driver: all tasks of a run"].append((int(buildings), float(spent)))
            memory["driver, peak"].append((int(buildings), float(peak)))
        for buildings, spent, ms, held in WHOLE_DRIVER.findall(text):
            each["driver with engine: a task"].append((int(buildings), float(ms)))
            seconds["driver with engine: all tasks of a run"].append((int(buildings), float(spent)))
            memory["driver with engine, held at the end"].append((int(buildings), float(held)))
        for buildings, ms in LAST_OF_MANY.findall(text):
            each["driver with engine: a task"].append((int(buildings), float(ms)))
        for buildings, told in _ten_thousands(text).items():
            each["a task, median of 10,000 and 10,000"].append((buildings, float(np.median([ms for ms, _ in told]))))
            memory["driver with engine, all of the process"].append((buildings, told[-1][1]))
        town = 0
        for line in text.splitlines():
            if found := TOWN.match(line):
                town = int(found[1]) ** 2 * OUTLINES_A_SIDE**2
            elif found := TOTAL.match(line):
                seconds["driver: rerun of one building"].append((town, float(found[1])))
            elif found := STEP.match(line):
                seconds[TITLES[found[1]]].append((town, float(found[2])))
    return seconds, each, memory


def _ten_thousands(text: str) -> dict[int, list[tuple[float, float]]]:
    """Buildings of a town → milliseconds a task of each ten thousand tasks, and MB after them, also where a run was interrupted."""
    found, town = defaultdict[int, list[tuple[float, float]]](list), 0
    for line in text.splitlines():
        if header := OF_A_TOWN.match(line):
            town = int(header[1])
        elif told := TEN_THOUSAND.match(line):
            found[town].append((float(told[1]), float(told[2])))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("printed", type=Path, nargs="+")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    labels = "processor time (s)", "processor time of a task (ms)", "memory (MB)"
    drawn = zip(read([p.read_text() for p in given.printed]), labels, strict=True)
    parts = [(curves, label) for curves, label in drawn if curves]
    figure, axes = plt.subplots(1, len(parts), figsize=(5.5 * len(parts), 4.6), squeeze=False)
    for axis, (curves, label) in zip(axes[0], parts, strict=True):
        for name, points in curves.items():
            at = np.array(sorted(set(points)))
            slope = f", slope {np.polyfit(np.log(at[:, 0]), np.log(at[:, 1]), 1)[0]:.2f}" if len(at) > 1 else ""
            axis.loglog(*at.T, "o-", label=f"{name}{slope}")
        axis.set(xlabel="buildings", ylabel=label)
        axis.grid(visible=True, which="both", alpha=0.25)
        axis.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0, 1))
    figure.tight_layout()
    figure.savefig(given.out, dpi=110)


if __name__ == "__main__":
    main()

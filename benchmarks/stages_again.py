"""Tasks of some stages of a finished run, done again one after the other in this process: their processor time against plain StereoSGBM, and whether any
byte differs.

    cp -r RUN COPY; python benchmarks/stages_again.py COPY --catalog CATALOG surface fuse ortho frame

Tasks write into the RUN, so give it a copy. For two versions of the program, run it with each, one after the other: a busy machine slows both. Compiling is
left out. The unit is one plain StereoSGBM for each image of the flight (``matching_speed.py``), before and after.
"""

from __future__ import annotations

import argparse
import importlib
import time
from pathlib import Path

import cv2

from cityflow.flow.records import decode
from cityflow.flow.shared import SharedTexts
from cityflow.flow.task import Record, Task
from cityflow.flow.workspace import Workspace
from cityflow.runs.prepare import Prepared, prepared
from matching_speed import baseline_of, keep_heap
from step_times import COMPILING, StepTimes
from town_images import WORKFLOW


def records_of(run: Path) -> dict[tuple[str, str], Record]:
    """By stage and unit, the newest."""
    found = (decode(path.read_bytes()) for path in sorted((run / "records").rglob("*.json")))
    return {(record.stage, record.unit): record for record in found}


def tasks_of(wanted: Prepared, records: dict[tuple[str, str], Record], texts: SharedTexts | None = None) -> list[Task]:
    """All tasks of the run that have a record, with their texts in the RUN, or where `texts` leaves them."""
    source, texts, found = wanted.source(), texts or SharedTexts(wanted.store), []
    ready = list(source.initial())
    while ready:
        task = ready.pop()
        record = records.get((task.stage, task.unit))
        if record is not None:
            found.append(texts.stored(task))
            ready.extend(source.after(task, record))
    return sorted(found, key=lambda task: (task.stage, task.unit))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("run", type=Path)
    options.add_argument("stages", nargs="+")
    options.add_argument("--catalog", required=True)
    options.add_argument(
        "--aoi", default="85000,447000,85040,447040", help="that of the run; of matching_speed.py where it is not given"
    )
    options.add_argument("--every", type=int, default=1, help="of so many tasks one")
    o = options.parse_args()
    keep_heap()
    cv2.setNumThreads(1)
    wanted, records = prepared(WORKFLOW, o.catalog, str(o.run), [], o.aoi), records_of(o.run)
    tasks, times = tasks_of(wanted, records), StepTimes()
    before = baseline_of(wanted.catalog)
    lines = []
    with times.watched():
        for stage in o.stages:
            chosen, seconds, differ = [t for t in tasks if t.stage == stage][:: o.every], 0.0, 0
            for task in chosen:
                module, _, name = task.function.partition(":")
                function = getattr(importlib.import_module(module), name)
                begun, compiling = time.process_time(), times.seconds[COMPILING]
                outcome = function(Workspace(wanted.store, task), task)
                seconds += time.process_time() - begun - (times.seconds[COMPILING] - compiling)
                differ += dict(outcome.outputs) != dict(records[stage, task.unit].outputs)
            lines.append((stage, len(chosen), seconds, differ))
    baseline = (before + baseline_of(wanted.catalog)) / 2
    unit = baseline * len(wanted.catalog.images)
    print(f"plain StereoSGBM {baseline:.3f} s an image, {len(wanted.catalog.images)} images: {unit:.1f} s")
    for stage, count, seconds, differ in lines:
        print(
            f"{stage:<12} {count:>4} tasks {seconds:>8.2f} s {seconds / unit:>6.2f} of it; other bytes than the run's: {differ} tasks"
        )


if __name__ == "__main__":
    main()

"""What `rerun` of one building costs the driver as a city grows, beside the work of its tasks.

    python benchmarks/rerun_one.py [--side 3 6 12] [--way look part whole] [--profile]

The towns of `city_scale.py`, flown by five heads, with a record of true size for every task, joined in segments in a temporary RUN. One building in
the middle of the town is run again, and its hull is another one then: the tasks of the driver are made, held against the ledger and answered
without being run. Measured are seconds on the clock and of processor time, without Dask, files of tasks, report and view. ``whole`` is by way of
the whole city, as every rerun went before, and as those still go that begin before outlines are split.
"""

from __future__ import annotations

import argparse
import cProfile
import pstats
import resource
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import shapely

from city_scale import TILE_M, X, Y, answer, survey
from cityflow.flow.garbage import collect_seldom
from cityflow.flow.ledger import SEGMENT, Ledger
from cityflow.flow.outputs import Outputs
from cityflow.flow.record_segments import write_segment
from cityflow.flow.records import encode
from cityflow.flow.row import Line, row_of
from cityflow.flow.stage import Node
from cityflow.flow.state import State
from cityflow.flow.store import Store
from cityflow.flow.task import Record, Task
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.pipeline.city_part import CityPart
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.asked import read_asked
from cityflow.runs.current import current_records
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import describe_run
from cityflow.runs.settings import Workflow
from cityflow.survey import kept_plans
from cityflow.survey.area import Area
from cityflow.workflow.chosen_part import Selection, part_of
from cityflow.workflow.expected import costs_of, expected_tasks
from cityflow.workflow.note_asked import note_asked, note_part
from cityflow.workflow.plan import noted_plan, plan_of
from cityflow.workflow.rerun import select
from cityflow.workflow.retired import remove_stale_products
from cityflow.workflow.status import standing_of

Timed = dict[str, tuple[float, float]]


def town(side: int, folder: str) -> Prepared:
    """A RUN with all records of a town of so many tiles along an edge."""
    box = (X, Y, X + side * TILE_M, Y + side * TILE_M)
    catalog: Catalog = survey(box)
    wanted = Prepared(Workflow(name="city"), catalog, Area(shapely.box(*box)), Store.open(folder))
    describe_run(wanted)
    source, lines = wanted.source(), list[Line]()
    for record in answered(source):
        lines.append(Line(row_of(record), record.digest, encode(record)))
        if len(lines) == SEGMENT:
            write_segment(wanted.store, lines)
            lines.clear()
    if lines:
        write_segment(wanted.store, lines)
    return wanted


def answered(source: CitySource) -> Iterator[Record]:
    ready = [iter(source.initial())]
    while ready:
        task = next(ready[-1], None)
        if task is None:
            ready.pop()
            continue
        yield (record := answer(task))
        ready.append(iter(source.after(task, record)))


def followed(source: Any, ledger: Ledger, redo: Callable[[Node], bool]) -> list[str]:
    """As `flow.executor` goes through tasks, and answers those that are not done; their names."""
    ready, ran = [iter(source.initial())], list[str]()
    while ready:
        task = next(ready[-1], None)
        if task is None:
            ready.pop()
            continue
        record = ledger.latest(task.stage, task.unit) if ledger.state(task) is State.DONE else None
        if record is None or redo((task.stage, task.unit)):
            ran.append(task.name)
            record = other(task, ledger.next_attempt(task.stage, task.unit))
            ledger.add(record)
        ready.append(iter(source.after(task, record)))
    return ran


def other(task: Task, attempt: int) -> Record:
    """What a task leaves that was made again: a hull is another one, and so is all that was made of it."""
    made = answer(task)
    if task.stage in ("split", "units"):
        return replace(made, attempt=attempt)
    return replace(
        made,
        attempt=attempt,
        outputs=dict.fromkeys(made.outputs, f"{attempt:064d}"),
        result={**made.result, "digest": f"{attempt:064d}"},
    )


@contextmanager
def timed(told: Timed, name: str) -> Iterator[None]:
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    told[name] = time.perf_counter() - wall, time.process_time() - cpu


def whole(wanted: Prepared, unit: str) -> tuple[Timed, list[str]]:
    """By way of the whole city."""
    told: Timed = {}
    with timed(told, "opening"):
        ledger = Ledger.open(wanted.store)
    with ledger:
        with timed(told, "what is chosen: a walk"):
            chosen = select(current_records(wanted, ledger), Selection(units=(unit,)))
        with timed(told, "the walk of the tasks"):
            source = wanted.source()
            ran = followed(source, ledger, lambda node: node in chosen)
        with timed(told, "what to expect"):
            expected_tasks(source, costs_of(ledger))
        with timed(told, "products that are gone"):
            remove_stale_products(wanted.store, ledger, source.survey)
        with timed(told, "the walk of the report"):
            current_records(wanted, ledger)
        with timed(told, "what was asked for: a walk"):
            note_asked(wanted, ledger)
    return told, ran


def part(wanted: Prepared, unit: str) -> tuple[Timed, list[str]]:
    """By what depends on it alone; as in a process of its own."""
    told: Timed = {}
    kept_plans._REMEMBERED.clear()
    with timed(told, "opening"):
        ledger = Ledger.open(wanted.store)
    with ledger:
        asked = read_asked(wanted.store, ledger)
        with timed(told, "where images and tiles are"):
            _ = (source := wanted.source()).city.tiles
        with timed(told, "what is chosen"):
            chosen = part_of(source.city, ledger, Selection(units=(unit,)))
        assert chosen is not None
        with timed(told, "where they are, once more"):
            _ = (source := wanted.source()).city.tiles
        with timed(told, "the walk of the tasks"), ledger.driven():
            found = CityPart(source, chosen, ledger)
            ran = followed(found, ledger, lambda node: node in chosen.nodes)
        with timed(told, "what was asked for"):
            note_part(wanted, ledger, asked, found)
    return told, ran


def look(wanted: Prepared, _unit: str) -> tuple[Timed, list[str]]:
    """What commands take that only look: each opens the RUN."""
    told: Timed = {}
    with timed(told, "opening"):
        ledger = Ledger.open(wanted.store)
    with ledger:
        with timed(told, "status without a note: a walk"):
            asked = note_asked(wanted, ledger)
        with timed(told, "status by its note"):
            noted = read_asked(wanted.store, ledger)
            standing_of(wanted.store, noted or asked, ledger, "RUN")
        with timed(told, "plan by the note"):
            noted_plan(wanted, ledger)
        with timed(told, "plan: a walk"):
            plan_of(wanted.source(), ledger)
    return told, []


WAYS = {"look": look, "part": part, "whole": whole}


def show(way: str, told: Timed, ran: list[str]) -> None:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    wall, cpu = (sum(part) for part in zip(*told.values(), strict=True))
    print(
        f"{way}: {wall:.2f} s, {cpu:.2f} s of processor time; {len(ran)} tasks ran; peak so far {peak:.0f} MB",
        flush=True,
    )
    for name, (wall, cpu) in told.items():
        print(f"  {name:<28} {wall:8.2f} s {cpu:8.2f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, nargs="+", default=[3, 6], help="ground tiles along an edge of the town")
    parser.add_argument("--way", nargs="+", choices=list(WAYS), default=list(WAYS))
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    given = parser.parse_args()
    # the outputs of the records are no files here
    Outputs.all_there = lambda self, record: True  # type: ignore[method-assign]  # noqa: ARG005
    collect_seldom()  # as every command does
    for side in given.side:
        with tempfile.TemporaryDirectory() as folder:
            begun = time.perf_counter()
            wanted = town(side, folder)
            middle = (side // 2 + 0.5) * TILE_M
            unit = f"{round(X + middle + 6.25)}_{round(Y + middle + 6.25)}"
            print(
                f"\n{side}² tiles, {len(wanted.catalog.images)} images; the town was made in {time.perf_counter() - begun:.0f} s",
                flush=True,
            )
            for way in given.way:
                profile = cProfile.Profile()
                if given.profile:
                    profile.enable()
                told, ran = WAYS[way](wanted, unit)
                profile.disable()
                show(way, told, ran)
                if given.profile:
                    pstats.Stats(profile).sort_stats("cumulative").print_stats(45)


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()

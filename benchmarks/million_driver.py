"""What a driver takes in a RUN of a million buildings: the last 102,400 of them, then what commands ask, and one building again.

    python benchmarks/million_driver.py flight RUN
    python benchmarks/million_driver.py drive RUN [--minutes 25] [--behind] [--steps] [--profile]
    python benchmarks/million_driver.py look RUN
    python benchmarks/million_driver.py again RUN [--inside 8] [--everywhere] [--profile]
    python benchmarks/million_driver.py repeat RUN
    python benchmarks/million_driver.py left RUN
    python benchmarks/million_driver.py plan RUN [--asked 4]
    python benchmarks/million_driver.py report RUN

RUN is that of `million.py make`; a process for each step, in this order. ``flight`` finds the flight plan of all images, which the RUN keeps. ``drive`` runs
the square of the last tiles, an area of interest, as `city_driver.py` runs a town: the ledger knows the records of all others, the source all images. Tiles
around the square have records of other inputs, as those of `make` are drawn at random; what the square needs of them runs again. An interrupt, or the end of
its `--minutes`, ends it; it tells every 10,000 tasks what these took, and at the end all. ``look`` writes the note that a finished run of the whole leaves,
and asks by it; ``repeat`` is what the same `run` takes then (of what workers do, a fiftieth or so). ``again`` runs one building again, as `rerun_one.py`
does, on the tile so many ``--inside`` the south-western corner of the square: one in the middle, or one in what an interrupted run has done. ``left`` is what
a driver of the whole holds of all tiles before the last. ``plan`` walks some of the last tiles, all of whose tasks are done. ``report`` gathers what a report
does from the rows of all records, and from the whole records of textures and atlas cells; files of products, which the rest of a report is read from, are not
there.
"""

from __future__ import annotations

import argparse
import cProfile
import gc
import pickle
import pstats
import resource
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import shapely

from city_driver import Progress, Scheduler, driven, resident_mb
from city_scale import OUTLINES_A_SIDE, TILE_M, X, Y
from cityflow.core.grid import Bounds
from cityflow.flow.garbage import collect_seldom
from cityflow.flow.ledger import Ledger
from cityflow.flow.left_there import left_there
from cityflow.flow.outputs import Outputs
from cityflow.flow.record_segments import Piece
from cityflow.flow.some_units import ALL
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.pipeline.pipeline import in_flow_order
from cityflow.reporting import texture_figures
from cityflow.reporting.asked_area import units_beyond
from cityflow.reporting.listed_city import problems_of
from cityflow.reporting.run_report import stage_row, uncollected
from cityflow.runs.asked import Asked, circumstances, read_asked, write_asked
from cityflow.runs.current import known_records, noted_records
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import describe_run
from cityflow.survey.area import EVERYWHERE, Area
from cityflow.workflow.expected import costs_of
from cityflow.workflow.finished import finished
from cityflow.workflow.followed import prepare_surface
from cityflow.workflow.plan import noted_plan, plan_of
from cityflow.workflow.run import failed_tasks
from cityflow.workflow.status import standing_of
from driver_steps import Steps
from million import Town, true_records, units_of
from rerun_one import Timed, part, show, timed

A_TILE = OUTLINES_A_SIDE**2


def last_tiles(town: Town, number: int) -> Bounds:
    """Bounds of the square of so many tiles along an edge at the north-eastern corner."""
    x_1, y_1 = X + town.side * TILE_M, Y + town.side * TILE_M
    return x_1 - number * TILE_M, y_1 - number * TILE_M, x_1, y_1


def limited(wanted: Prepared, bounds: Bounds) -> Prepared:
    return replace(wanted, area=Area(shapely.box(*bounds)))


@contextmanager
def told(what: str) -> Iterator[None]:
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(f"{what}: {wall:.1f} s, {cpu:.1f} s of processor time; resident {resident_mb():.0f} MB", flush=True)


def flight(town: Town, folder: str) -> None:
    """Found anew unless the RUN keeps it."""
    wanted = town.prepared(folder)
    with told(f"flight plan of {len(wanted.catalog.images):,} images and the surveyed tiles"):
        tiles = wanted.source().survey.lattice.tiles
    print(f"{len(tiles):,} surveyed tiles")


def drive(town: Town, folder: str, steps: Steps, profiled: bool, minutes: float, behind: bool) -> None:
    kept = left(town, folder) if behind else None
    with told("catalog"):
        wanted = limited(town.prepared(folder), last_tiles(town, town.last))
    with told("opening"):
        ledger = Ledger.open(wanted.store)
    with ledger:
        source = wanted.source(ledger)
        source.walk.ahead = True
        with told("flight plan as the RUN keeps it"):
            _ = source.survey.lattice.tiles
        print(
            f"\nthe last {town.last**2 * A_TILE} of {town.side**2 * A_TILE} buildings, {town.last**2} of {town.side**2} tiles, "
            f"{len(wanted.catalog.images)} images, {ledger.count_files()} records of others"
        )
        progress = Progress(until=time.perf_counter() + 60 * minutes)
        driven(source, ledger, Scheduler(wanted.store, steps, progress=progress), profiled)
        print(f"resident at the end {resident_mb():.0f} MB")
    del kept
    print(f"peak of the process, catalog and workers' part included, {_peak_mb():.0f} MB")


def look(town: Town, folder: str) -> None:
    """What commands take that only look, by the note."""
    wanted, found = town.prepared(folder), dict[str, Any]()
    clocked: Timed = {}
    with timed(clocked, "opening"):
        ledger = Ledger.open(wanted.store)
    with ledger:
        _note(wanted, ledger)
        with timed(clocked, "status by its note"):
            noted = read_asked(wanted.store, ledger)
            assert noted is not None
            standing = standing_of(wanted.store, noted, ledger, "RUN")
        with timed(clocked, "plan by the note"):
            found |= noted_plan(wanted, ledger) or {}
        with timed(clocked, "costs of a task"):
            costs_of(ledger)
    assert standing.is_complete, "the last merge is missing"
    _header(town, wanted)
    show("look", clocked, [])
    print(", ".join(f"{stage} {plan.done:,} of {plan.total:,}" for stage, plan in found.items()))


def repeat(town: Town, folder: str) -> None:
    """What a finished run of the whole takes when it is asked for once more, without cluster and report."""
    wanted, clocked = town.prepared(folder), dict[str, tuple[float, float]]()
    with timed(clocked, "opening"):
        ledger = Ledger.open(wanted.store)
    with ledger:
        _note(wanted, ledger)
        with timed(clocked, "whether all is as before"):
            asked = finished(wanted, ledger)
        assert asked is not None
        with timed(clocked, "arrays of the surface"):
            prepare_surface(wanted, wanted.source().survey)
        with timed(clocked, "what workers are told"):
            _, pieces = ledger.pieces(asked.tasks)
            told = sum(len(pickle.dumps(piece)) for piece in pieces)
        with timed(clocked, "names of units"):
            records = known_records(wanted, ledger, asked)
        with timed(clocked, "what is said"):
            standing_of(wanted.store, asked, ledger, "RUN")
            failed_tasks(records)
    _header(town, wanted)
    show("repeat", clocked, [])
    some, cpu = pieces[:: len(pieces) // 50], time.process_time()
    count = sum(_read(wanted.store, piece) for piece in some)
    cpu = time.process_time() - cpu
    print(
        f"{len(pieces)} pieces of {told / 1e6:.0f} MB; workers: {cpu / len(some):.3f} s for one, {1e3 * cpu / count:.3f} ms a record"
    )


def _read(store: Store, piece: Piece) -> int:
    """As a worker does; the outputs are asked for one by one and are not there."""
    outputs, asked = Outputs(store), list[str]()

    def all_there(_: Outputs, record: Record) -> bool:
        asked.extend(path for path in record.outputs if outputs._size(path) is None)
        return True

    Outputs.all_there = all_there  # type: ignore[method-assign, assignment]
    assert left_there(store, piece)
    assert asked
    return len(piece.places)


def _note(wanted: Prepared, ledger: Ledger) -> None:
    """As a run of the whole leaves it when nothing is out of date."""
    describe_run(wanted)
    stages = in_flow_order(ledger.stages())
    counts = {stage: ledger.tally(stage).records for stage in stages}
    write_asked(wanted.store, Asked(
        wanted.catalog.title, wanted.workflow.name, dict.fromkeys(stages, ALL), counts, {}, records=ledger.count_files(),
        under=circumstances(wanted.store), given=wanted.given_digest(wanted.edits()),
    ))  # fmt: skip


def again(town: Town, folder: str, inside: int, everywhere: bool) -> None:
    """One building of the last tiles; ``everywhere``: of a run without an area of interest."""
    wanted = town.prepared(folder)
    wanted = replace(wanted, area=EVERYWHERE) if everywhere else wanted
    x, y = (lo + (inside + 0.5) * TILE_M + 6.25 for lo in last_tiles(town, town.last)[:2])
    clocked, ran = part(wanted, f"{round(x)}_{round(y)}")
    _header(town, wanted)
    show("part", clocked, ran)


def plan(town: Town, folder: str, asked: int) -> None:
    wanted = limited(town.prepared(folder), last_tiles(town, asked))
    clocked: Timed = {}
    with Ledger.open(wanted.store) as ledger, timed(clocked, "plan: a walk over some"):
        found = plan_of(wanted.source(ledger), ledger)
    show("plan", clocked, [])
    tasks, cpu = sum(p.total for p in found.values()), clocked["plan: a walk over some"][1]
    print(f"{tasks:,} tasks of {asked}² tiles, {1e3 * cpu / tasks:.2f} ms each")
    print(", ".join(f"{stage} {p.done:,} of {p.total:,}" for stage, p in found.items()))


def report(town: Town, folder: str) -> None:
    wanted, clocked = town.prepared(folder), dict[str, tuple[float, float]]()
    vars(texture_figures)["read_atlas_cells"] = lambda _store, _paths: ()
    with uncollected(), Ledger.open(wanted.store) as ledger:
        noted = read_asked(wanted.store, ledger)
        assert noted is not None
        with timed(clocked, "names of units"):
            records = noted_records(noted, ledger)
        with timed(clocked, "rows of stages"):
            rows = [stage_row(s, records.tally(s)) for s in records.stages()]
        with timed(clocked, "problems"):
            problems = [p for s in records.stages() for p in problems_of(records, s)]
        with timed(clocked, "units beyond the area"):
            beyond = units_beyond(records, wanted.area)
        _header(town, wanted)
        with timed(clocked, "textures and atlas cells"):
            figures = texture_figures.texture_figures(wanted.store, wanted.source().survey, records)
    assert figures is not None
    _header(town, wanted)
    show("report", clocked, [])
    print(
        f"{sum(row.units for row in rows):,} tasks, {len(problems)} problems, {len(beyond)} beyond; {figures.asked:,} textures"
    )


def left(town: Town, folder: str) -> Any:
    """What walk and city hold of all tiles but the last when these lie behind: records of true size are learned, and forgotten as in a run.

    Returns it.
    """
    records, source = true_records(), town.prepared(folder).source()
    city, walk, seen = source.city, source.walk, defaultdict[str, list[str]](list)
    source.forget_by(lambda *_: None)
    _ = city.tile_names
    entry = records["units"].result["units"][0]
    gc.collect()
    before = resident_mb()
    for number, (col, row) in enumerate(town.tiles()):
        for stage, units in units_of(number, col, row).items():
            for name in units:
                result = records[stage].result
                if stage in ("outline", "units"):
                    houses = units_of(number, col, row)["split"]
                    result = {**result, "units": [_placed(entry, house) for house in houses]}
                city.learn(replace(records[stage], unit=name, result=result))
                for nodes in (walk._wanted, walk._ended):
                    nodes.add((stage, name))
                seen[stage].append(name)
        while city.past:
            walk.forget(*city.past.pop())
    gc.collect()
    held, count = resident_mb() - before, len(seen["reconstruct"])
    print(
        f"{count:,} buildings, {held:.0f} MB more than before, {1e6 * held / count:.0f} bytes each; {len(city.units):,} units not forgotten"
    )
    return source, seen


def _placed(entry: dict[str, Any], name: str) -> dict[str, Any]:
    x, y = map(float, name.split("_"))
    return {
        **entry,
        "id": name,
        "point": [x, y],
        "bounds": [x - 5, y - 5, x + 5, y + 5],
        "neighbours": [],
        "neighbour_tiles": [],
    }


def _header(town: Town, wanted: Prepared) -> None:
    print(f"{town.side}² tiles, {len(wanted.catalog.images)} images; peak {_peak_mb():.0f} MB")


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("step", choices=["flight", "drive", "look", "repeat", "again", "left", "plan", "report"])
    parser.add_argument("run")
    parser.add_argument("--side", type=int, default=50)
    parser.add_argument("--last", type=int, default=16)
    parser.add_argument("--minutes", type=float, default=1e9, help="on the clock, after which a drive is interrupted")
    parser.add_argument(
        "--behind",
        action="store_true",
        help="a drive in a process that holds of all other tiles what the whole has left of them",
    )
    parser.add_argument("--steps", action="store_true", help="print the time by step and stage")
    parser.add_argument("--profile", action="store_true", help="print where the time goes")
    parser.add_argument("--inside", type=int, help="tiles from the south-western corner of the last; the middle")
    parser.add_argument("--everywhere", action="store_true", help="without an area of interest")
    parser.add_argument("--asked", type=int, default=4, help="tiles along an edge that are planned")
    given = parser.parse_args()
    # the outputs of the records are no files here
    Outputs.all_there = lambda self, record: True  # type: ignore[method-assign]  # noqa: ARG005
    collect_seldom()  # as every command does
    town, profile = Town(given.side, given.last), cProfile.Profile()
    if given.step == "drive":
        steps = Steps()
        if given.steps:
            steps.follow()
        drive(town, given.run, steps, given.profile, given.minutes, given.behind)
        return
    if given.profile:
        profile.enable()
    if given.step == "flight":
        flight(town, given.run)
    elif given.step == "look":
        look(town, given.run)
    elif given.step == "left":
        left(town, given.run)
    elif given.step == "repeat":
        repeat(town, given.run)
    elif given.step == "again":
        again(town, given.run, town.last // 2 if given.inside is None else given.inside, given.everywhere)
    elif given.step == "report":
        report(town, given.run)
    else:
        plan(town, given.run, given.asked)
    profile.disable()
    if given.profile:
        pstats.Stats(profile).sort_stats("cumulative").print_stats(60)


if __name__ == "__main__":
    main()

"""``cityflow status``: progress, quality of models, failures with reasons, next step."""

from __future__ import annotations

import shlex
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cityflow.core.building import Status
from cityflow.core.verdicts import VERDICT_KEY, Verdict
from cityflow.errors import RunError
from cityflow.flow.driver_note import described, read_note
from cityflow.flow.exclusive import is_held
from cityflow.flow.ledger import Ledger
from cityflow.flow.row import first_line
from cityflow.flow.some_units import SomeUnits
from cityflow.flow.store import Store
from cityflow.flow.tally import Tally
from cityflow.flow.task import Record
from cityflow.runs.asked import Asked
from cityflow.runs.poses_note import read_note as read_poses
from cityflow.workflow.last_request import BY_RECORDS, FORMER, LAST, asked_of
from cityflow.workflow.printed import print_json
from cityflow.workflow.verdict_words import verdict_of, verdicts_of

REASONS_SHOWN = 12
UNITS_NAMED = 3
BUILDINGS = "reconstruct"
VERDICTS = tuple(str(v) for v in Verdict)
VERDICT_WORDS = {str(Verdict.LOOK): "to look at"}
GOOD_MEANS = "Good: at least 95 % of the roof is expected within 20 cm of the truth."


@dataclass(frozen=True, slots=True)
class StageStanding:
    """One stage: tasks in all and still to be done (None: unknown yet), ended ones by status; mean seconds and highest megabytes of results."""

    stage: str
    tasks: int | None
    to_do: int | None
    done: int
    degraded: int
    failed: int
    refused: int
    mean_seconds: float
    peak_mb: float


@dataclass(frozen=True, slots=True)
class Problem:
    """Units of a stage that ended in the same way for the same reason."""

    stage: str
    status: str
    reason: str
    units: Sequence[str]


@dataclass(frozen=True, slots=True)
class Standing:
    """How a run stands.

    Attributes
    ----------
    verdicts : of the buildings that were asked for;  beyond : number of buildings outside the area of interest that were modelled, too
    damaged : what is wrong with segments of records
    poses : what the run found out about the poses of its images
    is_by_records, is_former : see `Asked`
    """

    run: str
    workflow: str
    title: str
    is_at_work: bool
    is_complete: bool
    stages: Sequence[StageStanding]
    verdicts: Mapping[str, int]
    beyond: int
    problems: Sequence[Problem]
    unused_edits: Sequence[tuple[str, str]]
    damaged: Sequence[str]
    next: Sequence[str]
    poses: Sequence[str] = ()
    is_by_records: bool = False
    is_former: bool = False


def print_status(url: str, console: Console, as_json: bool = False) -> None:
    """Print how a RUN stands, in words or as JSON."""
    store = Store.open(url)
    with Ledger.open(store) as ledger:
        standing = standing_of(store, asked_of(url, store, ledger), ledger, url)
    if as_json:
        print_json(asdict(standing))
        return
    console.print(
        f"{standing.workflow}: {standing.title} in {store.root}", markup=False, highlight=False, soft_wrap=True
    )
    if (note := read_note(store)) is not None and note.is_open:
        console.print(f"Driver: {described(note, time.time())}", markup=False, highlight=False, soft_wrap=True)
    print_standing(standing, console)


def print_units(url: str, console: Console, wanted: str = "", as_json: bool = False) -> None:
    """Print the buildings of a RUN, a line each: id, how it ended, its verdict, method and figures.

    Parameters
    ----------
    wanted : part of an id; empty: all

    Raises
    ------
    RunError
        It has none of that name.
    """
    store = Store.open(url)
    with Ledger.open(store) as ledger:
        asked = asked_of(url, store, ledger)
        beyond = frozenset(asked.beyond)
        named = asked.tasks.get(BUILDINGS, SomeUnits()).among(ledger.units(BUILDINGS))
        units = [u for u in named if u not in beyond and wanted.lower() in u.lower()]
        rows = [_unit_row(record) for u in units if (record := ledger.latest(BUILDINGS, u)) is not None]
    if not rows:
        what = f"no building has '{wanted}' in its id" if wanted else "no building has been worked on yet"
        raise RunError(what, where=url, remedy=f"cityflow status {shlex.quote(url)} says how far the run is")
    if as_json:
        print_json(rows)
        return
    for row in rows:
        figures = [f"{name.upper()} {100 * row[name]:.0f} cm" for name in ("nmad", "rmse") if row[name] is not None]
        parts = [row["status"], row["verdict"], row["method"], *figures, row["reason"]]
        console.print(f"{row['id']}  {', '.join(p for p in parts if p)}", markup=False, highlight=False, soft_wrap=True)


def _unit_row(record: Record) -> dict[str, Any]:
    found = record.result
    return {
        "id": record.unit, "status": str(record.status), "verdict": verdict_of(record.status, found.get(VERDICT_KEY)),
        "method": str(found.get("method", "")).replace("_", " "),
        "nmad": found.get("nmad"), "rmse": found.get("rmse"), "reason": first_line(record.reason),
    }  # fmt: skip


def standing_of(store: Store, asked: Asked, ledger: Ledger, shown_as: str) -> Standing:
    """What the newest records of these tasks say.

    Parameters
    ----------
    shown_as : how commands shall name the run

    Rows of the ledger are read one after the other, whole records not at all.
    """
    at_work = is_held(store)
    is_complete = (
        not (at_work or asked.stale or asked.is_former)
        and LAST[1] in asked.tasks.get(LAST[0], SomeUnits())
        and ledger.has(*LAST)
    )
    stale = {s: len(u.names) if not u.all_but else ledger.tally(s, u).records for s, u in asked.stale.items()}
    stages: list[StageStanding] = []
    problems: list[Problem] = []
    verdicts: Counter[str] = Counter()
    beyond, beyond_area = 0, frozenset(asked.beyond)
    for stage in dict.fromkeys([*asked.expected, *asked.tasks]):
        named = asked.tasks.get(stage, SomeUnits())
        tally = ledger.tally(stage, named)
        expected = tally.records if is_complete else asked.expected.get(stage, tally.records)
        found = stage_standing(stage, tally, expected, stale.get(stage, 0))
        stages.append(replace(found, to_do=None) if asked.is_former else found)
        problems.extend(problems_in(stage, tally))
        if stage == BUILDINGS:
            outside = ledger.tally(stage, named.among(beyond_area))
            beyond, verdicts = outside.records, verdicts_of(tally.kinds - outside.kinds)
    told = {v: verdicts[v] for v in dict.fromkeys([*VERDICTS, *sorted(verdicts)])} if verdicts else {}
    steps = _next(
        shown_as, at_work, is_complete, sum(stale.values()), told, problems, asked.is_by_records, asked.is_former
    )
    return Standing(
        store.root, asked.workflow, asked.title, at_work, is_complete, stages, told, beyond, problems,
        [(text, remedy) for text, remedy in asked.edits], ledger.problems(), list(steps),
        _lines_of_poses(store), asked.is_by_records, asked.is_former,
    )  # fmt: skip


def _lines_of_poses(store: Store) -> list[str]:
    poses = read_poses(store)
    if poses is None:
        return []
    from cityflow.reporting.poses_words import lines_of_poses

    return list(lines_of_poses(poses))


def print_standing(standing: Standing, console: Console) -> None:
    """Verdicts, a line per stage, the reasons of what did not end as asked, and the next step."""
    if standing.verdicts:
        told = ", ".join(f"{n:,} {VERDICT_WORDS.get(verdict, verdict)}" for verdict, n in standing.verdicts.items())
        why = "is modelled because it shares" if standing.beyond == 1 else "are modelled because they share"
        more = f" {standing.beyond:,} more outside the area {why} walls with these." if standing.beyond else ""
        console.print(
            f"Buildings by verdict: {told}.{more} {GOOD_MEANS}", markup=False, highlight=False, soft_wrap=True
        )
    for line in standing.poses:
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    console.print(_table(standing.stages))
    for told in [BY_RECORDS] * standing.is_by_records + [FORMER] * standing.is_former:
        console.print(told, markup=False, highlight=False, soft_wrap=True)
    for problem in standing.problems:
        console.print(_line(problem), markup=False, highlight=False, soft_wrap=True)
    for line in unused_lines(standing.unused_edits):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    for line in standing.damaged:
        console.print(f"{line}: the next run repairs it", markup=False, highlight=False, soft_wrap=True)
    for step in standing.next:
        console.print(f"Next: {step}", markup=False, highlight=False, soft_wrap=True)


def unused_lines(edits: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Edits without effect, and what to do about each."""
    yield from (f"edit without effect: {text} → {remedy}" for text, remedy in edits[:REASONS_SHOWN])
    if len(edits) > REASONS_SHOWN:
        yield f"    and {len(edits) - REASONS_SHOWN} more edits without effect: see report.html"


def stage_standing(stage: str, tally: Tally, expected: int | None, stale: int) -> StageStanding:
    total = None if expected is None else max(expected, tally.records)
    count = tally.status
    return StageStanding(
        stage, total, None if total is None else total - tally.records + stale, count[Status.DONE], count[Status.DEGRADED],
        count[Status.FAILED], count[Status.REFUSED], tally.mean_seconds, tally.peak_mb,
    )  # fmt: skip


def _table(stages: Sequence[StageStanding]) -> Table:
    table = Table(
        "stage", "tasks", *(str(s) for s in Status), "to do", "mean s", "peak MB", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    for s in stages:
        counts = (str(n) for n in (s.done, s.degraded, s.failed, s.refused))
        total, left = ("?" if n is None else str(n) for n in (s.tasks, s.to_do))
        table.add_row(s.stage, total, *counts, left, f"{s.mean_seconds:.2f}", f"{s.peak_mb:.0f}")
    return table


def problems_in(stage: str, tally: Tally) -> Iterator[Problem]:
    for status in (Status.FAILED, Status.REFUSED, Status.DEGRADED):
        units: dict[str, list[str]] = defaultdict(list)
        for row in tally.others:
            if row.status is status:
                units[row.reason or "no reason given"].append(row.unit)
        for reason in sorted(units, key=lambda reason: (-len(units[reason]), reason))[:REASONS_SHOWN]:
            yield Problem(stage, str(status), reason, sorted(units[reason]))


def _line(problem: Problem) -> str:
    units = problem.units
    named = ", ".join(units[:UNITS_NAMED]) + (", …" if len(units) > UNITS_NAMED else "")
    return f"{problem.stage} {problem.status}: {len(units)} × {problem.reason} ({named})"


def _next(
    named: str, at_work: bool, is_complete: bool, stale: int, verdicts: Mapping[str, int], problems: Sequence[Problem],
    by_records: bool = False, is_former: bool = False,
) -> Iterator[str]:  # fmt: skip
    """What to do, the most urgent first."""
    run = shlex.quote(named)
    if at_work:
        yield f"a run is active here: cityflow status {run} --watch follows it; cityflow view {run} shows the finished part"
        return
    if any(p.status == Status.FAILED for p in problems):
        yield f"fix the cause of the failures, or set other parameters: cityflow rerun {run} --failed"
    if is_former:
        yield "repeat the command of the run to update it"
    elif stale:
        yield (
            f"{'at least ' * by_records}{stale:,} tasks are out of date (older version of cityflow, other inputs or settings), "
            "and so are products and figures: repeat the command of the run to update them"
        )
    elif not is_complete:
        found = "whether the run is complete is not known" if by_records else "the run is not complete"
        yield f"{found}: repeat its command to continue where it stopped"
    doubtful = sum(verdicts.get(v, 0) for v in ("look", "poor"))
    if doubtful:
        which = "building that is" if doubtful == 1 else f"{doubtful} buildings that are"
        yield f"look at the {which} not good, the worst first: {run}/report.html"
    if is_complete:
        yield f"cityflow view {run}"

"""``cityflow bench``: the tables of the five papers beside ours, each row by a benchmark that is run here.

What is run stands in ``benchmarks/papers.yaml``: preparations (surveys and runs that several rows use) and rows, each a command and where its output has the
figures. Every finished row leaves a record, so what was stopped goes on where it was, and a line in ``history.ndjson``, which keeps those of earlier
states of the code.
"""

from __future__ import annotations

import datetime
import json
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from pydantic import Field, ValidationError
from rich.console import Console

from cityflow import __version__
from cityflow.core.parameters import Parameters
from cityflow.errors import CityflowError
from cityflow.flow.local_folder import LocalFolder
from cityflow.io.given_files import read_small, yaml_of

ROWS, RECORDS, LOGS, TABLE, HISTORY = "papers.yaml", "records", "logs", "papers.md", "history.ndjson"
LIBRARIES = ("numpy", "scipy", "opencv-python-headless", "numba", "dask", "shapely", "pycolmap")
LAST_WORDS = 200
"""Characters of a failed command's last line that its row shows."""


class Figure(Parameters):
    """Where a command's output has our figure."""

    find: str = Field(description="regular expression; its groups are the figures")
    say: str = Field("{}", description="text with {} for each of them")


class Step(Parameters):
    """A survey or run that rows use: a command that makes the folder {out}."""

    command: str = Field(description="program and arguments; {seed}, {out} and {NAME} of each step needed are put in")
    seed: int = Field(0, ge=0)
    minutes: float = Field(gt=0, description="on two cores, about")
    needs: tuple[str, ...] = Field((), description="names of steps")


class Row(Step):
    """A row of the table: a step whose command prints our figures."""

    paper: str
    what: str
    theirs: str = Field(description="the paper's figure; a dash where it gives none")
    ours: tuple[Figure, ...] = Field(min_length=1)


class Papers(Parameters):
    """What ``papers.yaml`` holds."""

    steps: Mapping[str, Step] = {}
    rows: Mapping[str, Row]

    def chosen(self, only: Sequence[str]) -> dict[str, Row]:
        """The rows of these names, all without names. Raises CityflowError for a name that no row has."""
        unknown = sorted(set(only) - set(self.rows))
        if unknown:
            raise CityflowError(f"no row is called {unknown[0]}", remedy=f"rows: {', '.join(self.rows)}")
        return {name: row for name, row in self.rows.items() if not only or name in only}

    def before(self, needs: Sequence[str]) -> Iterator[str]:
        """Steps that must be done, each after what it needs."""
        for name in needs:
            yield from self.before(self.steps[name].needs)
            yield name


@dataclass(frozen=True, slots=True)
class Measured:
    """What a row has come to.

    Attributes
    ----------
    code : version of the program;  command : as it was run;  date : day in UTC
    seconds : on the clock, with the steps that had to be made first
    ours : text of the figures;  failed : why there are none, else empty
    """

    name: str
    code: str
    command: str
    date: str
    seconds: float
    ours: str
    failed: str = ""


def read_papers(folder: Path) -> Papers:
    """The rows of ``FOLDER/papers.yaml``. Raises CityflowError naming file, place and remedy."""
    path = folder / ROWS
    if not path.is_file():
        raise CityflowError(
            "there is no such file",
            where=str(path),
            remedy="run in a checkout of the repository, or name its benchmarks/",
        )
    try:
        papers = Papers.model_validate(yaml_of(read_small(path, CityflowError)))
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise CityflowError(f"{place}: {first['msg']}", where=str(path), remedy="correct the row") from None
    except ValueError as error:
        raise CityflowError(str(error), where=str(path), remedy="correct the file") from None
    for name, made in {**papers.steps, **papers.rows}.items():
        missing = [need for need in made.needs if need not in papers.steps]
        if missing:
            raise CityflowError(
                f"{name} needs {missing[0]}, which is no step", where=str(path), remedy="correct the row"
            )
    return papers


def list_rows(benchmarks: Path, console: Console) -> None:
    """Print name, paper, what is measured, and about how long it takes with all that it needs."""
    papers = read_papers(benchmarks)
    for name, row in papers.rows.items():
        minutes = row.minutes + sum(papers.steps[step].minutes for step in set(papers.before(row.needs)))
        console.print(
            f"{name}: {row.paper}, {row.what}; about {minutes:g} minutes", markup=False, highlight=False, soft_wrap=True
        )


def bench(out: Path, only: Sequence[str], benchmarks: Path, again: bool, console: Console) -> bool:
    """Measure rows and write ``OUT/papers.md``; whether all of them have a figure.

    Parameters
    ----------
    out : folder of records, logs, surveys and runs; rows that it has of the same code are kept
    only : names of rows; all without
    benchmarks : folder with ``papers.yaml`` and the scripts that it names
    again : measure also what has a record
    """
    papers = read_papers(benchmarks)
    out.mkdir(parents=True, exist_ok=True)
    rows, store, code = papers.chosen(only), LocalFolder(str(out.resolve())), code_version(benchmarks)
    for name, row in rows.items():
        known = _known(store, name)
        if known is not None and known.code == code and not known.failed and not again:
            console.print(
                f"{name}: {known.ours} (measured {known.date})", markup=False, highlight=False, soft_wrap=True
            )
            continue
        console.print(
            f"{name}: {row.paper}, {row.what}; about {row.minutes:g} minutes",
            markup=False,
            highlight=False,
            soft_wrap=True,
        )
        found = _measure(name, row, papers, store, benchmarks, code)
        store.write_bytes(_record(name), json.dumps(asdict(found), ensure_ascii=False, indent=1).encode())
        before = store.read_bytes(HISTORY) if store.exists(HISTORY) else b""
        line = json.dumps({**asdict(found), "machine": machine()}, ensure_ascii=False)
        store.write_bytes(HISTORY, before + f"{line}\n".encode())
        store.write_bytes(TABLE, table(papers, store, code).encode())
        console.print(f"{name}: {found.ours or found.failed}", markup=False, highlight=False, soft_wrap=True)
    store.write_bytes(TABLE, table(papers, store, code).encode())
    console.print(f"Table: {out / TABLE}", markup=False, highlight=False, soft_wrap=True)
    return all(known is not None and not known.failed for known in (_known(store, name) for name in rows))


def _record(name: str) -> str:
    return f"{RECORDS}/{name}.json"


def _known(store: LocalFolder, name: str) -> Measured | None:
    if not store.exists(_record(name)):
        return None
    return Measured(**json.loads(store.read_bytes(_record(name))))


def _measure(name: str, row: Row, papers: Papers, store: LocalFolder, benchmarks: Path, code: str) -> Measured:
    """Run a row's steps, where they are not of this code already, and its command; a failure is a row, too."""
    start = time.monotonic()
    steps = list(dict.fromkeys(papers.before(row.needs)))
    folders = {step: f"{store.root}/{step}" for step in steps}
    failed, ours = "", ""
    for step in steps:
        made, done = papers.steps[step], f"{step}/made_by_{code}"
        if failed or store.exists(done):
            continue
        problem, _ = _run(_filled(made, folders, folders[step]), store, step, benchmarks)
        if problem:
            failed = f"{step}: {problem}"
        else:
            store.write_bytes(done, b"")
    words = _filled(row, folders, f"{store.root}/{name}")
    if not failed:
        failed, text = _run(words, store, name, benchmarks)
        if not failed:
            ours, failed = _figures(row, text)
    date = datetime.datetime.now(datetime.UTC).date().isoformat()
    return Measured(name, code, shlex.join(words), date, round(time.monotonic() - start, 1), ours, failed)


def _filled(step: Step, folders: Mapping[str, str], out: str) -> list[str]:
    """The words of a step's command with folders, seed and {out} put in."""
    return [word.format(**folders, seed=step.seed, out=out) for word in shlex.split(step.command)]


def _run(words: Sequence[str], store: LocalFolder, name: str, benchmarks: Path) -> tuple[str, str]:
    """Why a command failed, else an empty text; and what it printed, which is kept as ``logs/NAME.txt``."""
    root = benchmarks.resolve().parent
    program = {"python": [sys.executable], "cityflow": [sys.executable, "-m", "cityflow"]}
    paths = [str(root / part) for part in ("src", "tests", "benchmarks")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([*paths, os.environ.get("PYTHONPATH", "")])}
    ended = subprocess.run(
        [*program.get(words[0], [words[0]]), *words[1:]],
        cwd=root,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    text = ended.stdout + ended.stderr
    store.write_bytes(f"{LOGS}/{name}.txt", f"{shlex.join(words)}\n{text}".encode())
    if ended.returncode == 0:
        return "", text
    lines = [line for line in text.splitlines() if line.strip()]
    return (lines[-1][-LAST_WORDS:] if lines else f"ended with {ended.returncode}"), text


def _figures(row: Row, text: str) -> tuple[str, str]:
    """Our figures as a text; and which of them the output does not have."""
    told = []
    for figure in row.ours:
        found = re.search(figure.find, text, re.MULTILINE)
        if found is None:
            return "", f"its output has no {figure.find!r}"
        told.append(figure.say.format(*found.groups()))
    return "; ".join(told), ""


def code_version(benchmarks: Path) -> str:
    """Commit of the checkout with a mark where files differ from it; outside of one the version of the package."""
    asked = ["git", "-C", str(benchmarks), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        found = subprocess.run(asked, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return __version__
    return found.stdout.strip() if found.returncode == 0 else __version__


def machine() -> str:
    """Processor, cores and memory of this machine, and versions of the libraries that decide the figures."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    name = next(
        (line.split(":", 1)[1].strip() for line in _processor() if line.startswith("model name")), "unknown processor"
    )
    libraries = ", ".join(f"{library} {version(library)}" for library in LIBRARIES)
    return (
        f"{name}, {len(os.sched_getaffinity(0))} cores, {memory:.0f} GiB; Python {sys.version.split()[0]}, {libraries}"
    )


def _processor() -> list[str]:
    path = Path("/proc/cpuinfo")
    return path.read_text().splitlines() if path.exists() else []


def table(papers: Papers, store: LocalFolder, code: str) -> str:
    """The table of all rows that have a record, as Markdown."""
    lines = [
        "# The five papers and cityflow", "",
        f"By `cityflow bench`, code {code}, on {machine()}.", "",
        "| paper | what | the paper | cityflow | seed | measured |", "|---|---|---|---|---|---|",
    ]  # fmt: skip
    for name, row in papers.rows.items():
        known = _known(store, name)
        if known is None:
            lines.append(f"| {row.paper} | {row.what} | {row.theirs} | not measured | | |")
            continue
        seeds = sorted({made.seed for made in (row, *(papers.steps[s] for s in papers.before(row.needs))) if made.seed})
        age = "" if known.code == code else f", code {known.code}"
        ours = known.ours or f"**failed**: {known.failed}"
        lines.append(
            f"| {row.paper} | {row.what} | {row.theirs} | {ours} | {', '.join(map(str, seeds))} | {known.date}, {known.seconds:.0f} s{age} |"
        )
    return "\n".join(lines) + "\n"

"""How the commands on catalogs read files: on which cluster, with what is kept, and with a bar on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from cityflow.catalog.file_questions import Reading, in_silence
from cityflow.catalog.kept_answers import KeptAnswers
from cityflow.flow.spread import Spread


@contextmanager
def reading_files(scheduler: str, workers: int, console: Console, kept_beside: Path | None = None) -> Iterator[Reading]:
    """A reading of files, whose cluster ends with the block.

    Parameters
    ----------
    scheduler, workers : as `flow.spread.Spread`
    kept_beside : folder of the catalog that is made; what is read is kept in a file beside it

    Raises
    ------
    RunError, CatalogError
        No scheduler answers there, or another command makes the same catalog.
    """
    with ExitStack() as stack:
        spread = stack.enter_context(Spread(scheduler, workers, lambda page: console.print(f"Dashboard: {page}")))
        kept = stack.enter_context(KeptAnswers(kept_place(kept_beside) if kept_beside is not None else None))
        told = stack.enter_context(_bar(console)) if console.is_terminal else in_silence
        yield Reading(spread, kept, told)


def kept_place(catalog: Path) -> Path:
    """Where it is kept what was read of the files of a catalog."""
    place = catalog.absolute()
    return place.with_name(f".{place.name}-read.sqlite")


@contextmanager
def _bar(console: Console) -> Iterator[Callable[[str, int, int], None]]:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as progress:
        bars = {}

        def told(what: str, done: int, total: int) -> None:
            if what not in bars:
                bars[what] = progress.add_task(f"reading {what}")
            progress.update(bars[what], completed=done, total=total)

        yield told

"""Before a city: do the given poses contradict each other, and where they do, are adjusted ones better? The run goes on with what is found."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from cityflow.core.building import Status
from cityflow.errors import RunError
from cityflow.flow.cluster import threads_of
from cityflow.flow.exclusive import exclusive
from cityflow.flow.executor import run_tasks
from cityflow.flow.heartbeat import NEWS_EVERY_S, Heartbeat
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import watcher
from cityflow.flow.progress_counts import Expected
from cityflow.flow.run_news import RunNews
from cityflow.flow.run_page import TOLD_EVERY_S, pages_told, publisher
from cityflow.flow.store import Store
from cityflow.flow.talk import Talk
from cityflow.flow.task import Record, Task
from cityflow.flow.task_source import Source
from cityflow.handover.tie_sample import flown_of, stars_of
from cityflow.reporting.poses_words import lines_of_poses
from cityflow.runs.orientation_asked import RESULT, OrientationAsked, expected_in, note_expected, write_asked
from cityflow.runs.poses_note import NOTE, SettledPoses, write_poses
from cityflow.runs.prepare import Prepared
from cityflow.runs.settled_poses import digest_of_poses, is_refinable, sample_figures
from cityflow.stages.orient import ADJUST, FEATURES, TIES, OrientSource
from cityflow.stages.orient.pair_sample import SAMPLE, SampleSource
from cityflow.workflow.adjusted_block import AdjustedBlock, adjusted_block, write_refined
from cityflow.workflow.passes import Passes

WORK, CATALOG = "orient", "oriented"
"""Folders of the RUN: features, ties and records; the catalog with the adjusted poses, for other runs."""
SECONDS = {SAMPLE: 15.0, FEATURES: 20.0, TIES: 5.0, ADJUST: 30.0}
"""Of a task, before some are done: as `cityflow orient` expects them."""

USUAL_MB = {SAMPLE: 1500.0, FEATURES: 1500.0, TIES: 1000.0, ADJUST: 2000.0}
"""Memory that a task asks for before some are measured; set by hand."""

S = TypeVar("S", bound=Source)


@dataclass(frozen=True, slots=True)
class Driver:
    """Who drives the RUN.

    Attributes
    ----------
    begin : called when the RUN is this driver's, before the first task
    """

    client: Any
    beat: Heartbeat
    begin: Callable[[], object]
    talk: Talk


def with_settled_poses(wanted: Prepared, driver: Driver) -> Prepared:
    """The run, with poses that it goes on with; nothing is looked at where that is known already, or not asked for.

    Raises
    ------
    RunError, CatalogError
        Another run uses the folder, or poses cannot be adjusted though `orient.refine` says always.
    """
    if not is_refinable(wanted.workflow.city, wanted.given or wanted.catalog):
        if wanted.store.exists(NOTE):  # of before; the work stays, for whoever changes his mind
            with exclusive(wanted.store):
                driver.begin()
                wanted.store.remove(NOTE)
        return wanted.with_settled_poses()
    if wanted.poses is not None and wanted.poses.is_final:
        return wanted
    store = wanted.store
    with exclusive(store):
        driver.begin()
        with closing(RunNews(watcher(talk=driver.talk))) as news:
            news.tell_to(publisher(driver.client, store.root), TOLD_EVERY_S)
            news.tell_to(driver.beat.hear, NEWS_EVERY_S)
            news.message(pages_told(driver.client, store.root))
            settled = _Settling(wanted, driver.client, news).settled()
            write_poses(store, settled)
            for line in lines_of_poses(settled):
                news.message(line)
    return wanted.with_settled_poses()


class _Settling:
    def __init__(self, wanted: Prepared, client: Any, news: RunNews) -> None:
        self._wanted, self._client, self._news = wanted, client, news
        self._given = wanted.given or wanted.catalog
        self._asked = wanted.workflow.city.orient
        self._work = Store.open(wanted.store.url(WORK))

    def settled(self) -> SettledPoses:
        """What was found out."""
        flown = flown_of(self._given.images)
        names = [a.name for a in self._given.images]
        write_asked(self._work, OrientationAsked(self._given.href, self._wanted.store.url(CATALOG), False, of_run=True))
        found = SettledPoses(digest_of_poses(self._wanted.workflow.city, self._given), refined=False)
        with Ledger.open(self._work) as ledger:
            if self._asked.refine == "auto":
                stars = SampleSource(stars_of(flown))
                note_expected(self._work, _sample_counts(stars), names)
                sample = self._ran(lambda: SampleSource(stars_of(flown)), _sample_counts, ledger)
                error = sample.error
                found = replace(found, sample=sample_figures(error, sample.images), is_final=sample.is_whole)
                if not error.is_significant:
                    return self._unrefined(found)
            source = OrientSource(flown, self._asked)
            if source.pairs:
                counts = {**expected_in(self._work).counts, **_block_counts(source)}
                note_expected(self._work, counts, names)
                source = self._ran(lambda: OrientSource(flown, self._asked), _block_counts, ledger)
            try:
                block = self._adjusted(source, ledger)
            except RunError as error:
                if self._asked.refine == "always":
                    raise
                return self._unrefined(replace(found, problem=error.problem, is_final=False))
        found = replace(
            found, summary=block.summary, left_out=block.failed, is_final=found.is_final and not block.failed
        )
        if not block.summary["refined"]:
            return self._unrefined(found)
        if self._wanted.store.is_local:
            place = Path(self._wanted.store.url(CATALOG))
            write_refined(self._given, block, self._asked, place)
            self._work.write_bytes(RESULT, (place / RESULT).read_bytes())
        return replace(found, refined=True, block=block.block)

    def _unrefined(self, found: SettledPoses) -> SettledPoses:
        self._wanted.store.remove(CATALOG)
        return found

    def _adjusted(self, source: OrientSource, ledger: Ledger) -> AdjustedBlock:
        """Raises RunError where no block can be adjusted."""
        if not source.pairs:
            problem = "no two images see the same ground where the given poses have them"
            remedy = "cityflow catalog check; orient.refine=never takes the poses as they are"
            raise RunError(problem, where=self._given.href, remedy=remedy)
        return adjusted_block(source, self._work, ledger)

    def _ran(self, made: Callable[[], S], counts: Callable[[S], Mapping[str, int]], ledger: Ledger) -> S:
        """The source whose tasks have all ended; what failed is tried again, and what is damaged made again. Raises KeyboardInterrupt."""
        passes = Passes(_is_wanting, self._work.root)
        while True:
            source = made()
            expected = {stage: Expected(n, SECONDS[stage]) for stage, n in counts(source).items()}
            self._news.expect(expected, threads_of(self._client))
            ended = run_tasks(
                source, self._client, self._work, ledger, redo=passes.redo, progress=self._news, usual_mb=USUAL_MB
            )
            if ended.interrupted:
                raise KeyboardInterrupt
            self._news.expect({}, 1)
            if not passes.note(ended.damaged):
                return source


def _sample_counts(source: SampleSource) -> dict[str, int]:
    return {SAMPLE: len(source.stars)}


def _block_counts(source: OrientSource) -> dict[str, int]:
    return {FEATURES: len(source.partners), TIES: sum(map(bool, source.partners.values())), ADJUST: 1}


def _is_wanting(_task: Task, record: Record) -> bool:
    return record.status is not Status.DONE

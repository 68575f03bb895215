"""``cityflow update``: a RUN takes a new catalog, runs what that concerns, and reports which buildings have changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from rich.console import Console

from cityflow.core.parameters import merged
from cityflow.errors import RunError
from cityflow.flow.exclusive import exclusive
from cityflow.flow.ledger import Ledger
from cityflow.flow.talk import Talk
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.catalog.stac_outside import refuse_outside
from cityflow.reporting.change_report import PAGE, write_change_report
from cityflow.runs.asked import read_asked
from cityflow.runs.catalog_fits import SOURCES, refuse_unfit
from cityflow.runs.current import CurrentRecords, current_records, noted_records
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import describe_run, open_run, workflow_tree
from cityflow.runs.settings import checked, parse_setting
from cityflow.viewer.changes_page import ChangesPage
from cityflow.workflow.former_state import State, Update, begin_update, data_of, former_state, note_update
from cityflow.workflow.run import Extras, execute, failed_tasks
from cityflow.workflow.trust import refuse_untrusted


@dataclass(frozen=True, slots=True)
class UpdateRequest:
    """What the command line asks for.

    Attributes
    ----------
    catalog : the new one;  settings : only of the section ``changes``
    smaller : ground tiles may go;  trust, allow_outside : as of a run
    """

    run: str
    catalog: str
    settings: tuple[str, ...] = ()
    smaller: bool = False
    trust: bool = False
    allow_outside: bool = False


def update_run(asked: UpdateRequest, scheduler: str, workers: int, console: Console, talk: Talk = Talk.NORMAL) -> None:
    """Run what a new catalog concerns, and compare with the state before; an update that was interrupted, or whose failures are still there, goes on.

    Raises
    ------
    CatalogError, RunError
        Before anything is written, where the catalog does not fit; at the end, where more than single buildings failed.
    """
    run = open_run(asked.run)
    with_catalog = _with_catalog(run, asked.catalog, allow_outside=asked.allow_outside)
    wanted = _with_settings(with_catalog, asked.settings)
    run.store.check_writable()
    refuse_misfit(run, wanted, smaller=asked.smaller)
    if not asked.trust:
        refuse_untrusted(wanted, asked.settings, of_the_run=True)
    wanted.source().city.refuse_nothing()
    with exclusive(run.store), Ledger.open(run.store) as ledger:
        records = _records(run, ledger)
        update = begin_update(run, records, wanted, is_whole=not failed_tasks(records))
    if data_of(run.catalog) not in (update.former_data, update.data):
        note = (
            f"Update {update.number} has not ended well: changes are told since the state before it ({update.former})."
        )
        console.print(note, markup=False, highlight=False, soft_wrap=True)
    pages: list[ChangesPage] = []
    extras = Extras(before_report=lambda records: pages.append(_compared(wanted, update, records)))
    failure = None
    try:
        execute(wanted, scheduler, workers, console, lambda: describe_run(wanted), talk=talk, extras=extras)
    except RunError as error:
        if not pages:
            raise
        failure = error
    note_update(run.store, replace(update, state=State.FAILED if failure else State.DONE))
    for line in (f"Changes:  {pages[-1].in_short}", f"          {run.store.url(f'{update.folder}/{PAGE}')}"):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    if failure is not None:
        raise failure


def refuse_misfit(run: Prepared, wanted: Prepared, *, smaller: bool) -> None:
    """Make sure that the new catalog continues the survey.

    Raises
    ------
    RunError
        It has another CRS or surface source, or nothing over some ground tiles.
    """
    old, new = run.catalog.reference.code, wanted.catalog.reference.code
    if old != new:
        raise RunError(f"the RUN is in {old}, the catalog in {new}", where=wanted.catalog.href, remedy="make the catalog again with --crs " + old)  # fmt: skip
    # bounds of images follow from their poses: given ones are compared with given ones
    former, survey = (run.as_given() if wanted.poses is None else run).source().survey, wanted.source().survey
    if former.source.kind != survey.source.kind:
        raise RunError(
            f"the surface of the RUN is made of {SOURCES[former.source.kind]}, that of the catalog of {SOURCES[survey.source.kind]}",
            where=wanted.catalog.href, remedy="start a new RUN with `cityflow run … --out`",
        )  # fmt: skip
    lost = sorted(former.lattice.tiles.keys() - survey.lattice.tiles.keys())
    if lost and not smaller:
        raise RunError(
            f"the new catalog has nothing over {len(lost)} of {len(former.lattice.tiles)} ground tiles, such as {lost[0]}, whose products would go",
            where=wanted.catalog.href,
            remedy="make a catalog of all files, old and new (cityflow catalog create), or let those tiles go with --smaller",
        )  # fmt: skip


def _with_catalog(run: Prepared, catalog: str, *, allow_outside: bool) -> Prepared:
    found = read_catalog(catalog, allow_outside=allow_outside)
    if not allow_outside:
        refuse_outside(found)
    refuse_unfit(run.workflow.city, found)
    return replace(run, catalog=found, given=found).with_settled_poses()


def _with_settings(run: Prepared, settings: Sequence[str]) -> Prepared:
    """With those of the comparison."""
    tree = workflow_tree(run.workflow)
    for setting in settings:
        asked = parse_setting(setting)
        if next(iter(asked)) != "changes":
            raise RunError(
                f"'{setting}' is no parameter of the comparison", where="--set",
                remedy="set changes.…; other parameters with: cityflow run WORKFLOW --out RUN --set …",
            )  # fmt: skip
        tree = merged(tree, asked)
    return replace(run, workflow=checked(tree, where="--set")) if settings else run


def _records(run: Prepared, ledger: Ledger) -> CurrentRecords:
    """As the last command has noted them, else by the graph."""
    asked = read_asked(run.store, ledger)
    return current_records(run, ledger) if asked is None or asked.is_at_work else noted_records(asked, ledger)


def _compared(wanted: Prepared, update: Update, records: CurrentRecords) -> ChangesPage:
    page = ChangesPage(
        title=wanted.catalog.title, former=update.former, catalog=update.catalog, dates=(update.former_date, wanted.source().survey.date),
        failed=tuple(f"{row.stage}-{row.unit}: {row.reason}" for row in failed_tasks(records)), retry=f"cityflow rerun {wanted.store.root} --failed",
    )  # fmt: skip
    return write_change_report(wanted, records, former_state(wanted.store, update), page, update.folder)

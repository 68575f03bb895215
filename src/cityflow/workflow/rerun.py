"""``cityflow rerun``: runs units again, with other parameters if wanted, and the tasks that depend on them."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace

from rich.console import Console

from cityflow.errors import RunError, WorkflowError
from cityflow.flow.ledger import Ledger
from cityflow.flow.stage import Node
from cityflow.flow.talk import Talk
from cityflow.io.catalog.stac_outside import refuse_outside
from cityflow.pipeline.part_reach import Chosen
from cityflow.pipeline.pipeline import in_flow_order
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.asked import read_asked
from cityflow.runs.current import CurrentRecords, current_records
from cityflow.runs.known_keys import nearest
from cityflow.runs.overrides import clear_overrides, overrides_for, read_overrides, write_overrides
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import open_run
from cityflow.runs.settings import parse_setting
from cityflow.stages import match, outline, units
from cityflow.survey.city import City
from cityflow.workflow.chosen_part import Selection, part_of
from cityflow.workflow.run import Extras, execute
from cityflow.workflow.run_part import Where, execute_part
from cityflow.workflow.trust import refuse_untrusted
from cityflow.workflow.unit_names import named_in, refuse_unknown_stage

UNITS_NAMED = 5


@dataclass(frozen=True, slots=True)
class Rerun:
    """What is asked for.

    Attributes
    ----------
    settings, clear : parameters for the chosen units; forget earlier ones
    trust : import functions that the RUN alone names
    allow_outside : the catalog may name files elsewhere
    """

    selection: Selection
    settings: tuple[str, ...] = ()
    clear: bool = False
    trust: bool = False
    allow_outside: bool = False


def rerun_units(
    url: str, asked: Rerun, scheduler: str, workers: int, console: Console, talk: Talk = Talk.NORMAL, *, request: str = ""
) -> None:  # fmt: skip
    """Run the chosen units, named or by unique parts of their names, again.

    Parameters
    ----------
    request : of the command, where Dask may start several drivers for it; empty: one of its own

    Raises
    ------
    RunError
        A stage or a unit is not known, or the RUN cannot be used.
    """
    wanted = open_run(url)
    with Ledger.open(wanted.store) as ledger:
        found = chosen_units(wanted, ledger, asked)
        if not found.nodes:
            console.print(f"Nothing to run again: {why_nothing(asked.selection)}.", markup=False, soft_wrap=True)
            return
        kept = {} if asked.clear else read_overrides(wanted.store)
        values = overrides_for(found.nodes, asked.settings, kept, wanted.workflow.city)

        def begin() -> None:
            if asked.clear:
                clear_overrides(wanted.store, found.nodes)
            write_overrides(wanted.store, values)

        console.print(f"Running again: {counted(len(found.nodes), 'task')}, then what depends on it", markup=False)
        if found.part is not None:
            execute_part(wanted, ledger, found.part, begin, Where(scheduler, workers, request), console, talk)
            return
    execute(
        wanted, scheduler, workers, console, begin, redo=lambda task, _: (task.stage, task.unit) in found.nodes, talk=talk,
        extras=Extras(request=request),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Found:
    """Stage and unit of what is chosen, and its part of the city; None where the whole city has to be gone through."""

    nodes: AbstractSet[Node]
    part: Chosen | None


def chosen_units(wanted: Prepared, ledger: Ledger, asked: Rerun) -> Found:
    """What is chosen, and may run again. Raises RunError, WorkflowError."""
    if not asked.allow_outside:
        refuse_outside(wanted.catalog)
    selection = replace(asked.selection, units=tuple(named_in(wanted.store.root, asked.selection.units, ledger)))
    refuse_unknown_stage(selection.stage, in_flow_order(ledger.stages()))
    city = wanted.source(ledger).city
    part = (
        None
        if _concerns_all(wanted, ledger, city, replace(asked, selection=selection))
        else part_of(city, ledger, selection)
    )
    chosen = select(current_records(wanted, ledger), selection) if part is None else part.nodes
    if not asked.trust:
        refuse_untrusted(wanted, asked.settings, of_the_run=True, cleared=chosen if asked.clear else frozenset())
    refuse_foreign(asked.settings, chosen, lambda: current_records(wanted, ledger), wanted.store.root)
    return Found(chosen, part)


def _concerns_all(wanted: Prepared, ledger: Ledger, city: City, asked: Rerun) -> bool:
    """Whether the whole city has to be gone through: for poses that nobody has looked at yet, for outlines with other parameters, as these say how they are
    found, and where given outlines are split now, as the first border is drawn, or no longer."""
    if wanted.poses_are_unknown or asked.selection.stage != outline.NAME:
        return wanted.poses_are_unknown
    if asked.settings or asked.clear:
        return True
    survey, was_split = city.survey, bool(ledger.units(units.NAME))
    if not survey.outlines_given or survey.looks_for_borders or not (survey.splits or was_split):
        return False
    note = read_asked(wanted.store, ledger)
    return note is None or (units.NAME in note.tasks) != survey.splits


def why_nothing(selection: Selection) -> str:
    """Why nothing is chosen, where all that was asked for is known."""
    if not selection.failed:
        return "no unit is of that kind"
    of = f" of the stage {selection.stage}" if selection.stage else ""
    named = " of those named" if selection.units else ""
    return f"no unit{of}{named} has failed" + (" or is degraded" if selection.degraded else "")


def select(records: CurrentRecords, selection: Selection) -> set[Node]:
    """(stage, unit) of the units that the selection names; a ground tile names the images that are matched over it.

    Raises RunError where one is named that the city does not have.
    """
    stages = records.stages()
    over = images_over(records, selection)
    chosen = {
        (s, row.unit)
        for s in stages
        if selection.stage in ("", s)
        for row in records.rows(s)
        if (replace(selection, units=()) if s == match.NAME and row.unit in over else selection).is_met_by(row)
    }
    missing = set(selection.units) - {u for _, u in chosen} - {tile for tiles in over.values() for tile in tiles}
    if missing and not selection.failed:
        raise RunError(
            f"no unit '{sorted(missing)[0]}' in this run",
            where="--unit",
            remedy="`cityflow status RUN --units` lists the buildings",
        )
    return chosen


def images_over(records: CurrentRecords, selection: Selection) -> dict[str, set[str]]:
    """Tasks of images that are matched over a named ground tile, where images are chosen from, and these tiles."""
    if selection.stage != match.NAME or not selection.units:
        return {}
    found = {r.unit: set(match.ground_of(r)) & set(selection.units) for r in records.of(match.NAME)}
    return {unit: tiles for unit, tiles in found.items() if tiles}


def refuse_foreign(
    settings: Sequence[str], chosen: AbstractSet[Node], records: Callable[[], CurrentRecords], run: str
) -> None:
    """Make sure that every setting is of a stage that a chosen unit has; say where else it can be set, by the records of the whole city.

    Raises
    ------
    WorkflowError
        It is of no section, of a section that is no stage, or of a stage none of whose units is chosen.
    """
    stages = {stage for stage, _ in chosen}
    for setting in settings if chosen else ():
        section = next(iter(parse_setting(setting)))
        if section in stages:
            continue
        known = list(CityParameters.model_fields)
        if section not in known:
            near = nearest(section, sorted({*known, *stages}))
            raise WorkflowError(
                f"no parameter begins with '{section}'", where="--set", remedy=f"the nearest is '{near}'"
            )
        raise WorkflowError(
            f"'{setting}': {_whose(chosen)} no task of '{section}' (but of {', '.join(sorted(stages))})",
            where="--set",
            remedy=_elsewhere(section, setting, chosen, records(), run),
        )


def counted(number: int, what: str) -> str:
    """
    >>> counted(1, "task"), counted(3, "task")
    ('1 task', '3 tasks')
    """
    return f"{number} {what}{'' if number == 1 else 's'}"


def _whose(chosen: AbstractSet[Node]) -> str:
    units = {unit for _, unit in chosen}
    return f"{next(iter(units))} has" if len(units) == 1 else "what is chosen has"


def _elsewhere(section: str, setting: str, chosen: AbstractSet[Node], records: CurrentRecords, run: str) -> str:
    """Where a setting takes effect: on the report, on the tiles of the chosen units, on the whole run."""
    quoted, here = shlex.quote(setting), shlex.quote(run)
    if section == "report":
        return f"cityflow report {here} --set {quoted}"
    whole = f"cityflow run WORKFLOW --out {here} --set {quoted}"
    names = set(records.units(section))
    if not names:
        return f"it is one value for the whole run: {whole}"
    tiles = sorted(_tiles_of({unit for _, unit in chosen}, records) & names)
    on = f"the {'tiles' if tiles else 'units'} that have one"
    named = "".join(f" --unit {shlex.quote(t)}" for t in tiles[:UNITS_NAMED])
    return f"for {on}: cityflow rerun {here} --stage {section}{named} --set {quoted}; for the whole run: {whole}"


def _tiles_of(units_wanted: AbstractSet[str], records: CurrentRecords) -> set[str]:
    """Ground tiles that own any of some units."""
    owners = records.of(units.NAME) or records.of(outline.NAME)
    return {r.unit for r in owners if any(entry["id"] in units_wanted for entry in r.result.get("units", []))}

"""``cityflow status``: how far a run is, and what failed why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.viewer.rows import EditRow
from cityflow.workflow.current import CurrentRecords, StageFigures, current_records
from cityflow.workflow.prepare import Prepared
from cityflow.workflow.run_folder import open_run
from cityflow.workflow.unused_edits import unused_edits

REASONS_SHOWN = 12
UNITS_NAMED = 3


def print_status(url: str, console: Console) -> None:
    """Print a line per stage and the reasons of what failed."""
    wanted = open_run(url)
    with Ledger.open(wanted.store) as ledger:
        records = current_records(wanted, ledger)
    console.print(f"{wanted.workflow.name}: {wanted.catalog.title} in {wanted.store.root}", markup=False)
    _print_stages(records, console)
    _print_reasons(records, wanted, console)
    _print_unused(unused_edits(wanted, records), console)


def print_summary(records: CurrentRecords, wanted: Prepared, report: str, console: Console) -> None:
    """What stands on the terminal when a run has ended."""
    _print_stages(records, console)
    _print_reasons(records, wanted, console)
    _print_unused(unused_edits(wanted, records), console)
    console.print(f"Report:   {report}", markup=False, soft_wrap=True)
    console.print(f"Products: {wanted.store.url('products')}", markup=False, soft_wrap=True)
    console.print(f"View:     cityflow view {wanted.store.url('')}".rstrip("/"), markup=False, soft_wrap=True)


def _print_stages(records: CurrentRecords, console: Console) -> None:
    table = Table("stage", *(str(s) for s in Status), "mean s", "peak MB")
    for stage in records.stages():
        figures = StageFigures.of(records.of(stage))
        counts = (str(figures.count[status]) for status in Status)
        table.add_row(stage, *counts, f"{figures.mean_seconds:.2f}", f"{figures.peak_mb:.0f}")
    console.print(table)


def _print_reasons(records: CurrentRecords, wanted: Prepared, console: Console) -> None:
    for stage in records.stages():
        for status in (Status.FAILED, Status.REFUSED, Status.DEGRADED):
            reasons: dict[str, list[str]] = {}
            for record in records.of(stage):
                if record.status is status:
                    first = record.reason.splitlines()[0] if record.reason else "no reason given"
                    reasons.setdefault(first, []).append(record.unit)
            ranked = Counter({reason: len(units) for reason, units in reasons.items()}).most_common(REASONS_SHOWN)
            for reason, n in ranked:
                named = ", ".join(reasons[reason][:UNITS_NAMED]) + (", …" if n > UNITS_NAMED else "")
                console.print(
                    f"{stage} {status}: {n} × {reason} ({named})", markup=False, highlight=False, soft_wrap=True
                )
            if ranked and status is Status.FAILED:
                console.print(
                    f"    cityflow rerun {wanted.store.root} --failed", markup=False, highlight=False, soft_wrap=True
                )


def _print_unused(edits: Sequence[EditRow], console: Console) -> None:
    """Edits without effect, and what to do about each kind."""
    for edit in edits[:REASONS_SHOWN]:
        console.print(
            f"edit without effect: {edit.text} → {edit.remedy}", markup=False, highlight=False, soft_wrap=True
        )
    if len(edits) > REASONS_SHOWN:
        console.print(f"    and {len(edits) - REASONS_SHOWN} more edits without effect: see report.html", markup=False)

"""``cityflow status``: how far a run is, and what failed why."""

from __future__ import annotations

from collections import Counter

from rich.console import Console
from rich.table import Table

from cityflow.core.building import Status
from cityflow.flow.ledger import Ledger
from cityflow.workflow.prepare import Prepared
from cityflow.workflow.run_folder import open_run

REASONS_SHOWN = 12
UNITS_NAMED = 3


def print_status(url: str, console: Console) -> None:
    """Print a line per stage and the reasons of what failed."""
    wanted = open_run(url)
    with Ledger.open(wanted.store) as ledger:
        console.print(f"{wanted.workflow.name}: {wanted.catalog.title} in {wanted.store.root}", markup=False)
        _print_stages(ledger, console)
        _print_reasons(ledger, wanted, console)


def print_summary(ledger: Ledger, wanted: Prepared, report: str, console: Console) -> None:
    """What stands on the terminal when a run has ended."""
    _print_stages(ledger, console)
    _print_reasons(ledger, wanted, console)
    console.print(f"Report:   {report}", markup=False, soft_wrap=True)
    console.print(f"Products: {wanted.store.url('products')}", markup=False, soft_wrap=True)


def _print_stages(ledger: Ledger, console: Console) -> None:
    table = Table("stage", *(str(s) for s in Status), "mean s", "peak MB")
    for stage in ledger.stages():
        counts = ledger.count_by_status(stage)
        seconds, peak = ledger.mean_seconds(stage), ledger.peak_mb(stage)
        table.add_row(stage, *(str(counts[s]) for s in Status), f"{seconds or 0:.2f}", f"{peak or 0:.0f}")
    console.print(table)


def _print_reasons(ledger: Ledger, wanted: Prepared, console: Console) -> None:
    for stage in ledger.stages():
        for status in (Status.FAILED, Status.REFUSED, Status.DEGRADED):
            reasons: dict[str, list[str]] = {}
            for unit in ledger.units(stage, status):
                record = ledger.latest(stage, unit)
                if record is not None:
                    reasons.setdefault(
                        record.reason.splitlines()[0] if record.reason else "no reason given", []
                    ).append(unit)
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

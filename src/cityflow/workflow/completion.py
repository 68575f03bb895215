"""Shell completion of runs, workflow files, parameters and units. Errors give no completion."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import typer

from cityflow.errors import CityflowError
from cityflow.runs.common_keys import offered
from cityflow.runs.first_look import DESCRIPTION
from cityflow.runs.known_keys import known_keys

MOST = 200


def runs(incomplete: str) -> list[str]:
    """Runs, and folders on the way to them."""
    return [f"{f}" if (f / DESCRIPTION).is_file() else f"{f}/" for f in _below(incomplete) if f.is_dir()]


def workflows(incomplete: str) -> list[str]:
    """YAML files, and folders on the way to them."""
    return [
        f"{f}/" if f.is_dir() else f"{f}" for f in _below(incomplete) if f.is_dir() or f.suffix in (".yaml", ".yml")
    ]


def keys(incomplete: str) -> list[str]:
    """Parameters of a run."""
    return offered(known_keys(), incomplete)


def settings(incomplete: str) -> list[str]:
    """``key=`` of the parameters; behind the ``=`` what the value may be, where there is a choice."""
    key, equals, _ = incomplete.partition("=")
    known = known_keys()
    if not equals:
        return [f"{k}=" for k in offered(known, key)]
    may_be = known[key].may_be.split(";")[0] if key in known else ""
    for begin in ("one of ", "any of "):
        if may_be.startswith(begin):
            return [f"{key}={value}" for value in may_be.removeprefix(begin).removesuffix(" or null").split(", ")]
    return [f"{key}=true", f"{key}=false"] if may_be == "true or false" else []


def units(ctx: typer.Context, incomplete: str) -> list[str]:
    """Buildings of the run that the command names."""
    from cityflow.flow.ledger import Ledger
    from cityflow.flow.store import Store

    with suppress(CityflowError, OSError):
        store = Store.open(str(ctx.params.get("run_url") or ""))
        if store.exists(DESCRIPTION):
            with Ledger.open(store) as ledger:
                return [u for u in ledger.units("reconstruct") if u.startswith(incomplete)][:MOST]
    return []


def _below(incomplete: str) -> Iterator[Path]:
    folder = Path(incomplete) if incomplete.endswith("/") else Path(incomplete).parent
    begin = "" if incomplete.endswith("/") else Path(incomplete).name
    with suppress(OSError):
        yield from sorted(
            p
            for p in folder.iterdir()
            if p.name.startswith(begin) and (begin.startswith(".") or not p.name.startswith("."))
        )

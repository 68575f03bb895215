"""``cityflow view`` and ``cityflow desk``: runs in the browser."""

from __future__ import annotations

import json
import os
import shlex
import sys
import webbrowser
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from http.server import ThreadingHTTPServer
from itertools import chain, count
from typing import Any

from rich.console import Console

from cityflow.errors import CityflowError, RunError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.reporting.run_report import report_data
from cityflow.reporting.view import CITY, state_of, write_run_view
from cityflow.runs.asked import read_asked
from cityflow.runs.current import CurrentRecords, known_records
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import open_run
from cityflow.stages import reconstruct
from cityflow.viewer.cities_page import cities_page
from cityflow.viewer.desk_server import DeskHandler
from cityflow.viewer.server import Read, Served, is_local, server_for
from cityflow.viewer.view_page import PAGE, STATIC, static
from cityflow.workflow.desk import RunDesk
from cityflow.workflow.desk_compare import FOLDER

HOST = "127.0.0.1"


def view_runs(urls: Sequence[str], port: int, with_browser: bool, console: Console) -> None:
    """Serve runs until Ctrl+C; a page is written first where there is none, or where the run has gone on since.

    Raises
    ------
    RunError
        One of them is no run, or the port is taken.
    """
    for url in urls:
        bring_up_to_date(url, console)
    names = distinct_names(urls)
    runs = [Served(n, shlex.quote(u), reader(Store.open(u))) for n, u in zip(names, urls, strict=True)]
    several = len(runs) > 1
    try:
        server = server_for(runs, HOST, port, partial(cities_page, runs) if several else None)
    except OSError as error:
        raise _taken(HOST, port, error) from error
    address = f"http://{HOST}:{server.server_address[1]}/{'' if several else 'view/index.html'}"
    console.print(f"{address}  (Ctrl+C ends)", markup=False, highlight=False, soft_wrap=True)
    _served(server, address, with_browser, console)


@dataclass(frozen=True, slots=True)
class AtDesk:
    """Who works at a desk, and with what: `options` of every `cityflow rerun`; `other`: address of a run to compare with, empty: none."""

    who: str
    options: Sequence[str] = ()
    other: str = ""


def desk_run(url: str, at: AtDesk, host: str, port: int, with_browser: bool, console: Console) -> None:
    """Serve the desk of a run until Ctrl+C.

    Raises
    ------
    RunError
        It is no run, or the place is taken, or the two cannot be compared.
    """
    for one in (url, at.other) if at.other else (url,):
        bring_up_to_date(one, console)
    desk = RunDesk(
        url, at.who, at.options, partial(bring_up_to_date, url, Console(quiet=True)), not is_local(host), at.other
    )
    served = [Served("run", shlex.quote(url), reader(Store.open(url)), {"desk": True})]
    if at.other:
        served.append(Served(FOLDER, shlex.quote(at.other), reader(Store.open(at.other))))
    handler = type("Handler", (DeskHandler,), {"desk": desk})
    try:
        server = server_for(served, host, port, base=handler)
    except OSError as error:
        raise _taken(host, port, error) from error
    address = f"http://{host}:{server.server_address[1]}/view/index.html?token={desk.token}"
    console.print(f"{address}  (Ctrl+C ends)", markup=False, highlight=False, soft_wrap=True)
    if desk.is_open:
        console.print("Other machines can read this run; whoever has the address can change it.")
    desk.start()
    _served(server, address, with_browser, console)
    desk.close()


def _taken(host: str, port: int, error: OSError) -> RunError:
    return RunError(
        f"port {port} is taken ({error})", where=host, remedy="name another one with --port, or 0 for any that is free"
    )  # fmt: skip


def _served(server: ThreadingHTTPServer, address: str, with_browser: bool, console: Console) -> None:
    if with_browser and _has_screen():
        webbrowser.open(address)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        console.print("Ended.")
    finally:
        server.server_close()


def _has_screen() -> bool:
    """Without one, a browser for the terminal would be started in place of this program."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY"))


def distinct_names(urls: Sequence[str]) -> list[str]:
    """A name for each of several runs: the last part of its path, numbered where it is not the only one of that name.

    >>> distinct_names(["runs/delft/", "s3://city/delft", "view"])
    ['delft', 'delft-2', 'view-2']
    >>> distinct_names(["a/x", "b/x", "c/x-2"])
    ['x', 'x-2', 'x-2-2']
    """
    # what a run at the root would be asked for is no name
    taken, names = {"view", "products", "report"}, list[str]()
    for url in urls:
        last = url.rstrip("/").rsplit("/", 1)[-1] or "run"
        name = next(n for n in chain((last,), (f"{last}-{k}" for k in count(2))) if n not in taken)
        taken.add(name)
        names.append(name)
    return names


def bring_up_to_date(url: str, console: Console) -> None:
    """Write the page of a run where it has none, or where anything was made since.

    A page stays as it is where nothing newer can be said: the run was made by a version with other parameters, or what it
    was made from has changed and no building is up to date.
    """
    before = _before(Store.open(url))
    try:
        run = open_run(url)
    except CityflowError as error:
        if not before:
            raise
        console.print(f"Note: shown as it was when it was last written; {error}", markup=False, soft_wrap=True)
        return
    with Ledger.open(run.store) as ledger:
        _write_anew(run, known_records(run, ledger, read_asked(run.store, ledger)), before, console)


def _write_anew(run: Prepared, records: CurrentRecords, before: dict[str, Any], console: Console) -> None:
    if before and before["state"] == state_of(records) and _has_its_city(run.store, before):
        return
    if before and sum(before["counts"].values()) and not records.of(reconstruct.NAME):
        console.print("Note: shown as it was when it was last written; its inputs have changed since, run it again.")
        return
    console.print("Writing the page …")
    try:
        write_run_view(run, records, report_data(records.checking(run), records))
    except PermissionError as error:
        raise RunError(
            f"the page cannot be written ({error})",
            where=run.store.root,
            remedy="ask its owner to run `cityflow view`",
        ) from error


def reader(store: Store) -> Read:
    """Contents of a file of the run by its path; what every page shares comes from the program that serves it."""
    shared = {f"{PAGE.rsplit('/', 1)[0]}/{name}": name for name in STATIC}

    def read(path: str) -> bytes | None:
        if path in shared:
            return static(shared[path])
        try:
            return store.read_bytes(path) if not store.is_local or is_inside(store.root, path) else None
        except (OSError, ValueError):
            return None

    return read


def is_inside(root: str, path: str) -> bool:
    """Whether a path names a plain file below a folder, also after every link in it: a RUN may be somebody else's."""
    top, file = os.path.realpath(root), os.path.realpath(os.path.join(root, path))
    return os.path.commonpath([top, file]) == top and os.path.isfile(file)


def _has_its_city(store: Store, before: Mapping[str, Any]) -> bool:
    """Whether the tilesets that the page reads are still there."""
    return all(store.exists(path) for path in before.get("sets", {}).values() if path)


def _before(store: Store) -> dict[str, Any]:
    """What the page of before says of the city; nothing where there is no whole page."""
    try:
        entry = json.loads(store.read_bytes(CITY))
        return dict(entry) if store.exists(PAGE) and {"state", "counts"} <= set(entry) else {}
    except (FileNotFoundError, NotADirectoryError, ValueError):
        return {}

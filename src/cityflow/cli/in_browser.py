"""Commands that serve runs to a browser."""

from __future__ import annotations

from typing import Annotated

import typer

from cityflow.cli import options
from cityflow.cli.options import OutsideOption, RunArgument, SchedulerOption, TrustOption, WorkersOption
from cityflow.runs.first_look import look_at_run
from cityflow.runs.look_at_places import look_at_scheduler


def desk(
    run_url: RunArgument,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0: any free one")] = 8124,
    host: Annotated[
        str, typer.Option(help="Address that the desk is reached at; another one than this machine's own opens the RUN to the network")
    ] = "127.0.0.1",
    other: Annotated[
        str, typer.Option("--with", metavar="OTHER", help="Another run of the same place: both in one scene, with a table of differences")
    ] = "",
    name: Annotated[str, typer.Option(help="Your name beside edits and notes; default: that of the account")] = "",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open it in the browser")] = True,
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
    trust: TrustOption = False,
    allow_outside: OutsideOption = False,
) -> None:  # fmt: skip
    """Work on a run in the browser: watch it, review its buildings, correct and rerun them."""
    for url in (run_url, other) if other else (run_url,):
        look_at_run(url)
    look_at_scheduler(scheduler)
    from getpass import getuser

    from cityflow.workflow.serve import AtDesk, desk_run

    options_of_reruns = [
        *([f"--scheduler={scheduler}"] if scheduler else []), *([f"--workers={workers}"] if workers else []),
        *(["--trust"] if trust else []), *(["--allow-outside"] if allow_outside else []),
    ]  # fmt: skip
    desk_run(run_url, AtDesk(name or getuser(), options_of_reruns, other), host, port, browser, options.console)


def view(
    run_urls: Annotated[list[str], typer.Argument(metavar="RUN…", help="Folders or URLs of runs")],
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this machine; 0: any free one")] = 8123,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open it in the browser")] = True,
) -> None:
    """View runs in the browser: the textured city, figures of buildings, measurements, sections."""
    for url in run_urls:
        look_at_run(url)
    from cityflow.workflow.serve import view_runs

    view_runs(run_urls, port, browser, options.console)

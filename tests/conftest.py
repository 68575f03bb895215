"""What holds for all tests."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import hypothesis
import pytest

from made_once import forget
from missing_tools import missing_tools
from shared_processes import Scheduling, turn

if TYPE_CHECKING:
    from browser.painted_run import Made

# What schedulers and workers do while they wait: 5 % of a core for each pair, and some pairs live as long as the tests
os.environ |= {
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
    "DASK_DISTRIBUTED__ADMIN__SYSTEM_MONITOR__INTERVAL": "5s",
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
}

# a machine that others use, too, is slow now and then: that says nothing of the code
hypothesis.settings.register_profile("cityflow", suppress_health_check=[hypothesis.HealthCheck.too_slow])
hypothesis.settings.load_profile("cityflow")


# with Python's usual 700 new objects between two collections, these take a tenth of what imports and compiles; of what is imported hardly anything can go
gc.set_threshold(20_000)
gc.disable()

# a shell that starts the tests in the background has Ctrl-C ignored in all its children
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def painted_town(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """A finished run of the painted town, without a page and a report; read only."""
    from browser import painted_run  # whoever wants no town loads nothing for one

    folder = tmp_path_factory.mktemp("painted_town")
    wanted = painted_run.prepare(painted_run.write_catalog(folder), folder / "run")
    return wanted, painted_run.make_run(wanted)


@pytest.fixture(scope="module")
def painted_copy(painted_town: Made, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """A copy of it that the tests of a module may change."""
    from browser import painted_run

    return painted_run.copied(painted_town, tmp_path_factory.mktemp("painted") / "run")


def pytest_collection_finish() -> None:
    """What modules and tests hold stays: no collection needs to look at it again."""
    gc.freeze()
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Those that take longest first."""
    items.sort(key=lambda item: turn(item.nodeid.split("::", 1)[0]))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Scheduling | None:
    return Scheduling(config, log) if config.getvalue("dist") == "loadfile" else None


@pytest.hookimpl(wrapper=True)
def pytest_sessionfinish(session: pytest.Session) -> Iterator[None]:
    """When all processes have ended, what they made for each other goes."""
    shared = session.config.pluginmanager.getplugin("dsession")
    run = shared.nodemanager.testrunuid if shared is not None else None
    yield
    if run:
        forget(run)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the groups that were skipped for lack of a tool."""
    lines = list(missing_tools(map(reason, terminalreporter.stats.get("skipped", []))))
    if lines:
        terminalreporter.section("skipped for lack of a tool", yellow=True)
        for line in lines:
            terminalreporter.write_line(line)


def reason(report: pytest.TestReport) -> str:
    """Of a skip."""
    return report.longrepr[2] if isinstance(report.longrepr, tuple) else str(report.longrepr)

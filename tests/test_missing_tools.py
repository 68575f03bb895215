from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import execnet
import pytest

from conftest import reason
from missing_tools import TOOLS, missing_tools

HERE = Path(__file__).parent
SKIPS = ("skip", "skipif", "importorskip")
OF_THE_DATA = (
    "a dozen points",
    "peaks of memory are counted otherwise",
    "given outlines are not split",
    "given outlines are dealt out anew",
    "no textures",
    "waiting for a core is counted otherwise",
)
"""Reasons that no tool would fix."""


def reasons_in(path: Path) -> Iterator[str]:
    """Texts of all calls of `skip`, `skipif` and `importorskip` in a file, and of the constants that they name."""
    tree = ast.parse(path.read_text("utf-8"))
    constants = {n.targets[0].id: n.value for n in tree.body if isinstance(n, ast.Assign) and isinstance(n.targets[0], ast.Name)}  # fmt: skip
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and call.func.attr in SKIPS:
            said = [k.value for k in call.keywords if k.arg == "reason"] or call.args[:1]
            for value in said:
                text = constants.get(value.id, value) if isinstance(value, ast.Name) else value
                texts = [n.value for n in ast.walk(text) if isinstance(n, ast.Constant) and isinstance(n.value, str)]
                yield texts[0] if texts else ""


def test_every_reason_in_the_tests_is_that_of_a_tool() -> None:
    """Who skips a test for lack of something new names it in `TOOLS`."""
    reasons = [(p.name, r) for p in sorted(HERE.rglob("*.py")) for r in reasons_in(p)]
    assert len(reasons) > 6
    assert [r for r in reasons if r[1] not in OF_THE_DATA and not list(missing_tools([r[1]]))] == []


def test_all_is_there() -> None:
    assert list(missing_tools(["Skipped: a dozen points"])) == []


def test_a_test_run_says_in_the_end_what_it_skipped(tmp_path: Path) -> None:
    """Also where it is quiet."""
    for name in ("conftest.py", "made_once.py", "missing_tools.py", "shared_processes.py"):
        shutil.copy(HERE / name, tmp_path / name)
    (tmp_path / "test_it.py").write_text(
        "import pytest\n"
        "@pytest.fixture\ndef browser(): pytest.skip('no Chromium here')\n"
        "def test_one(browser): pass\ndef test_two(browser): pass\n"
        "@pytest.mark.skipif(True, reason='a dozen points')\ndef test_three(): pass\n"
        "def test_four(): pass\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--rootdir", str(tmp_path), "-q", "."],
        cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    said = done.stdout.split("skipped for lack of a tool")[1].splitlines()[1:]
    assert said[0].startswith(f"{TOOLS[0].name}: 2 tests skipped; not checked: {TOOLS[0].unchecked}")
    assert not [line for line in said if line.startswith(TOOLS[1].name)]


def test_a_skip_in_another_process_has_its_reason(pytestconfig: pytest.Config) -> None:
    """Several processes share the tests: what they report travels as plain values."""
    sent = pytest.TestReport(
        "a.py::test", ("a.py", 1, "test"), {}, "skipped", ("a.py", 1, "Skipped: no Chromium here"), "setup"
    )
    plain = execnet.loads(
        execnet.dumps(pytestconfig.hook.pytest_report_to_serializable(config=pytestconfig, report=sent))
    )
    back = pytestconfig.hook.pytest_report_from_serializable(config=pytestconfig, data=plain)
    assert list(missing_tools([reason(back)])) == list(missing_tools(["no Chromium here"])) != []

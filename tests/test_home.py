"""What the hosting page reads: valid YAML, pinned actions, the tools and versions of the gate."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import yaml

import cityflow

ROOT = Path(__file__).parents[1]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def test_actions_are_pinned_to_a_commit_with_their_version_beside_it() -> None:
    assert WORKFLOWS
    used = [line for path in WORKFLOWS for line in path.read_text().splitlines() if "uses:" in line]
    assert used
    assert not [line for line in used if not re.search(r"uses: [\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+$", line)]


def test_the_gate_runs_on_all_pythons_that_the_package_takes() -> None:
    gate = yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text())["jobs"]["gate"]
    versions = gate["strategy"]["matrix"]["python"]
    least = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"]
    assert least == f">={versions[0]}"
    assert {"run": ".ci/run", "env": {"PYTHON": "python${{ matrix.python }}"}} in gate["steps"]


def test_forms_and_hooks_can_be_read() -> None:
    forms = [
        yaml.safe_load(p.read_text()) for p in (ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml") if p.stem != "config"
    ]
    assert all(form["name"] and form["description"] and form["body"] for form in forms)
    (repo,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    makefile = (ROOT / "Makefile").read_text()
    tools = [hook["entry"].split()[0].removeprefix(".venv/bin/") for hook in repo["hooks"]]
    assert all(f"$(BIN)/{tool}" in makefile for tool in tools)


def test_the_citation_names_this_version() -> None:
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == cityflow.__version__

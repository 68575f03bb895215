"""What `cityflow parameters` shows first, and what a shell offers."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from cityflow import cli
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.common_keys import COMMON, offered
from cityflow.runs.known_keys import AT_TOP, Key
from cityflow.runs.model_keys import model_keys
from cityflow.runs.settings import known_part

WORKFLOWS = sorted((Path(__file__).parents[2] / "workflows").glob("*.yaml"))


@pytest.fixture(scope="module")
def keys() -> dict[str, Key]:
    return model_keys(CityParameters)


def printed(capsys: pytest.CaptureFixture[str], *words: str) -> list[str]:
    cli.app(["parameters", *words], standalone_mode=False)
    return capsys.readouterr().out.splitlines()


def names(tree: object, above: str = "") -> list[str]:
    """Dotted keys of a workflow's tree."""
    if not isinstance(tree, dict):
        return [above]
    return [name for key, value in tree.items() for name in names(value, f"{above}.{key}" if above else key)]


def test_they_are_a_few_dozen_keys_of_the_model_in_its_order(keys: dict[str, Key]) -> None:
    assert list(COMMON) == [key for key in keys if key in COMMON]
    assert 24 <= len(COMMON) <= 60


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.stem)
def test_what_a_shipped_workflow_sets_is_among_them(workflow: Path) -> None:
    tree = yaml.safe_load(workflow.read_text(encoding="utf-8"))
    set_there = {name for name in names(known_part(tree)) if name not in AT_TOP}
    assert set_there
    assert set_there <= set(COMMON)


def test_the_command_shows_them_and_says_how_many_more_there_are(
    keys: dict[str, Key], capsys: pytest.CaptureFixture[str]
) -> None:
    *lines, empty, last = printed(capsys)
    assert [line.split(" = ")[0] for line in lines] == list(COMMON)
    assert not empty
    assert last.startswith(f"{len(keys) - len(COMMON)} more: ")
    assert "--all" in last


def test_all_and_any_word_search_every_key(keys: dict[str, Key], capsys: pytest.CaptureFixture[str]) -> None:
    assert [line.split(" = ")[0] for line in printed(capsys, "--all")] == list(keys)
    rare = next(key for key in keys if key not in COMMON)
    assert [line.split(" = ")[0] for line in printed(capsys, rare)] == [rare]


def test_a_shell_offers_the_common_ones_until_something_is_typed(keys: dict[str, Key]) -> None:
    assert offered(keys, "") == list(COMMON)
    assert offered(keys, "surface.d") == [key for key in keys if key.startswith("surface.d")]

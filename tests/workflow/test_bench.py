"""``cityflow bench`` on rows of its own: figures, what fails, what is kept, what a stopped command does again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rich.console import Console

from cityflow.errors import CityflowError
from cityflow.workflow.bench import bench, read_papers

ROWS = """
steps:
  town:
    command: python -c "import pathlib; p = pathlib.Path(r'{out}'); p.mkdir(); (p / 'seed').write_text('{seed}')"
    seed: 91
    minutes: 1
rows:
  easy:
    paper: Nobody 1999
    what: a figure
    theirs: 3 m
    needs: [town]
    command: python -c "print('error', open(r'{town}/seed').read(), 'm')"
    minutes: 1
    ours:
      - {find: 'error (\\d+) m', say: '{} m'}
  wrong:
    paper: Nobody 1999
    what: another one
    theirs: "-"
    command: python -c "raise SystemExit('no roof here')"
    minutes: 1
    ours:
      - {find: 'x'}
  silent:
    paper: Nobody 1999
    what: a third
    theirs: "-"
    command: python -c "print('nothing')"
    minutes: 1
    ours:
      - {find: 'error (\\d+)'}
"""
QUIET = Console(quiet=True)


@pytest.fixture
def benchmarks(tmp_path: Path) -> Path:
    folder = tmp_path / "benchmarks"
    folder.mkdir()
    (folder / "papers.yaml").write_text(ROWS)
    return folder


def test_a_figure_and_its_table(benchmarks: Path, tmp_path: Path) -> None:
    assert bench(tmp_path / "out", ["easy"], benchmarks, False, QUIET)
    table = (tmp_path / "out" / "papers.md").read_text()
    assert "| Nobody 1999 | a figure | 3 m | 91 m | 91 | " in table
    assert table.count("not measured") == 2


def test_a_failed_row_is_a_row_and_the_others_go_on(benchmarks: Path, tmp_path: Path) -> None:
    assert not bench(tmp_path / "out", [], benchmarks, False, QUIET)
    table = (tmp_path / "out" / "papers.md").read_text()
    assert "**failed**: no roof here" in table
    assert "**failed**: its output has no 'error" in table
    assert "91 m" in table
    assert "no roof here" in (tmp_path / "out" / "logs" / "wrong.txt").read_text()


def test_what_is_measured_is_kept_until_it_is_asked_for_again(benchmarks: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    bench(out, ["easy"], benchmarks, False, QUIET)
    (out / "town" / "seed").write_text("17")
    bench(out, ["easy"], benchmarks, False, QUIET)
    assert json.loads((out / "records" / "easy.json").read_text())["ours"] == "91 m"
    bench(out, ["easy"], benchmarks, True, QUIET)
    assert json.loads((out / "records" / "easy.json").read_text())["ours"] == "17 m"
    history = [json.loads(line) for line in (out / "history.ndjson").read_text().splitlines()]
    assert [(line["name"], line["ours"]) for line in history] == [("easy", "91 m"), ("easy", "17 m")]
    assert "cores" in history[0]["machine"]


def test_a_failed_row_is_measured_again(benchmarks: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert not bench(out, ["silent"], benchmarks, False, QUIET)
    path = benchmarks / "papers.yaml"
    path.write_text(path.read_text().replace("print('nothing')", "print('error 5')"))
    assert bench(out, ["silent"], benchmarks, False, QUIET)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("needs: [town]", "needs: [city]", "easy needs city, which is no step"),
        ("    what: a figure\n", "", "rows.easy.what"),
        ("rows:", "rows: [", "papers.yaml"),
    ],
)
def test_wrong_rows_are_named(benchmarks: Path, old: str, new: str, says: str) -> None:
    path = benchmarks / "papers.yaml"
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(CityflowError, match=says):
        read_papers(benchmarks)


def test_an_unknown_row_and_a_missing_folder(benchmarks: Path, tmp_path: Path) -> None:
    with pytest.raises(CityflowError, match=r"no row is called roofs.*easy, wrong, silent"):
        bench(tmp_path / "out", ["roofs"], benchmarks, False, QUIET)
    with pytest.raises(CityflowError, match="in a checkout of the repository"):
        read_papers(tmp_path / "nowhere")


def test_the_rows_of_the_project_are_sound() -> None:
    root = Path(__file__).parents[2]
    papers = read_papers(root / "benchmarks")
    for name, made in {**papers.steps, **papers.rows}.items():
        words = made.command.split()
        assert words[0] in ("python", "cityflow"), name
        scripts = [word for word in words if word.startswith("benchmarks/") or word.startswith("workflows/")]
        assert all((root / script).is_file() for script in scripts), name
        folders = dict.fromkeys(made.needs, "x")
        made.command.format(**folders, seed=made.seed, out="x")
    seeds = [made.seed for made in (*papers.steps.values(), *papers.rows.values()) if made.seed]
    assert len(seeds) == len(set(seeds))

"""The notebooks run, cell after cell, on the data that is shipped; they are kept without outputs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In this process: a kernel of its own would import everything once more."""
    import matplotlib.pyplot as plt  # takes half a second in each of the processes that collect tests

    monkeypatch.chdir(tmp_path)
    plt.switch_backend("agg")
    cells = [c for c in json.loads(path.read_text(encoding="utf-8"))["cells"] if c["cell_type"] == "code"]
    assert len(cells) >= 3
    assert not any(c["outputs"] or c["execution_count"] for c in cells)
    names: dict[str, object] = {}
    for number, cell in enumerate(cells):
        exec(compile("".join(cell["source"]), f"{path.stem}[{number}]", "exec"), names)
    plt.close("all")


def test_there_are_three() -> None:
    assert [p.stem for p in NOTEBOOKS] == ["roof_from_lidar", "stereo_pair", "terrace"]

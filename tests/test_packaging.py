"""What a wheel must hold: the package with its data files, workflows and catalogs."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from cityflow.runs import project_files

ROOT = Path(__file__).parents[1]
BUILD = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["build"]
WHEEL = BUILD["targets"]["wheel"]


def _in_wheel(path: str) -> str:
    """Where a file of the project stands in the wheel; empty if it is left out."""
    if not any(path == part or path.startswith(f"{part}/") for part in WHEEL["only-include"]):
        return ""
    old, new = next((old, new) for old, new in WHEEL["sources"].items() if path.startswith(f"{old}/"))
    return path.replace(old, new, 1).lstrip("/")


@pytest.mark.parametrize(
    ("path", "place"),
    [
        ("src/cityflow/__init__.py", "cityflow/__init__.py"),
        ("src/cityflow/__init__.pyi", "cityflow/__init__.pyi"),
        ("src/cityflow/py.typed", "cityflow/py.typed"),
        ("src/cityflow/io/data/egm96_15min.tif", "cityflow/io/data/egm96_15min.tif"),
        ("src/cityflow/viewer/web/view.js", "cityflow/viewer/web/view.js"),
        ("src/cityflow/viewer/templates/report.html.j2", "cityflow/viewer/templates/report.html.j2"),
        ("workflows/lidar_city.yaml", "cityflow/shipped/workflows/lidar_city.yaml"),
        ("catalogs/delft/collection.json", "cityflow/shipped/catalogs/delft/collection.json"),
        ("catalogs/boruszyn/control.csv", "cityflow/shipped/catalogs/boruszyn/control.csv"),
    ],
)
def test_a_file_that_is_needed_is_in_the_wheel(path: str, place: str) -> None:
    assert (ROOT / path).is_file()
    assert _in_wheel(path) == place


def test_what_is_for_developers_is_not() -> None:
    assert not any(map(_in_wheel, ["tests/conftest.py", "benchmarks/delft.py", "docs/README.md", "deploy/setup.sh"]))


def test_an_installed_package_finds_them_in_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shipped = tmp_path / "cityflow" / "shipped"
    (shipped / "workflows").mkdir(parents=True)
    (shipped / "workflows" / "lidar_city.yaml").write_text("name: x\n")
    monkeypatch.setattr(project_files, "PLACES", (Path(), tmp_path / "lib", shipped))
    monkeypatch.chdir(tmp_path)
    named = Path("workflows/lidar_city.yaml")
    assert project_files.project_file(str(named)) == shipped / named
    assert project_files.named_workflow(named) == shipped / named
    assert project_files.named_workflow(Path("lidar_city.yaml")) == Path("lidar_city.yaml")
    assert project_files.named_workflow(Path("workflows/none.yaml")) == Path("workflows/none.yaml")


def test_shipped_files_are_where_the_wheel_puts_them() -> None:
    assert project_files.SHIPPED.relative_to(project_files.PACKAGE.parent).as_posix() == "cityflow/shipped"
    assert project_files.sample_catalog("delft").is_dir()

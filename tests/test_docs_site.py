"""The pages of the site that are made from the code, and its table of contents; the gate builds the site itself (`make docs`)."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from cityflow.cli import TOP
from cityflow.runs.known_keys import known_keys

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site() -> ModuleType:
    found = importlib.util.spec_from_file_location("docs_site", ROOT / "deploy" / "docs_site.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def test_the_reference_has_every_command_and_its_options(site: ModuleType) -> None:
    text = site.commands()
    assert all(f"## cityflow {command.__name__}\n" in text for command in TOP)
    assert "cityflow explain RUN" in text
    assert "`--create" not in text
    assert "| `-y`, `--yes` |" in text
    assert "## cityflow catalog create\n" in text


def test_the_reference_has_every_key(site: ModuleType) -> None:
    text = site.keys()
    assert [k for k in known_keys() if f"| `{k}` |" not in text] == []


def test_the_reference_has_products_and_messages(site: ModuleType) -> None:
    assert "| `tiles3d` | City model (3D Tiles 1.1) | `products/tiles3d` |" in site.products()
    text = site.messages()
    assert "| no run here (run.json is missing) | start one with `cityflow run … --out` |" in text
    assert text.count("\n|") > 150


@pytest.mark.parametrize(
    ("page", "link", "moved"),
    [
        ("index.md", "[a](docs/view.md#top)", "[a](view.md#top)"),
        ("index.md", "![a](docs/images/demo.jpg)", "![a](images/demo.jpg)"),
        ("python.md", "[a](../ARCHITECTURE.md#x)", "[a](project/architecture.md#x)"),
        ("pages.md", "[a](view.md)", "[a](view.md)"),
        ("project/architecture.md", "[a](docs/view.md)", "[a](../view.md)"),
        ("deploy.md", "[tls](../deploy/tls.sh)", "tls"),
        ("deploy.md", "[a](https://docs.dask.org)", "[a](https://docs.dask.org)"),
    ],
)
def test_links_between_files_become_links_between_pages(site: ModuleType, page: str, link: str, moved: str) -> None:
    assert site.with_moved_links(link, page) == moved


def test_the_contents_have_every_page_once(site: ModuleType) -> None:
    named = re.findall(r"[\w/]+\.md", (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2])
    pages = {p.relative_to(ROOT / "docs").as_posix() for p in (ROOT / "docs").rglob("*.md")} - {"README.md"}
    assert sorted(named) == sorted({*pages, *site.PROJECT.values(), *site.REFERENCE})

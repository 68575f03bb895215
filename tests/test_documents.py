"""Every relative link in the documents leads somewhere, also to its heading, and no placeholder is left."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "catalogs").rglob("*.md")])


def _anchor(heading: str) -> str:
    """The name by which a link finds a heading, as GitHub makes it.

    >>> _anchor("Outlines (`evaluation/outlines.py`)")
    'outlines-evaluationoutlinespy'
    """
    words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
    return re.sub(r"[^\w\s-]", "", words).replace(" ", "-")


@cache
def _anchors(page: Path) -> frozenset[str]:
    return frozenset(map(_anchor, re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)))


def _leads(page: Path, target: str) -> bool:
    name, _, anchor = target.partition("#")
    file = (page.parent / name).resolve() if name else page
    return file.exists() and (not anchor or file.suffix != ".md" or anchor in _anchors(file))


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    targets = re.findall(r"\]\(([^)\s]+)\)", text)
    missing = [t for t in targets if "://" not in t and not t.startswith("mailto:") and not _leads(page, t)]
    assert not missing
    assert "@@" not in text


@pytest.mark.parametrize(
    ("target", "leads"),
    [
        ("docs/orient.md#registration-to-a-survey", True),
        ("#limits", True),
        ("docs/orient.md#nowhere", False),
        ("#nowhere", False),
        ("docs/no.md", False),
    ],
)
def test_a_link_leads_to_a_page_and_its_heading(target: str, leads: bool) -> None:
    assert _leads(ROOT / "README.md", target) is leads

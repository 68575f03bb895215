"""Old words do not come back as names in the code: the table is in CONTRIBUTING.md."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
SRC = ROOT / "src" / "cityflow"

OLD = {"said", "unsaid", "likeness", "wish", "wishes", "restlessness", "strung"}
"""Parts of names that have another word now, wherever they stand."""

OLD_IN = {
    "reporting": {"leaf", "leaves"}, "viewer": {"leaf", "leaves"}, "texture/placement": {"leaf", "leaves"}, "survey": {"door", "leaf", "leaves"},
    "stages": {"door", "leaf", "leaves"}, "outlines/from_walls": {"piece", "pieces"}, "reconstruction/volumetric_parts": {"foot"},
}  # fmt: skip
"""Parts of names that mean something else elsewhere: a tree has leaves, a town has doors, a foot is a unit of length."""


def _names(text: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name


def _words(name: str) -> set[str]:
    """
    >>> sorted(_words("SaidInputs_of")), sorted(_words("_PIECE_M"))
    (['inputs', 'of', 'said'], ['m', 'piece'])
    """
    return {w.lower() for w in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}


def _old(path: str, text: str) -> set[str]:
    refused = OLD.union(*(words for folder, words in OLD_IN.items() if path.startswith(f"{folder}/")))
    if not re.search("|".join(sorted(refused)), text, re.IGNORECASE):
        return set()  # most files need not be parsed
    return {f"{path}: {name}" for name in set(_names(text)) if _words(name) & refused}


def test_no_name_in_the_code_has_an_old_word() -> None:
    paths = sorted(SRC.rglob("*.py"))
    found = set[str]().union(*(_old(p.relative_to(SRC).as_posix(), p.read_text(encoding="utf-8")) for p in paths))
    assert not found, "use the words of the table in CONTRIBUTING.md"
    modules = {p.relative_to(SRC).as_posix() for p in paths if _words(p.stem) & OLD}
    assert not modules


def test_an_old_word_is_found() -> None:
    text = "class SaidInputs:\n    def f(self, said, leaf): return self.likeness, unwished, leaf_m\n"
    assert _old("flow/a.py", text) == {"flow/a.py: SaidInputs", "flow/a.py: said", "flow/a.py: likeness"}
    assert _old("survey/a.py", text) >= {"survey/a.py: leaf", "survey/a.py: leaf_m"}

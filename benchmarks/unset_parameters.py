"""Keys of a workflow that nothing ever sets: no test, benchmark or script has one as a keyword or a text beside the name of its model or section, and no
workflow or document names it (`execution.STAGE.time_s` names that of every stage).

    python benchmarks/unset_parameters.py [WORD]

A candidate for a constant: what nobody has ever tried to set, nobody may be able to choose. The list errs towards calling a key set, since a file may name
several models with such a field.
"""

from __future__ import annotations

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.runs.known_keys import known_keys
from cityflow.runs.settings import model_at

ROOT = Path(__file__).resolve().parents[1]
CODE = ("tests", "benchmarks", "deploy")
TEXT = ("README.md", "docs/*.md", "workflows/*.yaml")


def names_in_code(text: str) -> Iterator[str]:
    """Keywords of calls, and texts that may be keys of mappings or settings."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.keyword) and node.arg:
            yield node.arg
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from re.findall(r"\w+", node.value)


def names_in_text(text: str) -> Iterator[str]:
    """Dotted names, what stands in backticks, and keys of YAML."""
    yield from re.findall(r"\w+(?:\.\w+)+", text)
    for quoted in re.findall(r"`([^`]+)`", text):
        yield from re.findall(r"[\w.]+", quoted)
    yield from re.findall(r"^\s*(\w+):", text, re.MULTILINE)


@cache
def in_code() -> list[tuple[set[str], set[str]]]:
    """Of each file what it may set, and every word in it."""
    texts = [path.read_text(encoding="utf-8") for folder in CODE for path in sorted((ROOT / folder).rglob("*.py"))]
    return [(set(names_in_code(text)), set(re.findall(r"\w+", text))) for text in texts]


@cache
def in_text() -> set[str]:
    return {name for pattern in TEXT for path in sorted(ROOT.glob(pattern)) for name in names_in_text(path.read_text())}


def is_set(key: str) -> bool:
    *sections, name = key.split(".")
    model = model_at(CityParameters, sections)
    beside = {sections[-1], *(kind.__name__ for kind in model.__mro__[:2])} if sections else {"CityParameters"}
    if any(name in may_set and beside & words for may_set, words in in_code()):
        return True
    named = {".".join([*sections[-1:], name]), *({f"execution.STAGE.{name}"} if sections[:1] == ["execution"] else ())}
    return any(each == name or each.endswith(tuple(named)) for each in in_text())


def main(word: str = "") -> None:
    keys = [key for key in known_keys() if word in key and not is_set(key)]
    print("\n".join(keys))
    counts = Counter(key.split(".")[0] for key in keys)
    print(f"{len(keys)} of {len(known_keys())}:", ", ".join(f"{section} {n}" for section, n in counts.items()))


if __name__ == "__main__":
    main(*sys.argv[1:])

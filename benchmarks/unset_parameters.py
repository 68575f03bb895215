"""Keys of a workflow that nothing ever sets: no workflow, test, document or benchmark names them in full, as a keyword of a call or as a key of a mapping.

    python benchmarks/unset_parameters.py [WORD]

A candidate for a constant: what nobody has ever tried to set, nobody may be able to choose. The list errs towards calling a key set, since a keyword of the
same name may belong to another model.
"""

from __future__ import annotations

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from cityflow.runs.known_keys import known_keys

ROOT = Path(__file__).resolve().parents[1]
CODE = ("tests", "benchmarks", "deploy")
TEXT = ("README.md", "docs/*.md", "workflows/*.yaml")


def names_in_code(path: Path) -> Iterator[str]:
    """Keywords of calls, and texts that may be keys of mappings or settings."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.keyword) and node.arg:
            yield node.arg
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from re.findall(r"[\w.]+", node.value)


def names_in_text(path: Path) -> Iterator[str]:
    """Dotted names, what stands in backticks, and keys of YAML."""
    text = path.read_text(encoding="utf-8")
    yield from re.findall(r"\w+(?:\.\w+)+", text)
    for quoted in re.findall(r"`([^`]+)`", text):
        yield from re.findall(r"[\w.]+", quoted)
    yield from re.findall(r"^\s*(\w+):", text, re.MULTILINE)


def unset() -> list[str]:
    named = {name for folder in CODE for path in sorted((ROOT / folder).rglob("*.py")) for name in names_in_code(path)}
    named |= {name for pattern in TEXT for path in sorted(ROOT.glob(pattern)) for name in names_in_text(path)}
    ends = {name.rsplit(".", 1)[-1] for name in named}
    return [key for key in known_keys() if key.rsplit(".", 1)[-1] not in ends]


def main(word: str = "") -> None:
    keys = [key for key in unset() if word in key]
    print("\n".join(keys))
    counts = Counter(key.split(".")[0] for key in keys)
    print(f"{len(keys)} of {len(known_keys())}:", ", ".join(f"{section} {n}" for section, n in counts.items()))


if __name__ == "__main__":
    main(*sys.argv[1:])

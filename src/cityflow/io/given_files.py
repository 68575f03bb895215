"""Safety checks of given files: devices, pipes, and text that expands without end."""

from __future__ import annotations

import json
import os
import re
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cityflow.errors import CatalogError, CityflowError

SMALL_MB = 64
"""Descriptions (workflows, collections, items, tables of cameras) are far below; what is beyond is something else."""
MODEL_MB = 4096
"""Orientations of very many images with their tie points."""
MOST_VALUES = 200_000
"""Values of a description, each counted as often as it is referred to."""
MOST_DIGITS = 300
"""Of a whole number: more than any float has."""
_LONG = re.compile(rf"\d{{{MOST_DIGITS}}}")

KINDS = {
    stat.S_ISDIR: "a folder",
    stat.S_ISFIFO: "a pipe",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
    stat.S_ISSOCK: "a socket",
}


def check_plain(path: str | Path, most_mb: float | None = None, kind: type[CityflowError] = CatalogError) -> None:
    """Make sure that a local path, where there is something, is a plain file of at most that size.

    Raises
    ------
    CatalogError, or the `kind` asked for
        It is a folder, a pipe or a device, or larger.
    """
    if "://" in str(path):
        return
    try:
        found = os.stat(path)
    except OSError:
        return  # whoever opens it says so better
    for is_kind, name in KINDS.items():
        if is_kind(found.st_mode):
            raise kind(f"this is {name}, not a file", where=str(path), remedy="name a plain file")
    if most_mb is not None and found.st_size > most_mb * 1e6:
        problem = f"a file of {found.st_size / 1e6:,.0f} MB; such a file has at most {most_mb:,.0f} MB"
        raise kind(problem, where=str(path), remedy="check the path: this seems to be another file")


def read_small(path: str | Path, kind: type[CityflowError] = CatalogError, encoding: str = "utf-8") -> str:
    """Text of a description. Raises OSError, UnicodeDecodeError, and as `check_plain`."""
    check_plain(path, SMALL_MB, kind)
    return Path(path).read_text(encoding=encoding)


def json_of(text: str | bytes) -> Any:
    """Like `json.loads`, without endless numbers; its values are no more than its bytes, which were counted. Raises ValueError."""
    plain = text if isinstance(text, str) else text.decode()
    try:
        tree = json.loads(plain)
        return _bounded(tree) if _LONG.search(plain) else tree
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def yaml_of(text: str) -> Any:
    """Plain YAML: what unfolds without end, odd scalars and tags are refused. Raises ValueError with one line."""
    import yaml  # not before there is a file to read: a command that was mistyped answers at once

    try:
        return _bounded(yaml.safe_load(text))
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    except (OverflowError, TypeError, AttributeError, KeyError, IndexError) as error:  # of PyYAML's own constructors
        raise ValueError(f"a value in it is invalid ({error})") from None


def _bounded(tree: Any) -> Any:
    """The tree, where it has an end: references are followed, as all who use it would."""
    left, seen = [tree], 0
    while left:
        value = left.pop()
        seen += 1
        if seen > MOST_VALUES:
            raise ValueError(f"it expands to more than {MOST_VALUES:,} values, or contains itself")
        if isinstance(value, Mapping):
            left += [*value.keys(), *value.values()]
        elif isinstance(value, list | tuple | set):
            left += value
        elif isinstance(value, int) and abs(value) >= 10**MOST_DIGITS:
            raise ValueError(f"a number in it has more than {MOST_DIGITS} digits")
    return tree

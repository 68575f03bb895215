"""The part of the program that a flight plan follows from: a plan that is kept counts until this part changes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path

import numpy as np
import shapely

FINDERS = ("cityflow.survey.image_survey", "cityflow.survey.kept_plans")
"""What finds a plan and writes it."""
IMPORTED = re.compile(r"^\s*(?:from|import) (cityflow\.[\w.]+)(?: import (\([^)]*\)|.*))?", re.MULTILINE)
FOLLOWED = ("core", "geometry", "orientation")
"""Packages whose modules count where these import them; all else reaches a plan through poses and parameters, which its digest contains."""


def plan_program() -> str:
    """Digest of these sources and of the libraries that calculate for them; the same wherever the program is installed."""
    return sha256(
        f"{np.__version__} {shapely.__version__} {sources_of_plans(Path(__file__).parents[1])}".encode()
    ).hexdigest()


@cache
def sources_of_plans(package: Path) -> str:
    """Digest of the contents of these sources, of the program in a folder."""
    left, found = list(FINDERS), dict[str, str]()
    while left:
        module = left.pop()
        if module in found or (path := _path(package, module)) is None:
            continue
        text = path.read_text(encoding="utf-8")
        found[module] = sha256(text.encode()).hexdigest()
        left.extend(name for name in _imported(text) if name.split(".")[1] in FOLLOWED)
    return sha256("\n".join(f"{module} {found[module]}" for module in sorted(found)).encode()).hexdigest()


def _path(package: Path, module: str) -> Path | None:
    """None for a name that a module defines."""
    stem = package.joinpath(*module.split(".")[1:])
    return next((path for path in (stem.with_suffix(".py"), stem / "__init__.py") if path.is_file()), None)


def _imported(text: str) -> Iterator[str]:
    """Modules of this program, and names in them, which may be modules, too."""
    for module, names in IMPORTED.findall(text):
        yield module
        yield from (f"{module}.{name}" for name in re.findall(r"\w+", names))

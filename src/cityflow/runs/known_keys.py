"""Cache of all keys that may be set: reading it takes milliseconds, importing the models seconds.

The file lies with the package's compiled modules (or in the user's cache folder, where that is read-only) and holds the size and time of every source file,
so that it is never older than the models: where it is missing or stale, the models are imported and it is written anew.
"""

from __future__ import annotations

import difflib
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from cityflow.errors import WorkflowError
from cityflow.runs.setting_text import listed

CITY, SYNTH = "city", "synth"
AT_TOP = ("name", "catalog")
"""Keys of a workflow file beside its stages."""
WILD = "*?["
FUNCTION = "function"
LEAST_ALIKE = 0.5
"""Names less alike than this are not suggested (ratio of `difflib`)."""


@dataclass(frozen=True, slots=True)
class Key:
    """One parameter.

    Attributes
    ----------
    default : as JSON, or ``no default``
    meaning : description with unit;  may_be : choices and bounds, may be empty
    several : a list of values
    kinds : what a value, or each of several, may be: number, whole, flag, text, null, choice or function (module:function); empty where only the model can tell
    choices : where it may be one of some
    least, above, most, below : bounds of a number (None: there is none)
    """

    default: str
    meaning: str
    may_be: str
    several: bool = False
    kinds: Sequence[str] = ()
    choices: Sequence[Any] = ()
    least: float | None = None
    above: float | None = None
    most: float | None = None
    below: float | None = None

    def line(self, name: str) -> str:
        return f"{name} = {self.default}  {self.meaning}{f'  ({self.may_be})' if self.may_be else ''}"

    def refuses(self, value: Any) -> str:
        """Why it surely does not take a value; empty where it may."""
        if self.several and isinstance(value, list):
            return next((why for each in value if (why := self._refuses_one(each))), "")
        return "" if self.several and (value is None or isinstance(value, Mapping)) else self._refuses_one(value)

    def _refuses_one(self, value: Any) -> str:
        kinds = self.kinds
        if not kinds or ("null" in kinds and value is None) or value in self.choices:
            return ""
        if isinstance(value, bool):
            return "" if "flag" in kinds else f"should be {self._wanted()}"
        if isinstance(value, int | float) and ("number" in kinds or ("whole" in kinds and float(value).is_integer())):
            return "" if self._holds(value) else f"should be {self.may_be}"
        if isinstance(value, str) and ("text" in kinds or (FUNCTION in kinds and ":" in value)):
            return ""
        return f"should be {self._wanted()}"

    def _wanted(self) -> str:
        bounds = self.may_be if self.may_be and not self.choices else ""
        told = {"number": "a number", "whole": "a whole number", "flag": "true or false", "text": "a text", "null": "null",
                "choice": f"one of {', '.join(map(str, self.choices))}", FUNCTION: "module:function"}  # fmt: skip
        kinds = " or ".join(told[kind] for kind in self.kinds)
        return f"{kinds} ({bounds})" if bounds and "flag" not in self.kinds else kinds

    def _holds(self, value: float) -> bool:
        return not (
            (self.least is not None and value < self.least) or (self.above is not None and value <= self.above)
            or (self.most is not None and value > self.most) or (self.below is not None and value >= self.below)
        )  # fmt: skip


def kept_keys(of: str = CITY) -> dict[str, Key] | None:
    """Keys of workflows, or of ``cityflow synth``; None where nobody has kept them since the sources changed."""
    for path in _places(of):
        with suppress(OSError, ValueError, TypeError, KeyError):
            kept = json.loads(path.read_text(encoding="utf-8"))
            if kept["sources"] == sources_digest():
                return {name: Key(**key) for name, key in kept["keys"].items()}
    return None


def keep_keys(keys: Mapping[str, Key], of: str = CITY) -> None:
    """Write them for the next command; where nothing can be written, that one takes a second longer."""
    text = json.dumps({"sources": sources_digest(), "keys": {name: asdict(key) for name, key in keys.items()}})
    for path in _places(of):
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            fresh = path.with_suffix(f".{os.getpid()}")
            fresh.write_text(text, encoding="utf-8")
            fresh.replace(path)
            return


def known_keys(of: str = CITY) -> dict[str, Key]:
    """Kept ones, else from the models."""
    kept = kept_keys(of)
    if kept is None:
        from cityflow.runs.model_keys import model_keys, model_of

        kept = model_keys(model_of(of))
        keep_keys(kept, of)
    return kept


def described(keys: Mapping[str, Key], wanted: str = "") -> str:
    """Keys with default, meaning, unit and what they may be, a line each; of `wanted` only those that it names.

    Parameters
    ----------
    wanted : a key, the beginning of one, a part of one, a pattern with ``*``, ``?`` and ``[…]``, or words of the meaning; empty: every key

    Raises
    ------
    WorkflowError
        No key is named so; the nearest known one is, where one is like it.
    """
    chosen = _chosen(keys, wanted)
    if not chosen:
        parts = {".".join(key.split(".")[:n]) for key in keys for n in range(1, key.count(".") + 2)}
        parts |= {part for key in keys for part in key.split(".")}
        near = nearest(wanted, sorted(parts))
        remedy = "`cityflow parameters --all` lists all"
        raise WorkflowError(
            f"no parameter has '{wanted}' in its name or its meaning", where="parameters", remedy=f"the nearest is '{near}'; {remedy}" if near else remedy,
        )  # fmt: skip
    return "\n".join(keys[name].line(name) for name in chosen)


def _chosen(keys: Mapping[str, Key], wanted: str) -> list[str]:
    """Keys of a section before those that only hold the text somewhere, and these before those whose meaning does."""
    if not wanted:
        return list(keys)
    if any(c in wanted for c in WILD):
        return [k for k in keys if fnmatchcase(k, wanted) or fnmatchcase(k, f"*.{wanted}")]
    section = [k for k in keys if k == wanted or k.startswith(f"{wanted.rstrip('.')}.")]
    named = section or [k for k in keys if wanted.lower() in k.lower()]
    return named or [k for k, key in keys.items() if len(wanted) > 2 and wanted.lower() in key.meaning.lower()]


def refuse_unfit_values(tree: Mapping[str, Any], keys: Mapping[str, Key], where: str) -> None:
    """Make sure that no value of a tree is surely wrong; what passes is judged by the models.

    Raises
    ------
    WorkflowError
    """
    for name, value in _leaves({k: v for k, v in tree.items() if k not in AT_TOP}, keys, ""):
        given = listed(value) if keys[name].several else value
        why = keys[name].refuses(given)
        if why:
            raise WorkflowError(f"{name} = {value!r} {why}", where=where, remedy=f"cityflow parameters {name}")


def _leaves(tree: Mapping[str, Any], keys: Mapping[str, Key], above: str) -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        dotted = f"{above}{name}"
        if dotted in keys:
            yield dotted, value
        elif isinstance(value, Mapping):
            yield from _leaves(value, keys, f"{dotted}.")


def refuse_unknown(tree: Mapping[str, Any], keys: Mapping[str, Key], where: str) -> None:
    """Make sure that every key of a workflow's tree, or of a setting's, is known.

    Raises
    ------
    WorkflowError
        One is not; the nearest known one is named.
    """
    for path in _paths({k: v for k, v in tree.items() if k not in AT_TOP}, keys, ()):
        beside = sorted({k.split(".")[len(path) - 1] for k in keys if k.split(".")[: len(path) - 1] == list(path[:-1])})
        beside += list(AT_TOP) if len(path) == 1 else []
        raise WorkflowError(unknown_key(path, beside), where=where, remedy="cityflow parameters --all lists every key")


def unknown_key(path: Sequence[str], beside: Sequence[str]) -> str:
    """That a key is unknown; `beside`: the names that its section knows."""
    near = nearest(path[-1], beside)
    told = f"the nearest known one is '{'.'.join([*path[:-1], near])}'" if near else f"there are {', '.join(beside)}"
    return f"unknown key '{'.'.join(path)}'; {told}"


def _paths(tree: Mapping[str, Any], keys: Mapping[str, Key], above: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Paths of the keys in a tree that nobody knows."""
    for name, value in tree.items():
        path = (*above, str(name))
        dotted = ".".join(path)
        if dotted in keys:
            continue
        if not any(k.startswith(f"{dotted}.") for k in keys):
            yield path
        elif isinstance(value, Mapping):
            yield from _paths(value, keys, path)


def nearest(name: str, known: Sequence[str]) -> str:
    """The name that is most like another one; empty where none is like it."""
    return next(iter(difflib.get_close_matches(name, known, n=1, cutoff=LEAST_ALIKE)), "")


def _places(of: str) -> tuple[Path, Path]:
    name = f"parameters_{of}.{sys.implementation.cache_tag}.json"
    cache_folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return _package() / "__pycache__" / name, cache_folder / "cityflow" / sha256(str(_package()).encode()).hexdigest()[
        :16
    ] / name


def _package() -> Path:
    return Path(__file__).resolve().parents[1]


@cache
def sources_digest() -> str:
    """Of every source file its path, size and time of change."""
    told = []
    for folder, folders, files in os.walk(_package()):
        folders[:] = sorted(f for f in folders if f != "__pycache__")
        for name in sorted(f for f in files if f.endswith(".py")):
            stat = os.stat(os.path.join(folder, name))
            told.append(f"{folder}/{name} {stat.st_size} {stat.st_mtime_ns}")
    return sha256("\n".join(told).encode()).hexdigest()

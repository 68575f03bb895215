"""What an orientation was asked for, as its work folder keeps it: `status`, `explain` and `rerun` read it, and its command can be repeated by it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import TypeAdapter, ValidationError

from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.runs.first_look import ORIENTATION

EXPECTED = "expected.json"
"""Tasks by stage, and images, as the last command had them."""
RESULT = "orientation.json"
"""What the command found; missing until it has ended."""


@dataclass(frozen=True, slots=True)
class OrientationAsked:
    """An orientation as its command line has it.

    Attributes
    ----------
    given : folder of photographs, or folder or URL of a catalog;  out : folder of the new catalog; absolute paths
    photographs : whether poses are to be found; else those of the catalog are refined
    settings : of ``--set``
    control, marks : files of known points;  control_crs : of a catalog's points
    scale_m, local, crs : see `workflow.photo_placing.Placing`
    allow_outside : the catalog may name files elsewhere
    lever_arm : of the antenna, as on the command line
    onto : survey that the images are registered to: files, patterns, or a catalog
    title, attribution : of the new catalog; empty: the folder's name, and none
    of_run : a run looks at the poses of its catalog by these tasks, and goes on with what they find; no command of its own repeats them
    """

    given: str
    out: str
    photographs: bool
    settings: tuple[str, ...] = ()
    control: str = ""
    marks: str = ""
    control_crs: str = ""
    scale_m: float | None = None
    local: bool = False
    crs: str = ""
    allow_outside: bool = False
    lever_arm: str = ""
    onto: tuple[str, ...] = ()
    title: str = ""
    attribution: str = ""
    of_run: bool = False


@dataclass(frozen=True, slots=True)
class ExpectedTasks:
    """Tasks by stage, and names of the images."""

    counts: Mapping[str, int] = field(default_factory=dict)
    images: tuple[str, ...] = ()


_ASKED, _EXPECTED = TypeAdapter(OrientationAsked), TypeAdapter(ExpectedTasks)


def write_asked(store: Store, asked: OrientationAsked) -> None:
    """Note what is asked for; the result of before no longer holds."""
    store.write_bytes(ORIENTATION, _text(_ASKED.dump_python(asked, mode="json")))
    if store.exists(RESULT):
        store.remove_files([RESULT])


def asked_in(store: Store) -> OrientationAsked:
    """What `write_asked` has noted. Raises RunError where that is damaged, or of another version."""
    try:
        return _ASKED.validate_python(json.loads(store.read_bytes(ORIENTATION)))
    except (ValueError, ValidationError) as error:
        remedy = "repeat the command cityflow orient, which writes it anew"
        raise RunError(f"{ORIENTATION} is damaged ({error!s:.200})", where=store.root, remedy=remedy) from error


def note_expected(store: Store, counts: Mapping[str, int], images: Iterable[str]) -> None:
    """Note the tasks of some stages, and the images where these stages are of single ones; what is known of other stages stays."""
    before, named = expected_in(store), tuple(sorted(images))
    found = ExpectedTasks({**({} if named else before.counts), **counts}, named or before.images)
    store.write_bytes(EXPECTED, _text(_EXPECTED.dump_python(found, mode="json")))


def expected_in(store: Store) -> ExpectedTasks:
    """What `note_expected` has noted; nothing where it is missing or damaged."""
    try:
        return _EXPECTED.validate_python(json.loads(store.read_bytes(EXPECTED)))
    except (FileNotFoundError, ValueError):
        return ExpectedTasks()


def _text(tree: Any) -> bytes:
    return (json.dumps(tree, indent=1, sort_keys=True, ensure_ascii=False) + "\n").encode()

"""Checks of a command before heavy imports: missing paths, unknown keys, output folder.

Silence means nothing: whatever needs the models, the catalog or the records is found by those who read them.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console

from cityflow.errors import CatalogError, RunError
from cityflow.runs.known_keys import CITY, kept_keys, refuse_unfit_values, refuse_unknown
from cityflow.runs.setting_text import read_tree, split_setting

RUNS = "runs"
DESCRIPTION = "run.json"
ORIENTATION = "orient.json"
"""Of a folder with the tasks of an orientation."""
COLLECTION = "collection.json"
PHOTO_SUFFIXES = (".jpg", ".jpeg", ".tif", ".tiff", ".png", ".jp2")
MOST_NAMED = 4


def look_at_workflow(path: Path, settings: Sequence[str], catalog: str = "") -> str:
    """Make sure that a workflow file and a catalog are there and that every key is known; returns the workflow's name.

    Raises
    ------
    WorkflowError, CatalogError
    """
    tree = read_tree(path)
    keys = kept_keys()
    if keys is not None:
        refuse_unknown(tree, keys, str(path))
        refuse_unfit_values(tree, keys, str(path))
    look_at_settings(settings)
    look_at_catalog(catalog)
    return str(tree.get("name", ""))


def look_at_settings(settings: Sequence[str], of: str = CITY) -> None:
    """Make sure that settings are settings, of keys that are known.

    Raises
    ------
    WorkflowError
    """
    keys = kept_keys(of)
    for setting in settings:
        path, value = split_setting(setting)
        for part in reversed(path):
            value = {part: value}
        if keys is not None:
            refuse_unknown(value, keys, "--set")
            refuse_unfit_values(value, keys, "--set")


def is_photo_folder(named: str) -> bool:
    """Whether a local folder holds photographs, and no catalog."""
    folder = Path(named)
    if "://" in named or not folder.is_dir() or (folder / COLLECTION).exists():
        return False
    return any(p.suffix.lower() in PHOTO_SUFFIXES for p in folder.rglob("*"))


def is_video_file(named: str) -> bool:
    """Whether a local file is named that is no catalog: a video, or what will be refused as none."""
    path = Path(named)
    return "://" not in named and path.is_file() and path.suffix.lower() != ".json"


def look_at_catalog(named: str) -> None:
    """Make sure that a local folder that is named as a catalog is one.

    Raises
    ------
    CatalogError
    """
    if not named or "://" in named:
        return
    place = Path(named)
    if not (place if place.suffix == ".json" else place / COLLECTION).is_file():
        problem = f"no catalog here ({COLLECTION} is missing)" if place.exists() else "no such catalog"
        near = _named(p.parent for p in sorted(place.parent.glob(f"*/{COLLECTION}")))
        remedy = f"there is {near}" if near else "make one with `cityflow catalog create`, or check the path"
        raise CatalogError(problem, where=named, remedy=remedy)


def is_orientation(url: str, *options: object) -> bool:
    """Whether a local folder holds the tasks of an orientation.

    Parameters
    ----------
    options : that are for runs alone

    Raises
    ------
    RunError
        It does, and one of them is given.
    """
    found = "://" not in url and (Path(url).expanduser() / ORIENTATION).is_file()
    if found and any(options):
        remedy = "leave it out; other parameters: repeat the command cityflow orient with --set, which makes only what depends on them"
        raise RunError("an option is for runs, and this is the work folder of an orientation", where=url, remedy=remedy)
    return found


def look_at_run(url: str) -> None:
    """Make sure that a local folder that is named as a RUN is one.

    Raises
    ------
    RunError
    """
    if "://" in url:
        return
    place = Path(url).expanduser()
    if is_orientation(url):
        remedy = "cityflow status, explain and rerun take it; name the RUN that was made of its catalog"
        raise RunError("this is the work folder of an orientation, no run", where=url, remedy=remedy)
    if not (place / DESCRIPTION).is_file():
        near = _named(
            p.parent for folder in (place, place.parent, Path(RUNS)) for p in sorted(folder.glob(f"*/{DESCRIPTION}"))
        )
        remedy = f"there is {near}" if near else "start one with `cityflow run … --out`"
        raise RunError(f"no run here ({DESCRIPTION} is missing)", where=url, remedy=remedy)


def look_at_file(named: str) -> None:
    """Make sure that a local file is there.

    Raises
    ------
    CatalogError
    """
    if "://" not in named and not named.startswith("/vsi") and not Path(named).exists():
        raise CatalogError("no such file", where=named, remedy="check the path")


def agreed_folder(workflow: str, is_agreed: bool, console: Console) -> str:
    """The folder of a run whose command names none: said, and agreed to by ``--yes`` or by whoever sits at the terminal.

    Raises
    ------
    RunError
        Nobody has agreed.
    """
    folder = f"{RUNS}/{workflow}"
    state = "continues the run in" if (Path(folder) / DESCRIPTION).is_file() else "writes into"
    if is_agreed:
        console.print(f"Without --out this {state} {folder}", markup=False, highlight=False)
        return folder
    if sys.stdin.isatty() and sys.stdout.isatty():
        console.print(f"Without --out this {state} {folder}. Go on? [y/N] ", markup=False, highlight=False, end="")
        if sys.stdin.readline().strip().lower() in ("y", "yes"):
            return folder
    raise RunError(
        f"without --out this {state} {folder}",
        where="--out",
        remedy="name a folder with --out RUN, or agree with --yes",
    )


def _named(folders: Iterable[Path]) -> str:
    names = list(dict.fromkeys(map(str, folders)))
    return ", ".join(names[:MOST_NAMED]) + (", …" if len(names) > MOST_NAMED else "")

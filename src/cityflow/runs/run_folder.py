"""A RUN folder: opened, checked against the workflow, with its description."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import shapely

from cityflow import __version__
from cityflow.core.credentials import stripped, without_credentials
from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.runs.prepare import Prepared
from cityflow.runs.settings import Workflow, checked, known_part
from cityflow.survey.area import Area

DESCRIPTION = "run.json"
PACKAGES = ("dask", "distributed", "numpy", "scipy", "shapely", "zarr", "numba", "pyproj", "rasterio", "laspy")


def check_run(wanted: Prepared) -> None:
    """Make sure that the RUN can be written, and that an existing one belongs to the same workflow and catalog.

    Raises
    ------
    RunError
        The folder cannot be written, holds something else, or another workflow's run.
    """
    store = wanted.store
    store.check_writable()
    if store.exists(DESCRIPTION):
        _refuse_stranger(store.root, _description(store), wanted)
    elif store.is_local and Path(store.root).is_dir() and any(Path(store.root).iterdir()):
        raise RunError(
            "the folder is not empty and holds no run", where=store.root, remedy="choose another one with --out"
        )


def describe_run(wanted: Prepared) -> None:
    """Make the RUN where there is none, and note what is asked for."""
    if not is_described(wanted):
        wanted.store.write_bytes(DESCRIPTION, _text(wanted))


def is_described(wanted: Prepared) -> bool:
    """Whether the RUN was last asked for the same workflow, area and place of the catalog, with the same program."""
    return wanted.store.exists(DESCRIPTION) and wanted.store.read_bytes(DESCRIPTION) == _text(wanted)


def _text(wanted: Prepared) -> bytes:
    return (json.dumps(_describe(wanted), indent=2, ensure_ascii=False, sort_keys=True) + "\n").encode()


def open_run(url: str) -> Prepared:
    """An existing RUN, with the workflow, the catalog and the area that it was last run with; whoever reads the catalog's files looks where they are."""
    store = Store.open(url)
    if not _is_run(store):
        raise _no_run(url)
    tree = _description(store)
    workflow = checked(known_part(tree["workflow"]), where=f"{url}/{DESCRIPTION}")
    catalog = read_catalog(tree["catalog"], allow_outside=True)
    return Prepared(workflow, catalog, _area(tree["area"], store), store).with_settled_poses()


def names_of_run(url: str) -> tuple[str, str]:
    """Name of the workflow and address of the catalog of an existing RUN; neither is read. Raises RunError where there is none."""
    store = Store.open(url)
    if not _is_run(store):
        raise _no_run(url)
    tree = _description(store)
    return str(tree["workflow"].get("name", "")), tree["catalog"]


def _no_run(url: str) -> RunError:
    return RunError("no run here (run.json is missing)", where=url, remedy="start one with `cityflow run … --out`")


def _area(wkt: Any, store: Store) -> Area:
    try:
        return Area.of_wkt(wkt)
    except (shapely.errors.ShapelyError, TypeError) as error:
        problem = f"run.json is damaged: its area is none ({error})".splitlines()[0]
        raise RunError(problem, where=store.root, remedy="restore it or start a new RUN") from error


def _is_run(store: Store) -> bool:
    try:
        return store.exists(DESCRIPTION)
    except Exception as error:
        # Every object store has exceptions of its own for an endpoint that is away and for keys that do not fit.
        problem = f"cannot read here ({type(error).__name__}: {error})".splitlines()[0]
        raise RunError(problem, where=store.root, remedy="check the address, the endpoint and your keys") from error


def workflow_tree(workflow: Workflow) -> dict[str, Any]:
    """A workflow as it stands in a file: the stages at the top level."""
    tree = workflow.model_dump(mode="json")
    return {**{k: v for k, v in tree.items() if k != "city"}, **tree["city"]}


def _describe(wanted: Prepared) -> dict[str, Any]:
    return {
        "workflow": stripped(workflow_tree(wanted.workflow)),
        "catalog": without_credentials(wanted.catalog.href),
        "area": wanted.area.wkt,
        "versions": _versions(),
    }


@cache
def _versions() -> dict[str, str]:
    return {"cityflow": __version__, "python": platform.python_version(), **{p: version(p) for p in PACKAGES}}


def _description(store: Store) -> dict[str, Any]:
    try:
        tree = json.loads(store.read_bytes(DESCRIPTION))
        return {"workflow": dict(tree["workflow"]), "catalog": str(tree["catalog"]), "area": tree["area"]}
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise RunError(
            f"run.json is damaged: {error}", where=store.root, remedy="restore it or start a new RUN"
        ) from error


def _refuse_stranger(url: str, old: Mapping[str, Any], wanted: Prepared) -> None:
    name = old["workflow"].get("name")
    if name != wanted.workflow.name:
        raise RunError(
            f"this RUN belongs to the workflow '{name}', not to '{wanted.workflow.name}'",
            where=url,
            remedy="choose another --out",
        )
    href = without_credentials(wanted.catalog.href)
    if old["catalog"] != href:
        raise RunError(
            f"this RUN was made from the catalog {old['catalog']}, not from {href}",
            where=url,
            remedy="choose another --out, or name that catalog",
        )

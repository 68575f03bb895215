"""Writes a catalog to a temporary folder, and moves it in place when it is complete."""

from __future__ import annotations

import glob
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import fsspec

from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import COLLECTION, Catalog, is_catalog
from cityflow.io.catalog.stac_write import write_catalog

DATA = "data"


def refuse_foreign_folder(target: Path) -> None:
    # A path has lost one of the two slashes by now.
    if ":/" in target.as_posix():
        raise CatalogError(
            "a catalog is made in a local folder", where=str(target), remedy="make it locally, then upload the folder"
        )
    if target.exists() and not target.is_dir():
        raise CatalogError("this is a file, not a folder", where=str(target), remedy="choose another folder")
    if target.is_dir() and any(target.iterdir()) and not is_catalog(target):
        raise CatalogError(
            "the folder is not empty and holds no catalog", where=str(target), remedy="choose a new folder"
        )


def store_catalog(catalog: Catalog, target: Path, copy: bool, made: Mapping[str, bytes] | None = None) -> Catalog:
    """Write into a folder beside the target, then move it there.

    Parameters
    ----------
    copy : put the files into the catalog's folder instead of referring to them
    made : name of an asset → contents of its file, which is always in the catalog's folder

    Raises
    ------
    CatalogError
        Where the folder cannot be written.
    """
    parent = target.absolute().parent
    try:
        parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{target.name}-", dir=parent) as beside:
            stage = Path(beside) / "catalog"
            places = _copies(catalog, stage, set(made or ())) if copy else _references(catalog, target.absolute())
            places |= _written(catalog, stage, made or {})
            write_catalog(stage, catalog, places, str(target.absolute()))
            _move(stage, target.absolute())
    except OSError as error:
        raise CatalogError(
            f"the catalog cannot be written ({error})", where=str(target), remedy="choose a writable folder"
        ) from error
    moved = places if copy else {name: places[name] for name in made or ()}
    return _at(catalog, {name: str(target.absolute() / "items" / place) for name, place in moved.items()})


def _written(catalog: Catalog, stage: Path, made: Mapping[str, bytes]) -> dict[str, str]:
    places = {}
    for asset in catalog.assets:
        if asset.name in made:
            (stage / DATA).mkdir(parents=True, exist_ok=True)
            (stage / DATA / Path(asset.href).name).write_bytes(made[asset.name])
            places[asset.name] = f"../{DATA}/{Path(asset.href).name}"
    return places


def _copies(catalog: Catalog, stage: Path, made: set[str]) -> dict[str, str]:
    (stage / DATA).mkdir(parents=True)
    places: dict[str, str] = {}
    taken: set[str] = set()
    for asset in catalog.assets:
        if asset.name in made:
            continue
        name = Path(asset.href).name
        if name in taken:
            name = asset.name + Path(name).suffix
        taken.add(name)
        for source in _with_companions(asset.href):
            copy = stage / DATA / (Path(name).stem + Path(source).suffix)
            with fsspec.open(source, "rb") as original, copy.open("wb") as to:
                shutil.copyfileobj(original, to)
        places[asset.name] = f"../{DATA}/{name}"
    return places


def _with_companions(href: str) -> list[str]:
    """A Shapefile is several files of one name; anything else is itself."""
    path = Path(href)
    if path.suffix.lower() != ".shp" or "://" in href:
        return [href]
    return sorted(str(p) for p in path.parent.glob(f"{glob.escape(path.stem)}.*"))


def _references(catalog: Catalog, target: Path) -> dict[str, str]:
    return {
        a.name: a.href
        if "://" in a.href
        else Path(os.path.relpath(Path(a.href).absolute(), target / "items")).as_posix()
        for a in catalog.assets
    }


def _move(stage: Path, target: Path) -> None:
    """Into place; over an older catalog its items go first and the collection comes last."""
    if not target.exists() or not any(target.iterdir()):
        if target.exists():
            target.rmdir()
        stage.rename(target)
        return
    for old in (target / "items").glob("*.json"):
        old.unlink()
    for source in sorted(p for p in stage.rglob("*") if p.is_file() and p.name != COLLECTION):
        place = target / source.relative_to(stage)
        place.parent.mkdir(parents=True, exist_ok=True)
        source.replace(place)
    (stage / COLLECTION).replace(target / COLLECTION)


def _at(catalog: Catalog, places: Mapping[str, str]) -> Catalog:
    """The catalog with those of its files where they are now that were written into its folder."""
    clean = {name: os.path.normpath(place) for name, place in places.items()}
    given, sparse = catalog.outlines, catalog.sparse
    return replace(
        catalog,
        lidar=tuple(replace(a, href=clean.get(a.name, a.href)) for a in catalog.lidar),
        images=tuple(replace(a, href=clean.get(a.name, a.href)) for a in catalog.images),
        sparse=replace(sparse, href=clean.get(sparse.name, sparse.href)) if sparse is not None else None,
        outlines=replace(given, href=clean.get(given.name, given.href)) if given is not None else None,
        rasters={kind: replace(a, href=clean.get(a.name, a.href)) for kind, a in catalog.rasters.items()},
    )

"""From a folder of files to a catalog: every header read, every checksum taken, nothing half-written."""

from __future__ import annotations

import glob
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import fsspec
from pyproj import CRS

from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.las import sample
from cityflow.io.las_header import LasHeader, read_header
from cityflow.io.raster_header import read_raster_header
from cityflow.io.reference import contradiction, horizontal_transform, reference_of, resolve, suspicion
from cityflow.io.stac import (
    COLLECTION,
    OUTLINES,
    RASTERS,
    Catalog,
    LidarAsset,
    OutlineAsset,
    RasterAsset,
    is_catalog,
    sha256_of,
    united,
)
from cityflow.io.stac_write import lidar_asset, raster_asset, write_catalog
from cityflow.io.vector import read_layer, read_outlines

LIDAR_SUFFIXES = (".las", ".laz")
ASSIGN = "assign the CRS with --crs EPSG:n, or --crs local for a metric frame of its own"
DATA = "data"


@dataclass(frozen=True, slots=True)
class CreatedCatalog:
    """What was written, and what a user should know about it."""

    catalog: Catalog
    notes: tuple[str, ...]


def create_catalog(
    out: str | Path,
    *,
    lidar: Sequence[str],
    outlines: str | Path | None = None,
    dsm: str | Path | None = None,
    dtm: str | Path | None = None,
    ortho: str | Path | None = None,
    crs: str | None = None,
    id_column: str | None = None,
    id_format: str | None = None,
    layer: str | None = None,
    title: str = "",
    licence: str = "",
    attribution: str = "",
    date: str = "",
    copy: bool = False,
) -> CreatedCatalog:
    """Describe files as a catalog in the folder `out`.

    Parameters
    ----------
    out : a new or empty folder, or one with a catalog, which is replaced; other files in it stay
    lidar : paths, folders, globs or URLs of LAS and LAZ files
    outlines : polygons in any format that GDAL reads, in any CRS
    dsm, dtm, ortho : rasters
    crs : ``EPSG:n`` or ``local``; None takes what the LiDAR files say
    id_column, id_format, layer : see `io.vector.read_outlines`
    date : ISO day of the survey; empty takes the dates of the LiDAR headers
    copy : put copies of the files beside the catalog instead of referring to them

    Raises
    ------
    CatalogError
        Where a file is missing, unreadable, of another CRS, or without one and none is assigned; nothing is written then.
    """
    target = Path(out)
    _refuse_foreign_folder(target)
    headers = [read_header(path) for path in lidar_files(lidar)]
    given = {kind: path for kind, path in zip(RASTERS, (dsm, dtm, ortho), strict=True) if path is not None}
    if not headers and not given:
        raise CatalogError(
            "no LiDAR file and no raster is given", where=str(out), remedy="name LAS or LAZ files with --lidar"
        )
    reference, notes = common_reference(headers, crs)
    catalog = Catalog(
        href=target.absolute().as_posix(),
        title=title or target.absolute().name,
        reference=reference,
        licence=licence or "other",
        attribution=attribution,
        lidar=_lidar_assets(headers, date),
        rasters=_raster_assets(given, reference, date, notes),
    )
    if outlines is not None:
        found = OutlineAsset(OUTLINES, str(outlines), "", 0, catalog.bounds, 0, id_column, id_format, layer, date)
        catalog = replace(catalog, outlines=_described(found, reference, notes))
    return CreatedCatalog(_store(catalog, target, copy), tuple(notes))


def lidar_files(patterns: Iterable[str]) -> list[str]:
    """Files that paths, folders, globs and URLs name, each once and sorted.

    Raises
    ------
    CatalogError
        Where one of them names nothing.
    """
    found: dict[str, None] = {}
    for pattern in patterns:
        paths = _expanded(str(pattern))
        if not paths:
            raise CatalogError(
                "no LAS or LAZ file matches", where=str(pattern), remedy="check the path; quote globs for the shell"
            )
        found.update(dict.fromkeys(paths))
    return sorted(found)


def _expanded(pattern: str) -> list[str]:
    if "://" in pattern:
        fs, path = fsspec.core.url_to_fs(pattern)
        return sorted(str(fs.unstrip_protocol(p)) for p in fs.glob(path))
    if Path(pattern).is_dir():
        return sorted(str(p) for p in Path(pattern).iterdir() if p.suffix.lower() in LIDAR_SUFFIXES)
    if Path(pattern).exists() or not glob.has_magic(pattern):
        return [pattern]
    return sorted(p for p in glob.glob(pattern, recursive=True) if Path(p).suffix.lower() in LIDAR_SUFFIXES)


def common_reference(headers: Sequence[LasHeader], crs: str | None) -> tuple[Reference, list[str]]:
    """The reference of all LiDAR files, assigned or found in them, and notes on what they say.

    Raises
    ------
    CatalogError
        Where files contradict it or each other, have none and none is assigned, or look like degrees.
    """
    if crs is None:
        silent = [h.path for h in headers if h.crs_wkt is None]
        if silent or not headers:
            where = silent[0] if silent else ""
            raise CatalogError("the file carries no CRS and none is assigned", where=where, remedy=ASSIGN)
        reference = _reference_in(headers[0])
    else:
        reference = resolve(crs)
    notes: list[str] = []
    for header in headers:
        _check_crs(header.path, header.crs, reference, notes)
        doubt = suspicion(reference, header.bounds)
        if "degrees" in doubt:
            raise CatalogError(doubt, where=header.path, remedy="reproject the file to a projected CRS in metres")
        notes += [f"{Path(header.path).name}: {doubt}"] if doubt else []
    if reference.vertical_epsg is None and not reference.is_local:
        notes.append(f"{reference.code} says nothing about heights; a compound code would (for example EPSG:7415)")
    return reference, notes


def _reference_in(header: LasHeader) -> Reference:
    crs = header.crs
    assert crs is not None
    try:
        return reference_of(crs)
    except CatalogError as error:
        raise CatalogError(error.problem, where=header.path, remedy=error.remedy) from error


def _check_crs(path: str, found: CRS | None, reference: Reference, notes: list[str]) -> None:
    """A file that carries another CRS than the catalog's is refused; in a local frame it is only noted."""
    if found is None:
        return
    against = contradiction(reference, found)
    if against and not reference.is_local:
        raise CatalogError(against, where=path, remedy="assign the CRS that the file carries, or reproject the file")
    if against:
        notes.append(f"{Path(path).name}: {against}; its coordinates are taken as they are")


def _lidar_assets(headers: Sequence[LasHeader], date: str) -> tuple[LidarAsset, ...]:
    names = _unique([Path(h.path).stem for h in headers])
    assets = []
    for header, name in zip(headers, names, strict=True):
        checksum, _ = sha256_of(header.path)
        seen = sample(header.path)
        asset = lidar_asset(header, name, checksum, tuple(seen.classes), date)
        assets.append(replace(asset, returns=max(asset.returns, seen.returns)))
    return tuple(assets)


def _unique(stems: Sequence[str]) -> list[str]:
    """Names fit for files and tasks, each once; those of the other items are taken."""
    taken = {OUTLINES, *RASTERS}
    names = []
    for stem in stems:
        base = "".join(c if c.isalnum() or c in "._-" else "-" for c in stem) or "lidar"
        name, n = base, 1
        while name in taken:
            n += 1
            name = f"{base}-{n}"
        taken.add(name)
        names.append(name)
    return names


def _raster_assets(
    given: Mapping[str, str | Path], reference: Reference, date: str, notes: list[str]
) -> dict[str, RasterAsset]:
    assets = {}
    for kind, path in given.items():
        header = read_raster_header(path)
        if header.crs is None:
            notes.append(f"{Path(path).name} carries no CRS; {reference.name} is assumed")
        elif contradiction(reference, header.crs):
            if reference.is_local:
                raise CatalogError(contradiction(reference, header.crs), where=str(path), remedy=ASSIGN)
            moved = horizontal_transform(header.crs, reference).transform_bounds(*header.bounds, densify_pts=21)
            header = replace(header, bounds=moved)
            notes.append(
                f"{Path(path).name} is in {header.crs.name if header.crs else ''}; it is reprojected when it is read"
            )
        assets[kind] = raster_asset(header, kind, kind, sha256_of(path), date)
    return assets


def _described(asset: OutlineAsset, reference: Reference, notes: list[str]) -> OutlineAsset:
    source = read_layer(asset.href, asset.layer)
    found, remarks = read_outlines(asset.href, asset.id_column, asset.id_format, reference, asset.layer)
    notes += remarks
    checksum, size = sha256_of(asset.href)
    return replace(
        asset,
        checksum=checksum,
        size=size,
        bounds=united([o.polygon.bounds for o in found if not o.polygon.is_empty]),
        count=len(found),
        layer=source.name,
        crs_in_file=source.crs.name if source.crs is not None else "",
    )


def _refuse_foreign_folder(target: Path) -> None:
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


def _store(catalog: Catalog, target: Path, copy: bool) -> Catalog:
    """Write into a folder beside the target, then move it there."""
    parent = target.absolute().parent
    try:
        parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{target.name}-", dir=parent) as beside:
            stage = Path(beside) / "catalog"
            places = _copies(catalog, stage) if copy else _references(catalog, target.absolute())
            write_catalog(stage, catalog, places)
            _move(stage, target.absolute())
    except OSError as error:
        raise CatalogError(
            f"the catalog cannot be written ({error})", where=str(target), remedy="choose a writable folder"
        ) from error
    if not copy:
        return catalog
    return _at(catalog, {name: str(target.absolute() / "items" / place) for name, place in places.items()})


def _copies(catalog: Catalog, stage: Path) -> dict[str, str]:
    (stage / DATA).mkdir(parents=True)
    places: dict[str, str] = {}
    for asset in catalog.assets:
        name = Path(asset.href).name
        if f"../{DATA}/{name}" in places.values():
            name = asset.name + Path(name).suffix
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
    """The catalog with its files where they were copied to."""
    clean = {name: os.path.normpath(place) for name, place in places.items()}
    given = catalog.outlines
    return replace(
        catalog,
        lidar=tuple(replace(a, href=clean[a.name]) for a in catalog.lidar),
        outlines=replace(given, href=clean[given.name]) if given is not None else None,
        rasters={kind: replace(a, href=clean[a.name]) for kind, a in catalog.rasters.items()},
    )

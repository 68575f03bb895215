"""Makes a catalog from files: reads every header, computes every checksum, and writes the catalog only when it is complete."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import fsspec
from pyproj import CRS

from cityflow.catalog.file_questions import Reading, refuse_unreadable
from cityflow.catalog.file_reading import DIGESTS, LIDAR_FILES, Digest, LidarFile, bytes_of
from cityflow.catalog.image_entries import described_images
from cityflow.catalog.orientation import ImageSource
from cityflow.catalog.write_folder import refuse_foreign_folder, store_catalog
from cityflow.core.orientation_figures import OrientationFigures
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.catalog.stac import (
    OUTLINES,
    RASTERS,
    Catalog,
    LidarAsset,
    OutlineAsset,
    RasterAsset,
    united,
)
from cityflow.io.catalog.stac_write import lidar_asset, raster_asset
from cityflow.io.crs import contradiction, horizontal_transform, reference_of, resolve, suspicion
from cityflow.io.points.las_header import LasHeader
from cityflow.io.rasters.raster_header import read_raster_header
from cityflow.io.tables.outline_file import read_outlines
from cityflow.io.tables.vector import read_layer

LIDAR_SUFFIXES = (".las", ".laz")
ASSIGN = "assign the CRS with --crs EPSG:n, or --crs local for a metric frame of its own"


@dataclass(frozen=True, slots=True)
class CreatedCatalog:
    """What was written, and what a user should know about it."""

    catalog: Catalog
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SurveyFiles:
    """What a catalog is made of.

    Attributes
    ----------
    lidar : paths, folders, globs or URLs of LAS and LAZ files
    images : where oriented images and their orientation are
    outlines : polygons in any format that GDAL reads, in any CRS
    dsm, dtm : rasters
    orthos : orthophotos, one for each epoch
    id_column, id_format, layer : of the outlines, see `io.tables.outline_file.read_outlines`
    """

    lidar: Sequence[str] = ()
    images: ImageSource | None = None
    outlines: str | Path | None = None
    dsm: str | Path | None = None
    dtm: str | Path | None = None
    orthos: Sequence[str | Path] = ()
    id_column: str | None = None
    id_format: str | None = None
    layer: str | None = None


@dataclass(frozen=True, slots=True)
class SurveyText:
    """What a catalog tells of its survey; `date`: ISO day, empty takes the dates of the LiDAR headers."""

    title: str = ""
    licence: str = ""
    attribution: str = ""
    date: str = ""


def create_catalog(
    out: str | Path,
    files: SurveyFiles,
    *,
    crs: str | None = None,
    text: SurveyText = SurveyText(),
    copy: bool = False,
    reading: Reading | None = None,
    orientation: OrientationFigures | None = None,
) -> CreatedCatalog:
    """Describe files as a catalog in the folder `out`.

    Parameters
    ----------
    out : a new or empty folder, or one with a catalog, which is replaced; other files in it stay
    files, text : what it is made of, and what it tells of the survey
    crs : ``EPSG:n`` or ``local``; None takes what the LiDAR files say
    copy : put copies of the files beside the catalog instead of referring to them
    orientation : what has been found of the images, for the catalog to keep
    reading : where files are read; one after another in this process where it is not given. The catalog does not depend on it

    Raises
    ------
    CatalogError
        Where a file is missing, unreadable, of another CRS, or without one and none is assigned; nothing is written then. All files that cannot be
        read are named.
    """
    target, reading = Path(out), reading or Reading()
    refuse_foreign_folder(target)
    lidar = _read_lidar(lidar_files(files.lidar), reading)
    headers = [file.contents.header for file in lidar]
    heights = {kind: path for kind, path in (("dsm", files.dsm), ("dtm", files.dtm)) if path is not None}
    given = {**heights, **{"ortho" if k == 1 else f"ortho-{k}": path for k, path in enumerate(files.orthos, 1)}}
    if not headers and not given and files.images is None:
        raise CatalogError(
            "no LiDAR file, no image and no raster is given",
            where=str(out),
            remedy="name LAS or LAZ files with --lidar, or a folder of oriented images with --images",
        )
    reference, notes = common_reference(headers, crs)
    catalog = Catalog(
        href=target.absolute().as_posix(),
        title=text.title or target.absolute().name,
        reference=reference,
        licence=text.licence or "other",
        attribution=text.attribution,
        lidar=_lidar_assets(lidar, text.date),
        rasters=_raster_assets(given, reference, text.date, notes, reading),
        orientation=orientation,
    )
    made: dict[str, bytes] = {}
    if files.images is not None:
        found_images = described_images(files.images, catalog, text.date, reading)
        notes += found_images.notes
        made = found_images.made
        catalog = replace(catalog, images=found_images.images, sparse=found_images.sparse)
    if files.outlines is not None:
        named = files.id_column, files.id_format, files.layer
        found = OutlineAsset(OUTLINES, str(files.outlines), "", 0, catalog.bounds, 0, *named, text.date)
        catalog = replace(catalog, outlines=_described(found, reference, notes, reading))
    return CreatedCatalog(store_catalog(catalog, target, copy, made), tuple(notes))


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
        notes.append(
            f"{reference.code} does not state a height datum; {reference.code}+NNNN does, with the EPSG code of the datum"
        )
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


def _read_lidar(paths: Sequence[str], reading: Reading) -> list[LidarFile]:
    answers = reading.answers(LIDAR_FILES, paths, len(paths), bytes_of(paths))
    return refuse_unreadable(answers, paths)


def _lidar_assets(files: Sequence[LidarFile], date: str) -> tuple[LidarAsset, ...]:
    names = _unique([Path(f.contents.header.path).stem for f in files])
    assets = []
    for file, name in zip(files, names, strict=True):
        header, seen = file.contents.header, file.contents.sample
        asset = lidar_asset(header, name, file.digest.checksum, tuple(seen.classes), date)
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
    given: Mapping[str, str | Path], reference: Reference, date: str, notes: list[str], reading: Reading
) -> dict[str, RasterAsset]:
    assets = {}
    headers = {name: read_raster_header(path) for name, path in given.items()}
    for (name, path), digest in zip(given.items(), _digests([str(p) for p in given.values()], reading), strict=True):
        header = headers[name]
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
        assets[name] = raster_asset(header, name, name.partition("-")[0], digest.checksum, digest.size, date)
    return assets


def _digests(paths: Sequence[str], reading: Reading) -> list[Digest]:
    answers = reading.answers(DIGESTS, paths, len(paths), bytes_of(paths))
    return refuse_unreadable(answers, paths)


def _described(asset: OutlineAsset, reference: Reference, notes: list[str], reading: Reading) -> OutlineAsset:
    source = read_layer(asset.href, asset.layer)
    found, remarks = read_outlines(asset.href, asset.id_column, asset.id_format, reference, asset.layer)
    notes += remarks
    (digest,) = _digests([asset.href], reading)
    return replace(
        asset,
        checksum=digest.checksum,
        size=digest.size,
        bounds=united([o.polygon.bounds for o in found if not o.polygon.is_empty]),
        count=len(found),
        layer=source.name,
        crs_in_file=source.crs.name if source.crs is not None else "",
    )

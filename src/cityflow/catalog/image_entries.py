"""Oriented images for a catalog: reads the orientation model, checks each file, and reports unusable images by name."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from cityflow.catalog.file_questions import Reading, told_of
from cityflow.catalog.file_reading import IMAGE_FILES, ImageFile, bytes_of
from cityflow.catalog.gains import Balanced, balanced
from cityflow.catalog.height_ranges import (
    HeightRange,
    given_heights,
    heights_of_points,
    heights_of_rasters,
    low_points,
    raster_points,
)
from cityflow.catalog.image_files import ImageFiles, matched, sizes_of, unit_names
from cityflow.catalog.orientation import ImageSource, read_model
from cityflow.catalog.tried_angles import AngleTable, with_tried_angles
from cityflow.catalog.white import with_white
from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds
from cityflow.core.points import PointCloud
from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.flow.spread import Answer
from cityflow.io.catalog.stac import OUTLINES, RASTERS, SPARSE, Catalog, ImageAsset, SparseAsset
from cityflow.io.crs import crs_of, suspicion
from cityflow.io.images.image_header import ImageHeader, check_against
from cityflow.io.orientation.oriented_images import LeftOut, OrientationModel
from cityflow.io.points.las_write import write_points
from cityflow.io.tables.feature_ids import listing
from cityflow.orientation.plausibility import SURVEY, datum_doubt, implausible
from cityflow.orientation.sights import looks_level, sights
from cityflow.orientation.views import View, footprint

SPARSE_FILE = "sparse.laz"
MOST_SPARSE = 2_000_000
"""Tie points kept in the catalog; of more, every n-th; set by hand."""
FEWEST_IMAGES = 2
"""What one image sees has no height."""


@dataclass(frozen=True, slots=True)
class DescribedImages:
    """Images as the catalog holds them, files made for it, and notes."""

    images: tuple[ImageAsset, ...]
    sparse: SparseAsset | None
    made: dict[str, bytes]
    notes: list[str] = field(default_factory=list)


def described_images(source: ImageSource, catalog: Catalog, date: str, reading: Reading) -> DescribedImages:
    """Describe all images of a source that can be used.

    Parameters
    ----------
    catalog : with its reference, LiDAR files and rasters

    Raises
    ------
    CatalogError
        Where the model cannot be read, or no two images can be used.
    """
    if not source.folder.is_dir():
        raise CatalogError("no such folder of images", where=str(source.folder), remedy="check --images")
    there = ImageFiles.of(source.folder)
    model = read_model(source, catalog.reference, sizes_of(there)).moved(source.origin)
    heights = _heights(source, model, catalog)
    tried = with_tried_angles(AngleTable(source, catalog.reference, there), model, heights, reading)
    model = tried.model
    taken = {a.name for a in catalog.assets} | {OUTLINES, SPARSE, *RASTERS}
    found, missing = matched(model.images, there, source.folder)
    names = unit_names([name for name, _ in found], taken)
    left_out = [*model.left_out, *missing]
    kept: list[ImageAsset] = []
    plausible, doubts = _plausible(model.images, heights, tried.is_clear)
    oriented = {i.name: i for i in model.images}
    paths = [str(path) for name, path in found if name not in doubts]
    answers = reading.answers(IMAGE_FILES, paths, len(paths), bytes_of(paths))
    files = dict(zip(paths, answers, strict=True))
    for (name, path), unit in zip(found, names, strict=True):
        if name in doubts:
            left_out.append(doubts[name])
            continue
        try:
            asset = _described(path, files[str(path)], replace(oriented[name], name=unit), heights, date)
            kept.append(replace(asset, pixel_mm=model.pixel_mm.get(name, 0.0)))
        except CatalogError as error:
            left_out.append(LeftOut(name, error.problem, error.remedy))
    kept, others = _of_one_kind(kept)
    kept, left_out = with_white(kept), [*left_out, *others]
    # points on the ground say nothing of photographs from the street, which see walls in the place of them
    street = [a for a in kept if looks_level(a.oriented, heights.whole[1])]
    flown = [a for a in kept if not looks_level(a.oriented, heights.whole[1])]
    level = balanced(flown, model.sparse, reading) if source.gains and flown else Balanced(tuple(flown), (), ())
    kept, left_out = [*level.images, *street], [*left_out, *level.damaged]
    notes = [
        *model.notes,
        *tried.notes,
        *_place(model.images, catalog.reference),
        *plausible,
        *_datum(model, catalog),
        *level.notes,
        *_unused(found, there),
        *_in_words(left_out),
    ]
    _refuse_too_few(kept, left_out, source)
    sparse, made = sparse_of(model.sparse, catalog)
    return DescribedImages(tuple(sorted(kept, key=lambda a: a.name)), sparse, made, notes)


def _of_one_kind(images: list[ImageAsset]) -> tuple[list[ImageAsset], list[LeftOut]]:
    """Images of as many bands and bits as most have, and the others: orthos and points have one kind of colour."""
    count = Counter((i.bands, i.dtype) for i in images)
    if len(count) < 2:
        return images, []
    usual = max(count, key=lambda kind: (count[kind], kind))
    remedy = f"convert it to {_kind(*usual)} like the others, or make a catalog of its own"
    others = [
        LeftOut(i.name, f"it has {_kind(i.bands, i.dtype)}, most images have {_kind(*usual)}", remedy)
        for i in images
        if (i.bands, i.dtype) != usual
    ]
    return [i for i in images if (i.bands, i.dtype) == usual], others


def _kind(bands: int, dtype: str) -> str:
    return f"{bands} band{'s' if bands > 1 else ''} of {dtype.removeprefix('uint')} bits"


def _described(
    path: Path, file: Answer[ImageFile], image: OrientedImage, heights: HeightRange, date: str
) -> ImageAsset:
    if not isinstance(file, ImageFile):
        raise told_of(file, str(path))
    header = file.contents.header
    check_against(header, image.camera)
    if file.contents.is_cut_off:
        remedy = "copy the file again, or leave the image out"
        raise CatalogError("the file is truncated", where=str(path), remedy=remedy)
    image = replace(image, head=_head(image.head, header))
    level = looks_level(image, heights.whole[1])
    low, high = heights.whole if level else heights.over(image)
    if image.centre[2] <= low:
        problem = f"it was taken at a height of {image.centre[2]:.1f} m, below all ground ({low:.1f} m)"
        raise CatalogError(problem, where=str(path), remedy="check the heights' datum, or give --heights")
    view = View(image, (low, high))
    seen = sights([view])[0] if level else footprint(view)
    if seen.is_empty:
        raise CatalogError(
            "it does not look at the ground", where=str(path), remedy="check angle unit and rotation order"
        )
    ones = (1.0,) * header.bands
    day = date or _day(header)
    return ImageAsset(
        image.name, str(path), file.digest.checksum, file.digest.size, _rounded(seen.bounds), image, (low, high), header.bands, header.dtype, ones, day
    )  # fmt: skip


def _head(in_model: str, header: ImageHeader) -> str:
    """What the orientation calls the camera, its maker and model, its serial number: each of them may be missing, or the same for several heads."""
    return " ".join(part for part in (in_model, header.camera, header.serial) if part)


def _day(header: ImageHeader) -> str:
    """EXIF writes 2024:05:17 12:00:00."""
    found = re.match(r"(\d{4})[:-](\d{2})[:-](\d{2})", header.taken)
    return "-".join(found.groups()) if found and found[1] != "0000" else ""


def _rounded(bounds: Sequence[float]) -> Bounds:
    x_min, y_min, x_max, y_max = (round(float(v), 3) for v in bounds)
    return x_min, y_min, x_max, y_max


def _heights(source: ImageSource, model: OrientationModel, catalog: Catalog) -> HeightRange:
    if source.heights is not None:
        return given_heights(*source.heights)
    try:
        return heights_of_points(model.sparse)
    except ValueError as error:
        heights = heights_of_rasters(catalog)
        if heights is not None:
            return heights
        raise CatalogError(
            f"the height range of ground and buildings is unknown ({error})",
            where=str(source.folder),
            remedy="give the lowest ground and the highest object with --heights MIN,MAX",
        ) from error


def _place(images: Sequence[OrientedImage], reference: Reference) -> list[str]:
    """Whether the images' places can be coordinates of the CRS."""
    if not images:
        return []
    doubt = suspicion(reference, box_of([i.centre for i in images]))
    return [f"images: {doubt} → check --crs, and add what was subtracted with --origin X,Y,Z"] if doubt else []


def box_of(centres: Sequence[FloatArray]) -> Bounds:
    """The box around places in plan."""
    low, high = np.min(centres, axis=0), np.max(centres, axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _plausible(
    images: Sequence[OrientedImage], heights: HeightRange, angles_known: bool
) -> tuple[list[str], dict[str, LeftOut]]:
    """Doubts about the whole, in words, and images that cannot be where or as the model has them."""
    notes: list[str] = []
    single: dict[str, LeftOut] = {}
    for name, problem, remedy in implausible(images, *heights.whole, angles_known=angles_known):
        if name == SURVEY:
            notes.append(f"doubtful orientation: {problem} → {remedy}")
        else:
            single.setdefault(name, LeftOut(name, problem, remedy))
    return notes, single


def _datum(model: OrientationModel, catalog: Catalog) -> list[str]:
    """Tie points against the terrain, where one is given."""
    dtm = catalog.rasters.get("dtm")
    if dtm is None or not len(model.sparse):
        return []
    doubt = datum_doubt(low_points(model.sparse), raster_points(dtm, catalog.reference))
    return [f"heights: {doubt[1]} → {doubt[2]}"] if doubt else []


def _unused(found: list[tuple[str, Path]], files: ImageFiles) -> list[str]:
    known = {p for _, p in found}
    spare = [p.name for p in files.all if p not in known]
    return [f"{len(spare)} images have no orientation and are not used ({listing(spare)})"] if spare else []


def _in_words(left_out: Sequence[LeftOut]) -> list[str]:
    """Alike ones together: a model may lack thousands of files for one reason."""
    groups: dict[tuple[str, str], list[str]] = {}
    for each in left_out:
        groups.setdefault((each.problem, each.remedy), []).append(each.name)
    return [
        f"left out: {listing(names)}: {problem}" + (f" → {remedy}" if remedy else "")
        for (problem, remedy), names in groups.items()
    ]


def _refuse_too_few(kept: Sequence[ImageAsset], left_out: Sequence[LeftOut], source: ImageSource) -> None:
    if len(kept) >= FEWEST_IMAGES:
        return
    first = f"; {left_out[0]}" if left_out else ""
    some = f"{len(kept)} image" if kept else "no image"
    raise CatalogError(
        f"{some} can be used, two are needed at least ({len(left_out)} left out{first})",
        where=str(source.folder),
        remedy="check that --images and the orientation belong together",
    )


def sparse_of(xyz: FloatArray, catalog: Catalog) -> tuple[SparseAsset | None, dict[str, bytes]]:
    """Tie points as a file of the catalog."""
    if not len(xyz):
        return None, {}
    kept = xyz[:: -(-len(xyz) // MOST_SPARSE)]
    data = write_points(PointCloud.of(kept), crs=crs_of(catalog.reference))
    low, high = kept.min(axis=0), kept.max(axis=0)
    bounds = _rounded((low[0], low[1], high[0], high[1]))
    z_range = round(float(low[2]), 3), round(float(high[2]), 3)
    checksum = hashlib.sha256(data).hexdigest()
    return SparseAsset(SPARSE, SPARSE_FILE, checksum, len(data), bounds, z_range, len(kept)), {SPARSE: data}

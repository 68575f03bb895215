"""Oriented images on their way into a catalog: the model read, each file looked at, what cannot be used left out by name."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds
from cityflow.core.points import PointCloud
from cityflow.errors import CatalogError
from cityflow.io.bundler import SizeOf
from cityflow.io.image_header import ImageHeader, check_against, image_header
from cityflow.io.las_write import write_points
from cityflow.io.oriented_images import LeftOut, OrientationModel
from cityflow.io.reference import crs_of
from cityflow.io.stac import OUTLINES, RASTERS, SPARSE, Catalog, ImageAsset, SparseAsset, sha256_of
from cityflow.io.vector import listing
from cityflow.orientation.plausibility import SURVEY, datum_doubt, implausible
from cityflow.orientation.views import View, footprint
from cityflow.stages.catalog_gains import Balanced, balanced
from cityflow.stages.catalog_heights import (
    HeightRange,
    given_heights,
    heights_of_points,
    heights_of_rasters,
    low_points,
    raster_points,
)
from cityflow.stages.catalog_orientation import ImageSource, read_model

IMAGE_SUFFIXES = (".jpg", ".jpeg", ".tif", ".tiff", ".png", ".jp2")
SPARSE_FILE = "sparse.laz"
MOST_SPARSE = 2_000_000
"""Tie points kept in the catalog; of more, every n-th."""
FEWEST_IMAGES = 2
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")


@dataclass(frozen=True, slots=True)
class DescribedImages:
    """Images as the catalog holds them, files made for it, and notes."""

    images: tuple[ImageAsset, ...]
    sparse: SparseAsset | None
    made: dict[str, bytes]
    notes: list[str] = field(default_factory=list)


def described_images(source: ImageSource, catalog: Catalog, date: str = "") -> DescribedImages:
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
    files = _Files.of(source.folder)
    model = read_model(source, catalog.reference, _sizes(files)).moved(source.origin)
    taken = {a.name for a in catalog.assets} | {OUTLINES, SPARSE, *RASTERS}
    found, missing = _found(model.images, files, source.folder)
    names = unit_names([name for name, _ in found], taken)
    left_out = [*model.left_out, *missing]
    kept: list[ImageAsset] = []
    heights = _heights(source, model, catalog)
    plausible, doubts = _plausible(model.images, heights)
    oriented = {i.name: i for i in model.images}
    for (name, path), unit in zip(found, names, strict=True):
        if name in doubts:
            left_out.append(doubts[name])
            continue
        try:
            asset = _described(path, replace(oriented[name], name=unit), heights, date)
            kept.append(replace(asset, pixel_mm=model.pixel_mm.get(name, 0.0)))
        except CatalogError as error:
            left_out.append(LeftOut(name, error.problem, error.remedy))
    level = balanced(kept, model.sparse) if source.gains else Balanced(tuple(kept), (), ())
    kept, left_out = list(level.images), [*left_out, *level.damaged]
    notes = [
        *model.notes,
        *plausible,
        *_datum(model, catalog),
        *level.notes,
        *_unused(found, files),
        *_in_words(left_out),
    ]
    _refuse_too_few(kept, left_out, source)
    sparse, made = _sparse(model.sparse, catalog)
    return DescribedImages(tuple(sorted(kept, key=lambda a: a.name)), sparse, made, notes)


def _sizes(files: _Files) -> SizeOf:
    """Size of an image by its name in a model, None where there is none or it cannot be read."""

    def size_of(name: str) -> tuple[int, int] | None:
        path = files.of_name(name)
        try:
            header = image_header(path) if path is not None else None
        except CatalogError:
            return None
        return (header.width, header.height) if header is not None else None

    return size_of


@dataclass(frozen=True, slots=True)
class _Files:
    """The image files of a folder and how a model may call them."""

    all: tuple[Path, ...]
    by_path: dict[str, Path]
    by_name: dict[str, Path]
    by_stem: dict[str, Path]

    @classmethod
    def of(cls, folder: Path) -> _Files:
        files = sorted(p for p in folder.rglob("*") if p.is_file() and p.suffix.lower() in IMAGE_SUFFIXES)
        by_path = {p.relative_to(folder).as_posix(): p for p in files}
        return cls(
            tuple(files), by_path, _only({p: p.name.lower() for p in files}), _only({p: p.stem.lower() for p in files})
        )

    def of_name(self, name: str) -> Path | None:
        """By relative path, else by file name, else by stem, where only one fits."""
        plain = Path(name.replace("\\", "/"))
        by_file = self.by_path.get(plain.as_posix()) or self.by_name.get(plain.name.lower())
        return by_file or self.by_stem.get(plain.name.lower()) or self.by_stem.get(plain.stem.lower())


def _found(
    images: Sequence[OrientedImage], files: _Files, folder: Path
) -> tuple[list[tuple[str, Path]], list[LeftOut]]:
    """Model's names with their files, and those that have none or another image's."""
    found: dict[Path, str] = {}
    missing = []
    for image in images:
        path = files.of_name(image.name)
        if path is None:
            problem = f"the image is in the model, but not in {folder.name}/"
            missing.append(LeftOut(image.name, problem, "put the file there and make the catalog again"))
        elif path in found:
            problem = f"its file would be {path.name}, which is {found[path]}'s"
            missing.append(LeftOut(image.name, problem, "give each image a file of its own"))
        else:
            found[path] = image.name
    return [(name, path) for path, name in found.items()], missing


def _only(keys: dict[Path, str]) -> dict[str, Path]:
    count = Counter(keys.values())
    return {key: path for path, key in keys.items() if count[key] == 1}


def unit_names(names: Sequence[str], taken: Iterable[str] = ()) -> list[str]:
    """Names for images that are fit for files and tasks, each once.

    The extension goes, unless two images differ by nothing else; folders become part of the name where file names repeat.

    >>> unit_names(["a/1.jpg", "b/1.jpg", "b/2.jpg"])
    ['a-1', 'b-1', '2']
    """
    plain = [n.replace("\\", "/") for n in names]
    shapes = [
        [Path(n).stem for n in plain],
        [str(Path(n).with_suffix("")) if Path(n).suffix else n for n in plain],
        plain,
    ]
    safe = [[_UNSAFE.sub("-", n).strip("-.") or "image" for n in shape] for shape in shapes]
    used, result = set(taken), []
    counts = [Counter(shape) for shape in safe]
    for i in range(len(plain)):
        choices = [s[i] for s, c in zip(safe, counts, strict=True) if c[s[i]] == 1]
        name = next((c for c in choices if c not in used), "")
        number = 1
        while not name or name in used:
            number += 1
            name = f"{safe[2][i]}-{number}"
        used.add(name)
        result.append(name)
    return result


def _described(path: Path, image: OrientedImage, heights: HeightRange, date: str) -> ImageAsset:
    header = image_header(path)
    check_against(header, image.camera)
    refuse_cut_off(path)
    low, high = heights.over(image)
    if image.centre[2] <= low:
        problem = f"it was taken at a height of {image.centre[2]:.1f} m, below all ground ({low:.1f} m)"
        raise CatalogError(problem, where=str(path), remedy="check the heights' datum, or give --heights")
    seen = footprint(View(image, (low, high)))
    if seen.is_empty:
        raise CatalogError("it looks at no ground", where=str(path), remedy="check angle unit and rotation order")
    checksum, size = sha256_of(path)
    ones = (1.0,) * header.bands
    day = date or _day(header)
    return ImageAsset(
        image.name, str(path), checksum, size, _rounded(seen.bounds), image, (low, high), header.bands, header.dtype, ones, day
    )  # fmt: skip


def refuse_cut_off(path: Path) -> None:
    """A JPEG ends with a mark of its own, perhaps followed by a little padding.

    Raises
    ------
    CatalogError
        Where it does not.
    """
    if path.suffix.lower() not in (".jpg", ".jpeg"):
        return
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - 4096))
        tail = file.read()
    if b"\xff\xd9" not in tail:
        raise CatalogError("the file is cut off", where=str(path), remedy="copy the file again, or leave the image out")


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
            f"nothing tells how high ground and buildings are ({error})",
            where=str(source.folder),
            remedy="give the lowest ground and the highest object with --heights MIN,MAX",
        ) from error


def _plausible(images: Sequence[OrientedImage], heights: HeightRange) -> tuple[list[str], dict[str, LeftOut]]:
    """Doubts about the whole, in words, and images that cannot be where or as the model has them."""
    notes: list[str] = []
    single: dict[str, LeftOut] = {}
    for name, problem, remedy in implausible(images, heights.whole[0]):
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


def _unused(found: list[tuple[str, Path]], files: _Files) -> list[str]:
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


def _sparse(xyz: FloatArray, catalog: Catalog) -> tuple[SparseAsset | None, dict[str, bytes]]:
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

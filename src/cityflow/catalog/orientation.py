"""Command-line options of oriented images as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.io.crs import crs_of
from cityflow.io.orientation.oriented_images import OrientationModel
from cityflow.io.orientation.readers import READERS, OrientationFile, SizeOf, option, read_orientation


@dataclass(frozen=True, slots=True)
class ImageSource:
    """Where images and their orientation are.

    Attributes
    ----------
    folder : of the image files; the model's names count from here
    orientation : format (`readers.READERS`) → file or folder; one, not yet checked
    options : of the format, as they were typed
    origin : x, y, z added to the model's coordinates, metres
    heights : lowest ground and highest object, metres; None takes them from tie points or rasters
    gains : make exposures alike, for which every image is decoded once
    """

    folder: Path
    orientation: Mapping[str, Path] = field(default_factory=dict)
    options: Mapping[str, str] = field(default_factory=dict)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heights: tuple[float, float] | None = None
    gains: bool = True


def image_source(
    folder: Path | None, typed: Mapping[str, str], origin: str = "", heights: str = "", gains: bool = True
) -> ImageSource | None:
    """Images and orientation as a command line names them; None where it names neither.

    Parameters
    ----------
    typed : options of orientation (names of `readers.READERS` and of the options there) → text

    Raises
    ------
    CatalogError
        Where something is missing or is no number.
    """
    named = {name: Path(path) for name, path in typed.items() if name in READERS}
    if folder is None:
        if named:
            where = str(next(iter(named.values())))
            raise CatalogError("an orientation without images", where=where, remedy="name their folder with --images")
        return None
    x, y, z = _numbers(origin, 3, "--origin") if origin else (0.0, 0.0, 0.0)
    low_high = _numbers(heights, 2, "--heights") if heights else None
    options = {name: text for name, text in typed.items() if name not in READERS}
    return ImageSource(folder, named, options, (x, y, z), (low_high[0], low_high[1]) if low_high else None, gains)


def _numbers(text: str, count: int, option: str) -> tuple[float, ...]:
    try:
        values = tuple(float(v) for v in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        raise CatalogError(f"{text!r} is not {count} numbers", where=option, remedy="separate them by commas")
    return values


def read_model(source: ImageSource, reference: Reference, size_of: SizeOf) -> OrientationModel:
    """The orientation, in whichever format it is given.

    Raises
    ------
    CatalogError
        Where none or more than one is given, or it cannot be read.
    """
    if len(source.orientation) != 1:
        raise CatalogError(
            "more than one orientation is given" if source.orientation else "images without orientation",
            where=str(source.folder),
            remedy=f"name one of {', '.join(map(option, READERS))}",
        )
    name, path = next(iter(source.orientation.items()))
    return read_orientation(name, OrientationFile(path, source.options, size_of, crs_of(reference)))

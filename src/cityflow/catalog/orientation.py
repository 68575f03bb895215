"""What a command line says of oriented images, read into values."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TypeVar

from cityflow.core.reference import Reference
from cityflow.errors import CatalogError
from cityflow.geometry.rotations import AngleUnit, RotationOrder
from cityflow.io.orientation.bundler import SizeOf, read_bundler
from cityflow.io.orientation.colmap import read_colmap
from cityflow.io.orientation.metashape import read_metashape
from cityflow.io.orientation.opk import OpkTable, parsed_columns, read_opk
from cityflow.io.orientation.oriented_images import OrientationModel
from cityflow.io.reference import crs_of

Choice = TypeVar("Choice", bound=StrEnum)


@dataclass(frozen=True, slots=True)
class ImageSource:
    """Where images and their orientation are.

    Attributes
    ----------
    folder : of the image files; the model's names count from here
    colmap : folder of a COLMAP model
    opk : a table of angles with its cameras
    bundler, bundler_list : Bundler's output, and the list of its images where it has an unusual name
    metashape : cameras as XML
    origin : x, y, z added to the model's coordinates, metres
    heights : lowest ground and highest object, metres; None takes them from tie points or rasters
    gains : make exposures alike, for which every image is decoded once
    """

    folder: Path
    colmap: Path | None = None
    opk: OpkTable | None = None
    bundler: Path | None = None
    bundler_list: Path | None = None
    metashape: Path | None = None
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heights: tuple[float, float] | None = None
    gains: bool = True


@dataclass(frozen=True, slots=True)
class OrientationFiles:
    """Options of the command line as they were typed; see ``cityflow catalog create --help``."""

    colmap: Path | None = None
    opk: Path | None = None
    cameras: Path | None = None
    columns: str = ""
    angle_unit: str = AngleUnit.DEGREE
    rotation_order: str = RotationOrder.OMEGA_PHI_KAPPA
    bundler: Path | None = None
    bundler_list: Path | None = None
    metashape: Path | None = None

    @property
    def table(self) -> OpkTable | None:
        if self.opk is None:
            return None
        if self.cameras is None:
            raise CatalogError(
                "a table of angles needs its cameras", where=str(self.opk), remedy="name them with --cameras FILE"
            )
        unit, order = (
            _one_of(AngleUnit, self.angle_unit, "--angle-unit"),
            _one_of(RotationOrder, self.rotation_order, "--rotation-order"),
        )
        return OpkTable(self.opk, self.cameras, parsed_columns(self.columns), unit, order)


def image_source(
    folder: Path | None, files: OrientationFiles, origin: str = "", heights: str = "", gains: bool = True
) -> ImageSource | None:
    """Images and orientation as a command line names them; None where it names neither.

    Raises
    ------
    CatalogError
        Where something is missing or is no number.
    """
    if folder is None:
        named = [p for p in (files.colmap, files.opk, files.bundler, files.metashape) if p is not None]
        if named:
            raise CatalogError(
                "an orientation without images", where=str(named[0]), remedy="name their folder with --images"
            )
        return None
    x, y, z = _numbers(origin, 3, "--origin") if origin else (0.0, 0.0, 0.0)
    low_high = _numbers(heights, 2, "--heights") if heights else None
    return ImageSource(
        folder, files.colmap, files.table, files.bundler, files.bundler_list, files.metashape, (x, y, z),
        (low_high[0], low_high[1]) if low_high else None, gains,
    )  # fmt: skip


def _numbers(text: str, count: int, option: str) -> tuple[float, ...]:
    try:
        values = tuple(float(v) for v in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        raise CatalogError(f"{text!r} is not {count} numbers", where=option, remedy="separate them by commas")
    return values


def _one_of(choices: type[Choice], text: str, option: str) -> Choice:
    try:
        return choices(text.lower())
    except ValueError as error:
        raise CatalogError(f"{text!r} is not known", where=option, remedy=f"one of {', '.join(choices)}") from error


def read_model(source: ImageSource, reference: Reference, size_of: SizeOf) -> OrientationModel:
    """The orientation, in whichever format it is given.

    Raises
    ------
    CatalogError
        Where none or more than one is given, or it cannot be read.
    """
    given = [g for g in (source.colmap, source.opk, source.bundler, source.metashape) if g is not None]
    if len(given) != 1:
        raise CatalogError(
            "images without orientation" if not given else "more than one orientation is given",
            where=str(source.folder),
            remedy="name one of --colmap, --opk, --bundler, --metashape",
        )
    if source.colmap is not None:
        return read_colmap(source.colmap)
    if source.opk is not None:
        return read_opk(source.opk)
    if source.bundler is not None:
        return read_bundler(source.bundler, size_of, source.bundler_list)
    assert source.metashape is not None
    return read_metashape(source.metashape, crs_of(reference))

"""Table of orientation formats. Options of the command line and catalogs derive from it.

A format is a file of this folder with a function ``read(given) -> OrientationModel``, and its line here. Nothing is imported before it is read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from cityflow.errors import CatalogError

if TYPE_CHECKING:
    from cityflow.io.orientation.oriented_images import OrientationModel

Choice = TypeVar("Choice", bound=StrEnum)

SizeOf = Callable[[str], tuple[int, int] | None]
"""Width and height in pixels of an image by its name in the model; None where it cannot be read."""


@dataclass(frozen=True, slots=True)
class OrientationFile:
    """What a reader is given.

    Attributes
    ----------
    path : file or folder of the orientation
    options : option of the format (``angle_unit``) → text as it was typed; those that were not are missing
    size_of : for formats that do not state the size of images
    target : CRS of the catalog (`pyproj.CRS`), for formats that state one of their own; None for a local frame
    """

    path: Path
    options: Mapping[str, str]
    size_of: SizeOf
    target: Any = None


@dataclass(frozen=True, slots=True)
class Reader:
    """One format.

    Attributes
    ----------
    text : what ``--NAME`` names, for the help
    options : further options of the format → their help
    """

    text: str
    options: Mapping[str, str] = field(default_factory=dict)


CAMERAS = {"cameras": "Cameras of the orientation: JSON, YAML or CSV"}
ANGLES = {
    "angle_unit": "degree, grad or radian",
    "rotation_order": "omega-phi-kappa, phi-omega-kappa or yaw-pitch-roll",
}
MATRIX = {
    "matrix": "Rows of matrices are axes of the photograph in the world (photo-axes, the default), or the transpose (world-axes)"
}

READERS: Mapping[str, Reader] = {
    "colmap": Reader("folder of a COLMAP model, text or binary"),
    "opk": Reader(
        "table with centres and angles; needs --cameras",
        {
            **CAMERAS,
            "columns": "Columns of the table, field=name or field=position, e.g. name=0,x=1,y=2,z=3,omega=4,phi=5,kappa=6",
            **ANGLES,
        },
    ),
    "bundler": Reader(
        "bundle.out of Bundler", {"bundler_list": "List of Bundler's images, if not list.txt in the same folder"}
    ),
    "metashape": Reader("cameras of Metashape as XML"),
    "inpho": Reader(
        "Inpho's project (.prj)",
        {"lens_terms": "Lens coefficients are subtracted from measured coordinates (the default) or added", **MATRIX},
    ),
    "pix4d": Reader("folder 1_initial/params of Pix4Dmapper, or its …_calibrated_camera_parameters.txt"),
    "opensfm": Reader("reconstruction.json of OpenSfM or OpenDroneMap"),
    "bingo": Reader("itera.dat of BINGO; needs --cameras", {**CAMERAS, **ANGLES}),
    "patb": Reader("orientations of PATB with a matrix each; needs --cameras", {**CAMERAS, **MATRIX}),
    "isat": Reader(
        "photo file of ISAT (ImageStation), with its camera file beside or --cameras", {**CAMERAS, **ANGLES}
    ),
}


def table_of_formats(readers: Mapping[str, Reader] = READERS) -> str:
    """The formats as a table in Markdown, a row each."""
    rows = (
        f"| `--{_typed(name)}` | {reader.text} | {', '.join(f'`--{_typed(o)}`' for o in reader.options)} |"
        for name, reader in readers.items()
    )
    return "\n".join(["| option | what it names | further options |", "|---|---|---|", *rows])


def _typed(name: str) -> str:
    """
    >>> _typed("angle_unit")
    'angle-unit'
    """
    return name.replace("_", "-")


def option(name: str) -> str:
    """As it is typed.

    >>> option("angle_unit")
    '--angle-unit'
    """
    return f"--{name.replace('_', '-')}"


def read_orientation(name: str, given: OrientationFile) -> OrientationModel:
    """The model in a file of the format `name`; raises CatalogError where it cannot be read."""
    model: OrientationModel = import_module(f"cityflow.io.orientation.{name}").read(given)
    return model


def choice(kind: type[Choice], options: Mapping[str, str], name: str, default: Choice) -> Choice:
    """The value of the option `name`; raises CatalogError where it is none of the choices."""
    text = options.get(name, default)
    try:
        return kind(text.lower())
    except ValueError as error:
        raise CatalogError(f"{text!r} is not known", where=option(name), remedy=f"one of {', '.join(kind)}") from error

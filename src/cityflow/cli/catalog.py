"""Commands that make catalogs, and check them."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from cityflow.cli import options
from cityflow.cli.options import CatalogWorkersOption, OutsideOption, SchedulerOption
from cityflow.io.orientation.readers import READERS, option
from cityflow.runs.first_look import (
    look_at_catalog,
)


class FilesUnquoted(TyperCommand):
    """``--lidar *.laz`` without quotes: the shell writes one file after the other, each of which is a value of the option before it."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        told: list[str] = []
        option, suffix = "", ""
        for k, arg in enumerate(args):
            if arg.startswith("-"):
                option = ""
            elif k and args[k - 1] in ("--lidar", "--ortho"):
                option, suffix = args[k - 1], Path(arg).suffix.lower()
            elif option and suffix and Path(arg).suffix.lower() == suffix:
                told.append(option)
            told.append(arg)
        return super().parse_args(ctx, told)


def orientation_options(command: Callable[..., None]) -> Callable[..., None]:
    """An option for every format of `READERS` and for what a format asks beside; the command gets those that were typed as a mapping `orientation`."""
    helps = {o: t for n, r in READERS.items() for o, t in ((n, f"Orientation: {r.text}"), *r.options.items())}

    @wraps(command)
    def told(**values: Any) -> None:
        typed = {name: values.pop(name) for name in helps}
        command(**values, orientation={name: text for name, text in typed.items() if text is not None})

    own = [
        Parameter(
            n,
            Parameter.KEYWORD_ONLY,
            default=None,
            annotation=Annotated[str | None, typer.Option(option(n), help=t, metavar="FILE" if n in READERS else None)],
        )
        for n, t in helps.items()
    ]
    others = [
        p.replace(kind=Parameter.KEYWORD_ONLY)
        for p in signature(command, eval_str=True).parameters.values()
        if p.name != "orientation"
    ]
    place = [p.name for p in others].index("images") + 1
    every = [*others[:place], *own, *others[place:]]
    told.__signature__ = Signature(every)  # type: ignore[attr-defined]
    told.__annotations__ = {p.name: p.annotation for p in every}
    return told


@orientation_options
def catalog_create(
    orientation: Mapping[str, str],
    out: Annotated[Path, typer.Argument(help="Folder for the catalog")],
    lidar: Annotated[list[str] | None, typer.Option(help="LAS/LAZ files, globs of them; repeatable")] = None,
    images: Annotated[Path | None, typer.Option(help="Folder of oriented images")] = None,
    origin: Annotated[
        str, typer.Option(metavar="X,Y,Z", help="Added to the coordinates of the orientation, metres")
    ] = "",
    heights: Annotated[
        str,
        typer.Option(
            metavar="MIN,MAX", help="Lowest ground and highest object, metres; needed without tie points, DSM or DTM"
        ),
    ] = "",
    gains: Annotated[
        bool, typer.Option("--gains/--no-gains", help="Balance the exposures of the images; decodes each image once")
    ] = True,
    crs: Annotated[
        str,
        typer.Option(
            help="EPSG:n (a compound code includes the heights), 'local' for a metric frame, empty: the files' own"
        ),
    ] = "",
    outlines: Annotated[Path | None, typer.Option(help="Building outlines in any format that GDAL reads")] = None,
    layer: Annotated[str, typer.Option(help="Layer of the outlines' file, where it has several")] = "",
    id_column: Annotated[str, typer.Option(help="Column of building ids in the outlines")] = "",
    id_format: Annotated[str, typer.Option(help="Format of ids, e.g. {:016d}")] = "",
    dsm: Annotated[Path | None, typer.Option(help="A DSM raster, heights in metres")] = None,
    dtm: Annotated[Path | None, typer.Option(help="A DTM raster, used instead of an estimated one")] = None,
    ortho: Annotated[list[Path] | None, typer.Option(help="An orthophoto; repeatable, one for each epoch")] = None,
    title: Annotated[str, typer.Option(help="Name of the survey")] = "",
    date: Annotated[str, typer.Option(help="Date of the survey, YYYY-MM-DD, if the files have none")] = "",
    licence: Annotated[str, typer.Option(help="SPDX name of the data's licence")] = "",
    attribution: Annotated[str, typer.Option(help="Attribution text of the data")] = "",
    copy: Annotated[bool, typer.Option("--copy", help="Copy the files into the catalog's folder")] = False,
    scheduler: SchedulerOption = "",
    workers: CatalogWorkersOption = 0,
) -> None:
    """Make a catalog from files. Headers, digests and colours of files are read by Dask tasks; what was read is kept for the next time."""
    from cityflow.catalog.create import SurveyFiles, SurveyText, create_catalog
    from cityflow.catalog.orientation import image_source
    from cityflow.workflow.catalog_reading import reading_files

    # workers elsewhere stand in another folder
    here = _absolute if scheduler else _as_typed
    folder = Path(here(str(images))) if images is not None else None
    with reading_files(scheduler, workers, options.console, kept_beside=out) as reading:
        made = create_catalog(
            out,
            SurveyFiles(
                lidar=[here(p) for p in lidar or []],
                images=image_source(folder, orientation, origin, heights, gains),
                outlines=outlines and here(str(outlines)),
                dsm=dsm and here(str(dsm)),
                dtm=dtm and here(str(dtm)),
                orthos=[here(str(p)) for p in ortho or ()],
                id_column=id_column or None,
                id_format=id_format or None,
                layer=layer or None,
            ),
            crs=crs or None,
            copy=copy,
            reading=reading,
            text=SurveyText(title=title, licence=licence, attribution=attribution, date=date),
        )
    for note in made.notes:
        options.console.print(f"Note: {note}", markup=False, highlight=False, soft_wrap=True)
    options.console.print(
        f"Catalog written to {out}. Next: cityflow catalog check {shlex.quote(str(out))}", markup=False, soft_wrap=True
    )


def _absolute(path: str) -> str:
    return path if "://" in path else os.path.abspath(path)


def _as_typed(path: str) -> str:
    return path


def catalog_check(
    catalog: Annotated[str, typer.Argument(help="Catalog folder or URL")],
    maps: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder for coverage maps: GeoTIFF, GeoPackage, HTML"),
    ] = None,
    allow_outside: OutsideOption = False,
    scheduler: SchedulerOption = "",
    workers: CatalogWorkersOption = 0,
) -> None:
    """Check a catalog: missing or contradictory data, and for images coverage and expected quality."""
    look_at_catalog(catalog)
    from cityflow.catalog.check import check_catalog
    from cityflow.workflow.catalog_reading import reading_files

    with reading_files(scheduler, workers, options.console) as reading:
        result = check_catalog(catalog, maps, allow_outside=allow_outside, reading=reading)
    options.console.print(result.text(), markup=False, highlight=False, soft_wrap=True)
    if result.has_errors:
        raise typer.Exit(1)

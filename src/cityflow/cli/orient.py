"""The command that refines the poses of a catalog's images, or finds those of photographs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cityflow.cli import options
from cityflow.cli.options import OutsideOption, SchedulerOption, WorkersOption
from cityflow.errors import CityflowError
from cityflow.runs.first_look import is_photo_folder, is_video_file, look_at_catalog

PHOTOS_CITY, LIDAR_PHOTOS_CITY = "workflows/photos_city.yaml", "workflows/lidar_photos_city.yaml"


def orient(
    catalog: Annotated[
        str,
        typer.Argument(
            metavar="CATALOG|PHOTOS|VIDEO",
            help="Catalog folder or URL with oriented images, a folder of photographs, or the file of a video",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the new catalog")],
    work: Annotated[
        Path | None,
        typer.Option(help="Folder for features, ties and records, kept for the next time; default: OUT-orient"),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Set a parameter, e.g. bound_px=40 (docs/orient.md); repeatable"
        ),
    ] = None,
    control: Annotated[
        Path | None,
        typer.Option(
            help="Control and check points with their marks: our CSV, gcp_list.txt, Metashape, Pix4D (docs/control_points.md)"
        ),
    ] = None,
    marks: Annotated[
        Path | None, typer.Option(help="Marks of the control points, if they are in a separate file (Pix4D)")
    ] = None,
    control_crs: Annotated[
        str, typer.Option(help="Catalog: CRS of the control points, if their file states none, e.g. EPSG:25832+7837")
    ] = "",
    onto: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FILES|CATALOG",
            help="Survey that the images are registered to: LAS or LAZ files, a folder of them, a DSM, outlines, or a catalog with any of them; repeatable",
        ),
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option(
            min=0.01,
            help="Photographs: median height above ground, metres, if there are neither GNSS positions nor control points",
        ),
    ] = None,
    local: Annotated[
        bool, typer.Option("--local", help="Photographs: continue in a local frame of unknown scale")
    ] = False,
    sequence: Annotated[
        bool,
        typer.Option(
            "--sequence", help="Photographs: a sequence in the order of their names; frames are chosen as in a video"
        ),
    ] = False,
    crs: Annotated[
        str,
        typer.Option(
            help="Photographs: CRS of the catalog, EPSG:n or 'local'; empty: that of the control points, UTM for GNSS positions"
        ),
    ] = "",
    lever_arm: Annotated[
        str,
        typer.Option(
            metavar="X,Y,Z",
            help="Photographs of one camera: its projection centre to the antenna, metres right, down and ahead in the picture; empty: found where significant",
        ),
    ] = "",
    title: Annotated[
        str, typer.Option(help="Photographs: name of the survey; empty: that of the catalog's folder")
    ] = "",
    attribution: Annotated[str, typer.Option(help="Photographs: attribution text, shown where they are")] = "",
    city: Annotated[
        str, typer.Option("--city", metavar="RUN", help="Photographs: then make the city in this folder, as `run` does")
    ] = "",
    workflow: Annotated[
        Path | None,
        typer.Option(help="Of that run; default: workflows/photos_city.yaml, with --onto lidar_photos_city.yaml"),
    ] = None,
    allow_outside: OutsideOption = False,
    scheduler: SchedulerOption = "",
    workers: WorkersOption = 0,
) -> None:
    """Refine the poses of oriented images where that is significant, or find those of photographs; register either to a survey. The result is a catalog."""
    folder = work or out.absolute().with_name(f"{out.absolute().name}-orient")
    photographs = is_photo_folder(catalog) or is_video_file(catalog)
    if onto and control is not None:
        remedy = "give one of them"
        raise CityflowError("--onto and --control both say where the images are", where="--onto", remedy=remedy)
    if not photographs:
        look_at_catalog(catalog)
        if scale or local or crs or lever_arm or title or attribution or city or workflow or sequence:
            remedy = "leave it out, or name a folder of photographs"
            raise CityflowError("this option is for photographs without poses", where=catalog, remedy=remedy)
    from cityflow.runs.orientation_asked import OrientationAsked
    from cityflow.workflow.orientation_run import run_orientation

    given = (*(settings or []), *(["sequence=true"] if sequence else []))
    asked = OrientationAsked(
        catalog if "://" in catalog else str(Path(catalog).absolute()), str(out.absolute()), photographs, given,
        _absolute(control), _absolute(marks), control_crs, scale, local, crs, allow_outside, lever_arm,
        tuple(n if "://" in n else str(Path(n).absolute()) for n in onto or ()), title=title, attribution=attribution,
    )  # fmt: skip
    run_orientation(asked, folder, scheduler, workers, options.console)
    if city:
        from cityflow.runs.project_files import project_file
        from cityflow.runs.request import Request
        from cityflow.workflow.run import run_workflow

        file = workflow or project_file(LIDAR_PHOTOS_CITY if onto else PHOTOS_CITY)
        run_workflow(Request(file, str(out), city), scheduler, workers, options.console)


def _absolute(path: Path | None) -> str:
    return str(path.absolute()) if path is not None else ""

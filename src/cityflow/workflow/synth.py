"""``cityflow synth``: a made survey with its truth beside it, ready to be run."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pydantic import ValidationError
from rich.console import Console

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Status
from cityflow.core.camera import OrientedImage
from cityflow.core.parameters import merged
from cityflow.errors import RunError, WorkflowError
from cityflow.flow.cluster import connect
from cityflow.flow.executor import run_tasks
from cityflow.flow.ledger import Ledger
from cityflow.flow.progress import watcher
from cityflow.flow.store import Store
from cityflow.io.colmap import write_colmap
from cityflow.io.outlines_gpkg import Layer, write_geopackage
from cityflow.io.reference import resolve
from cityflow.stages.catalog_create import create_catalog
from cityflow.stages.catalog_orientation import ImageSource
from cityflow.stages.synth import SynthParameters, SynthSource, made_town, picture_path
from cityflow.synthetic.flight_presets import PRESETS
from cityflow.synthetic.pose_noise import with_pose_noise
from cityflow.synthetic.town import Town
from cityflow.synthetic.town_lidar import TownLidarParameters
from cityflow.synthetic.town_truth import town_truth
from cityflow.workflow.settings import explain_invalid, parse_setting

NO_FLIGHT = "none"
TIE_STEP_M = 8.0
TITLE = "Made town {}"
LICENCE = "CC0-1.0"


def synth_parameters(seed: int, size: str, flight: str, lidar: float, settings: Sequence[str]) -> SynthParameters:
    """The parameters of a made survey from the options of the command.

    Raises
    ------
    WorkflowError
        The size is not two numbers, no flight has this name, a key is unknown or a value does not fit.
    """
    tree: dict[str, Any] = {"seed": seed, "size": _size(size), "flight": _flight(flight)}
    if lidar > 0:
        tree["lidar"] = TownLidarParameters(density_m2=lidar).model_dump()
    for setting in settings:
        tree = merged(tree, parse_setting(setting))
    try:
        return SynthParameters.model_validate(tree)
    except ValidationError as error:
        raise WorkflowError(explain_invalid(error), where="synth", remedy="see docs/synthetic_town.md") from None


def _size(text: str) -> tuple[float, float]:
    parts = text.lower().split("x")
    try:
        width, height = (float(p) for p in (parts * 2 if len(parts) == 1 else parts))
    except ValueError:
        raise WorkflowError(f"'{text}' is no size", where="--size", remedy="write it as 250x200 (metres)") from None
    return width, height


def _flight(name: str) -> dict[str, Any] | None:
    if name == NO_FLIGHT:
        return None
    if name not in PRESETS:
        raise WorkflowError(
            f"no flight '{name}'", where="--flight", remedy=f"one of {', '.join([*PRESETS, NO_FLIGHT])}"
        )
    return PRESETS[name].model_dump()


def make_survey(
    out: Path,
    parameters: SynthParameters,
    pose_noise: tuple[float, float],
    scheduler: str,
    workers: int,
    console: Console,
) -> None:
    """Make pictures, scans and truth in the folder `out`, then its catalog; what is there already is kept.

    Parameters
    ----------
    pose_noise : standard deviations of what the catalog's poses are off: metres per axis, degrees about each

    Raises
    ------
    RunError
        Something could not be made.
    """
    store, source = Store.open(out), SynthSource(parameters)
    store.check_writable()
    with connect(scheduler or None, workers or os.cpu_count() or 1) as client, Ledger.open(store) as ledger:
        with closing(watcher()) as progress:
            progress.message(f"Dashboard: {client.dashboard_link}")
            summary = run_tasks(source, client, store, ledger, progress=progress)
        if summary.interrupted:
            raise KeyboardInterrupt
        failed = [
            task.name
            for task in source.initial()
            if (r := ledger.latest(task.stage, task.unit)) is None or r.status is Status.FAILED
        ]
    if failed:
        raise RunError(
            f"{len(failed)} files could not be made, the first is {failed[0]}",
            where=str(out),
            remedy=f"cityflow explain {out} {failed[0].split('-', 1)[1]}",
        )
    for note in _describe(out, source, pose_noise):
        console.print(f"Note: {note}", markup=False, highlight=False, soft_wrap=True)
    kind = "oblique" if source.images else "lidar"
    console.print(
        f"Made: {len(source.images)} images in {out}. Next: cityflow run workflows/{kind}_city.yaml --catalog {out / 'catalog'} --out RUN",
        markup=False,
        soft_wrap=True,
    )


def _describe(out: Path, source: SynthSource, pose_noise: tuple[float, float]) -> tuple[str, ...]:
    """Poses, outlines, truth layers and the catalog: small files, written by the driver."""
    p = source.parameters
    town = made_town(p)
    _write_layers(out, town, p)
    images: ImageSource | None = None
    if p.flight is not None:
        bits = p.render.sensor.bits == 8 and not p.render.near_infrared
        files = [(i, Path(picture_path(i.name, bits)).name) for i in source.images]
        noisy = with_pose_noise([i for i, _ in files], pose_noise[0], float(np.radians(pose_noise[1])), p.seed)
        origin = (p.area[0], p.area[1], 0.0)
        for folder, poses in (("orientation", noisy), ("truth/orientation", source.images)):
            named = [_renamed(pose, file) for pose, (_, file) in zip(poses, files, strict=True)]
            write_colmap(out / folder, named, _tie_points(town, p), origin)
        images = ImageSource(out / "images", colmap=out / "orientation", origin=origin)
    scans = [str(out / "lidar")] if p.lidar is not None else []
    made = create_catalog(
        out / "catalog", lidar=scans, images=images, outlines=out / "outlines.gpkg", crs=p.crs, id_column="id", layer="outlines",
        title=TITLE.format(p.seed), licence=LICENCE, attribution="made by cityflow synth", date="2026-06-21",
    )  # fmt: skip
    return made.notes


def _write_layers(out: Path, town: Town, p: SynthParameters) -> None:
    """Given outlines as a surveyor would hand them over, blocks for splitting, and all that is known as truth."""
    reference = resolve(p.crs)
    layers = {
        name: Layer(name, [g for g, _ in rows], [dict(r) for _, r in rows]) for name, rows in town_truth(town).items()
    }
    inside = shapely.box(*p.area)
    kept = [k for k, g in enumerate(layers["units"].geometries) if g is not None and inside.contains(g)]
    outlines = Layer(
        "outlines", [layers["units"].geometries[k] for k in kept], [{"id": layers["units"].rows[k]["id"]} for k in kept]
    )
    out.mkdir(parents=True, exist_ok=True)
    (out / "truth").mkdir(exist_ok=True)
    (out / "outlines.gpkg").write_bytes(write_geopackage([outlines], reference))
    (out / "blocks.gpkg").write_bytes(write_geopackage([layers["blocks"]], reference))
    (out / "truth" / "town.gpkg").write_bytes(write_geopackage(layers.values(), reference))


def _tie_points(town: Town, p: SynthParameters) -> FloatArray:
    """(N, 3) points on the ground and on roofs, as an aerotriangulation would leave them: thin, but everywhere."""
    x, y = (
        v.ravel()
        for v in np.meshgrid(*(np.arange(lo, hi, TIE_STEP_M) for lo, hi in zip(p.area[:2], p.area[2:], strict=True)))
    )
    ground = np.column_stack([x, y, town.dtm(x, y)])
    faces = [face for unit in town.units for face in unit.roof_planes]
    places = shapely.get_coordinates([face.polygon.representative_point() for face in faces])
    heights = [float(face.plane.z(px, py)) for face, (px, py) in zip(faces, places, strict=True)]
    return np.round(np.concatenate([ground, np.column_stack([places, heights])]), 3)


def _renamed(image: OrientedImage, file: str) -> OrientedImage:
    return replace(image, name=file)

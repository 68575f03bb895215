"""Stage ``texture``: the faces of one unit get their pixels from the images that see them (Frommholz 2017 §5)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Status
from cityflow.core.colour_image import ColourImage
from cityflow.core.grid import Bounds, Grid, bounds_meet, grown
from cityflow.core.pixels import ArrayPixels
from cityflow.core.texture import FaceKey
from cityflow.errors import CatalogError
from cityflow.flow.stage import Cost, Node, Stage
from cityflow.flow.store import Store
from cityflow.flow.task import Json, Outcome, Task, digest_of
from cityflow.flow.workspace import Workspace
from cityflow.handover.block import failed_block
from cityflow.handover.outline_lines import decode
from cityflow.handover.pieces import read_text
from cityflow.handover.rasters import given_colours
from cityflow.handover.texture_files import Rings, encode_unit
from cityflow.io.city_models.cityjson import read_feature
from cityflow.io.fetch import local_file
from cityflow.io.rasters.surface_zarr import read_layers
from cityflow.io.reference import resolve
from cityflow.reconstruction.party.party_walls import cut_party_walls
from cityflow.stages.ortho import image_of, shown_images
from cityflow.survey.city import City
from cityflow.survey.source import ZARR
from cityflow.survey.survey import Survey
from cityflow.survey.unit_entry import UnitEntry
from cityflow.texture.ortho_image import ortho_camera
from cityflow.texture.planes import face_planes
from cityflow.texture.unit import Surroundings, TextureParameters, texture_unit

NAME = "texture"
VERSION = 6
TEXTURE = "texture.cfa"
LONGEST_M = 60.0
"""From where a building is counted to where it ends, mostly."""
ORTHO_MARGIN_M = 8.0
"""The widest eaves and a little more."""


def parameters_of(survey: Survey, unit: UnitEntry) -> TextureParameters:
    """Those of the workflow, with what was asked for this unit alone; a patch is never larger than a page of the atlas."""
    asked = survey.parameters.texture
    if (NAME, unit.id) in survey.overrides:
        asked = TextureParameters.model_validate(survey.parameters_for(NAME, unit.id, asked))
    page_px = min(asked.placement.page_px, survey.parameters.atlas.placement.page_px)
    if asked.patches.largest_px <= page_px:
        return asked
    return asked.model_copy(update={"patches": asked.patches.model_copy(update={"largest_px": page_px})})


def hulls_around(survey: Survey, unit: UnitEntry, known: Sequence[UnitEntry]) -> list[str]:
    """Units whose models may stand between this one and a camera, or share a wall with it."""
    near = grown(unit.bounds, parameters_of(survey, unit).around_m)
    return sorted({u.id for u in known if u.id != unit.id and bounds_meet(u.bounds, near)} | set(unit.neighbours))


def tiles_around(survey: Survey, unit: UnitEntry) -> list[str]:
    """Tiles that may own such units: how the ground is cut must not tell which models stand around."""
    return survey.lattice.tiles_over(grown(unit.bounds, parameters_of(survey, unit).around_m + LONGEST_M))


def surfaces_around(survey: Survey, unit: UnitEntry) -> list[str]:
    """Tiles whose surface may stand between."""
    return survey.lattice.tiles_over(grown(unit.bounds, parameters_of(survey, unit).halo_m))


def images_of(survey: Survey, unit: UnitEntry) -> list[str]:
    """Images that have the unit in their frame."""
    if not survey.images.assets:
        return []
    return survey.images.showing(
        unit.bounds, survey.images.heights_over(unit.bounds), parameters_of(survey, unit).most_images
    )


def task(survey: Survey, unit: UnitEntry, around: Sequence[UnitEntry]) -> Task:
    """One unit, between the units `around` it; where a neighbour has failed, its block stands there, as in the export."""
    known = images_of(survey, unit)
    images = [n for n in known if survey.results.tiled_image(n) is not None]
    shown = shown_images(survey, images)
    blocks = {u.id: u for u in around if u.id in unit.neighbours and _is_block(survey, u.id)}
    tiles = sorted(
        {*surfaces_around(survey, unit), *(t for u in blocks.values() for t in survey.lattice.tiles_under(u))}
    )
    orthos = survey.given_orthos()
    hulls = {u: survey.results.hull(u) for u in sorted({unit.id, *(u.id for u in around)})}
    return Task(
        NAME, unit.id, "cityflow.stages.texture:run", VERSION,
        parameters=parameters_of(survey, unit).model_dump(mode="json"),
        inputs={
            **{f"hull {u}": survey.results.digest_of_hull(u) for u in hulls},
            **{f"surface {t}": survey.results.digest_of("surface", t) for t in tiles},
            "neighbours": digest_of([sorted(unit.neighbours), {u: e.digest for u, e in sorted(blocks.items())}]),
            "images": digest_of({n: survey.results.digest_of("ingest", n) if n in shown else "unread" for n in known}), "views": digest_of(shown),
            **{kind: r.checksum for kind, r in orthos.items()}, "grid": survey.lattice.place,
            # a survey of 8 bits is white at 255, whatever else is in the catalog
            **({"white": f"{survey.images.white:g}"} if survey.images.dtype != "uint8" else {}),
        },
        arguments={
            "hulls": {u: h["path"] for u, h in hulls.items() if h["path"] is not None}, "neighbours": list(unit.neighbours),
            "product_grid": list(survey.lattice.product_grid.bounds), "product_cell_m": survey.lattice.product_grid.cell,
            "images": shown, "pixels": {n: survey.results.tiled_image(n) for n in images},
            "given_orthos": [[k, r.href, r.cell] for k, r in orthos.items()], "crs": survey.catalog.reference.code,
            "blocks": {u: [e.path, e.start, e.length, survey.results.hull(u)["reason"]] for u, e in sorted(blocks.items())},
            "city": list(survey.lattice.grid.bounds), "cell_m": survey.lattice.cell_m, "zarr": survey.source.zarr,
            "unread": [n for n in known if survey.results.tiled_image(n) is None], "white": survey.images.white,
        },
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Patches of all faces that some image sees, plain colours for the others."""
    parameters = TextureParameters.model_validate(task.parameters)
    a, store = task.arguments, workspace.store
    buildings = {**_read(store, a["hulls"]), **_blocks(store, a)}
    own = buildings[task.unit]
    touching = [task.unit, *(n for n in a["neighbours"] if n in buildings)]
    solid = cut_party_walls({u: buildings[u].solids[Lod.LOD22] for u in touching})[task.unit]
    faces = face_planes(solid, own.beyond)
    shown, gone = _opened(workspace, task)
    images = [*shown, *_orthos(a, own.footprint.bounds, own.ground_height, gone)]
    around = Surroundings(
        [solid, *([] if own.beyond is None else [own.beyond])],
        [s for u, b in buildings.items() if u != task.unit for s in _shells(b)],
        *_heights(store, a, grown(own.footprint.bounds, parameters.halo_m)),
    )
    made = texture_unit(faces, images, around, parameters)
    rings: dict[FaceKey, Rings] = {f.key: tuple(tuple(map(tuple, r.tolist())) for r in f.rings) for f in faces}
    workspace.write(TEXTURE, encode_unit(made.texture, rings, parameters.placement))
    return workspace.outcome(
        *_status([*a["unread"], *gone, *made.lost]),
        {**made.figures, "notes": dict(made.notes), "lost": {**gone, **made.lost}},
    )


def _opened(workspace: Workspace, task: Task) -> tuple[list[ColourImage], dict[str, str]]:
    """The images of a task, and why others cannot be opened: they were there when the task was made."""
    found, gone, white = [], {}, float(task.arguments["white"])
    for name in task.arguments["images"]:
        try:
            found.append(replace(image_of(workspace, task, name), white=white))
        except CatalogError as error:
            gone[name] = error.problem
        except OSError as error:
            gone[name] = str(error.strerror or error)
    return found, gone


def _status(unread: Sequence[str]) -> tuple[Status, str]:
    """A unit without some of its images says so."""
    if not unread:
        return Status.DONE, ""
    return Status.DEGRADED, f"without the images {', '.join(sorted(unread))}, which could not be read"


def _read(store: Store, paths: Mapping[str, str]) -> dict[str, Building]:
    unit_of = {path: unit for unit, path in paths.items()}
    return {unit_of[path]: read_feature(data) for path, data in store.read_many(sorted(unit_of))}


def _is_block(survey: Survey, unit: str) -> bool:
    """Whether a unit was to become a building and has not."""
    hull = survey.results.hull(unit)
    return hull["path"] is None and hull["status"] != Status.REFUSED


def _blocks(store: Store, a: Mapping[str, Any]) -> dict[str, Building]:
    found = {}
    for unit, (path, start, length, reason) in a["blocks"].items():
        outline = decode(read_text(store, path)[start : start + length]).outline
        block = failed_block(store, a, outline, reason)
        if block is not None:
            found[unit] = block
    return found


def _shells(building: Building) -> Iterator[Polyhedron]:
    """The solid of LoD2.2, and what stands out beyond it."""
    yield building.solids[Lod.LOD22]
    if building.beyond is not None:
        yield building.beyond


def _heights(store: Store, a: Mapping[str, Json], bounds: Bounds) -> tuple[FloatArray, Grid]:
    whole = Grid.covering(tuple(a["product_grid"]), a["product_cell_m"])
    grid, layers = read_layers(store.zarr_store(ZARR), whole, bounds, ("dsm_filled",))
    return layers["dsm_filled"].astype(np.float64), grid


def _orthos(a: Mapping[str, Any], bounds: Bounds, ground: float, gone: dict[str, str]) -> list[ColourImage]:
    """Given orthos, as cameras very high up; one that ends within the unit has no colours to tell from missing ones, and is left out.

    In `gone` it is noted why others cannot be read.
    """
    found = []
    for kind, href, cell in a["given_orthos"]:
        grid = Grid.covering(grown(bounds, ORTHO_MARGIN_M), cell)
        try:
            with local_file(href) as path:
                colours = given_colours(path, grid, resolve(a["crs"]))
        except CatalogError as error:
            gone[kind] = error.problem
            continue
        if not _covers(colours, grid, bounds):
            continue
        pixels = np.clip(np.rint(np.nan_to_num(np.moveaxis(colours, 0, -1))), 0, 255).astype(np.uint8)
        found.append(ColourImage(ortho_camera(grid, kind, ground), ArrayPixels(pixels)))
    return found


def _covers(colours: FloatArray, grid: Grid, bounds: Bounds) -> bool:
    """Whether an ortho has a colour everywhere within `bounds`."""
    part = Grid.covering(bounds, grid.cell)
    return bool(np.isfinite(colours[(slice(None), *grid.slices(part))]).all())


def _around(city: City, unit: UnitEntry) -> list[str]:
    """Units near this one, whatever tiles they are in: these tiles' units are all known."""
    near = [u for t in tiles_around(city.survey, unit) for u in city.units_of.get(t, [])]
    return [u for u in hulls_around(city.survey, unit, near) if u in city.units]


def _models_surfaces_images(city: City, name: str) -> Iterable[Node]:
    """The models and surfaces that may stand between a unit and the cameras, and the images."""
    survey, unit = city.survey, city.units[name]
    return [
        *(("reconstruct", u) for u in (name, *_around(city, unit))),
        *(("surface", t) for t in surfaces_around(survey, unit)),
        *(("ingest", n) for n in images_of(survey, unit)),
    ]


def _task(city: City, name: str) -> Task | None:
    """None where there is no model to lay a texture on."""
    if not city.survey.results.hull(name)["path"]:
        return None
    unit = city.units[name]
    return task(city.survey, unit, [city.units[u] for u in _around(city, unit)])


STAGE = Stage(
    name=NAME,
    unit="building",
    text=(
        "hulls of the unit and of those around it, DSM, images that have it in their frame, given orthos → a patch for each face, raw and rectified, "
        "on an atlas of its own; of each texel, which image it is of"
    ),
    needs=(_models_surfaces_images,),
    task=_task,
    count=lambda city: city.count_units() if city.survey.textures else 0,
    parameters=(TextureParameters,),
    cost=Cost(3.0, 900.0, 2.0),
)

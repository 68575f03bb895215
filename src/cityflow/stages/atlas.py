"""Stage ``atlas``: the patches of the units of an atlas cell, a fixed square of a ground tile, on pages of its own."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Status
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, OUTSIDE, Patch, TexturePage
from cityflow.flow.stage import Cost, Node, Place, Stage
from cityflow.flow.task import Json, Outcome, Task
from cityflow.flow.task_kind import TaskKind
from cityflow.flow.typed import TaskInputs, as_json
from cityflow.flow.workspace import Workspace
from cityflow.handover.texture_files import ATLAS_CELL, PAGES, SETS, Rings, decode_unit
from cityflow.io.images.image_write import jpeg_bytes, png_bytes
from cityflow.survey.atlas_parameters import AtlasParameters
from cityflow.survey.city import City
from cityflow.survey.survey import Survey
from cityflow.survey.texture_inputs import atlas_cells_of
from cityflow.texture.pages import Page, corners_on_page, merged_names, pages_of, renumbered, uvd
from cityflow.texture.placement.place import Placement, place

NAME = "atlas"
VERSION = 2
MEDIA = {"jpeg": ("jpg", "image/jpeg"), "png": ("png", "image/png")}


@dataclass(frozen=True, slots=True)
class AtlasCellInputs(TaskInputs):
    """Unit → RUN-relative path of its texture, of the units of an atlas cell that have one."""

    textures: Mapping[str, str]


def task(survey: Survey, atlas_cell: str, units: Sequence[str]) -> Task | None:
    """Pages of the units of an atlas cell; None where none of them has a texture."""
    made = {u: survey.results.outputs_of("texture", u) for u in sorted(units)}
    files = {u: next(iter(outputs.items())) for u, outputs in made.items() if outputs}
    if not files:
        return None
    return KIND.task(
        atlas_cell, parameters=as_json(survey.parameters_of(NAME, atlas_cell, survey.parameters.atlas)),
        inputs={f"texture {u}": digest for u, (_, digest) in files.items()},
        given=AtlasCellInputs({u: path for u, (path, _) in files.items()}),
        limits=survey.limits(NAME),
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Place all patches anew, together, and write pages, what each texel came from, and where each face is.

    One set after the other, and a page at a time, so that memory holds the patches of one set and one page.
    """
    textures, parameters = task.arguments_as(AtlasCellInputs).textures, task.parameters_as(AtlasParameters)
    manifest: dict[str, Any] = {"plain": {}, "sets": {}}
    figures: dict[str, Json] = {"units": len(textures)}
    for number, name in enumerate(SETS):
        atlas_cell = _AtlasCell.read(workspace, textures, number)
        masks = [p.mask for _, p, _ in atlas_cell.patches]
        placement = place(masks, parameters.placement) if masks else Placement((), ())
        made = pages_of([p for _, p, _ in atlas_cell.patches], placement)
        pages = [_publish(workspace, task.unit, name, k, page, parameters) for k, page in enumerate(made)]
        manifest["sets"][name] = {"pages": [asdict(p) for p in pages], "faces": _faces(atlas_cell, placement)}
        figures[name] = {
            "pages": len(pages), "patches": len(masks), "pixels": int(sum(m.sum() for m in masks)),
            "page_pixels": int(sum(h * w for h, w in placement.pages)),
        }  # fmt: skip
        manifest |= {"images": list(atlas_cell.images), "plain": atlas_cell.plain}
    if any(manifest["sets"][name]["pages"] for name in SETS):
        numbered = {str(i): n for i, n in enumerate(manifest["images"], start=FIRST_IMAGE)}
        meaning = {str(OUTSIDE): "no texture", str(INTERPOLATED): "interpolated", **numbered}
        workspace.publish(f"{PAGES}/{task.unit}.images.json", _text(meaning))
    workspace.write(ATLAS_CELL, _text(manifest))
    return workspace.outcome(Status.DONE, "", figures)


@dataclass(frozen=True, slots=True, eq=False)
class _AtlasCell:
    """One set of an atlas cell's units.

    Attributes
    ----------
    images : names that the index rasters count
    patches : unit, patch, world rings of its face
    plain : unit → rings, colour and reason of its plain faces
    """

    images: tuple[str, ...]
    patches: list[tuple[str, Patch, Rings]]
    plain: dict[str, list[Any]]

    @classmethod
    def read(cls, workspace: Workspace, paths: Mapping[str, str], number: int) -> _AtlasCell:
        found: list[tuple[str, Patch, Rings, tuple[str, ...]]] = []
        plain, names = {}, []
        for unit, path in paths.items():
            texture, rings = decode_unit(workspace.read(path))
            names.append(texture.images)
            found += [(unit, p, rings[p.key], texture.images) for p in (texture.raw, texture.rectified)[number]]
            plain[unit] = [[rings[k], list(f.colour), f.reason] for k, f in sorted(texture.plain.items())]
        images = merged_names(names)
        place_of = {n: i for i, n in enumerate(images)}
        patches = [
            (unit, replace(p, index=renumbered(p.index, of_unit, place_of)), rings) for unit, p, rings, of_unit in found
        ]
        return cls(images, patches, plain)


def _publish(workspace: Workspace, atlas_cell: str, name: str, number: int, page: Page, parameters: AtlasParameters) -> TexturePage:  # fmt: skip
    """A page, and beside it the page that tells where each texel came from."""
    ending, media = MEDIA[parameters.form]
    pixels = without_black(page)
    jpeg = parameters.form == "jpeg"
    data = jpeg_bytes(pixels, parameters.quality, parameters.full_colour) if jpeg else png_bytes(pixels)
    path = workspace.publish(f"{PAGES}/{atlas_cell}.{name}.{number}.{ending}", data)
    workspace.publish(f"{PAGES}/{atlas_cell}.{name}.{number}.index.png", png_bytes(page.index[..., None]))
    return TexturePage(path, page.pixels.shape[1], page.pixels.shape[0], media)


def without_black(page: Page) -> NDArray[np.uint8]:
    """The pixels of a page with its mean colour where no patch is: nothing dark bleeds in at coarse levels of a mipmap, and JPEG has no hard edges."""
    free = page.owner == 0
    count = free.size - int(np.count_nonzero(free))
    if count:
        # what is free is black still, and adds nothing
        page.pixels[free] = np.rint(page.pixels.sum(axis=(0, 1), dtype=np.int64) / count).astype(np.uint8)
    return page.pixels


def _faces(atlas_cell: _AtlasCell, placement: Placement) -> list[dict[str, Any]]:
    rows = []
    for (unit, patch, rings), spot in zip(atlas_cell.patches, placement.spots, strict=True):
        size, (tall, wide) = placement.pages[spot.page], patch.mask.shape
        corners = [uvd(corners_on_page(c, (tall, wide), spot), size).tolist() for c in patch.corners]
        rows.append({"unit": unit, "page": spot.page, "rings": rings, "uvd": corners, "figures": asdict(patch.figures)})
    return rows


def _text(tree: Mapping[str, Any]) -> bytes:
    return json.dumps(tree, ensure_ascii=False, separators=(",", ":")).encode()


def _units_on(city: City, atlas_cell: str) -> list[str]:
    return atlas_cells_of(city, atlas_cell.rpartition(".")[0])[atlas_cell]


def _textures(city: City, atlas_cell: str) -> Iterable[Node]:
    return [("texture", u) for u in _units_on(city, atlas_cell)]


def _count(city: City) -> int | None:
    if not city.survey.textures:
        return 0
    known = all(t in city.units_of for t in city.tiles)
    return sum(len(atlas_cells_of(city, t)) for t in city.tiles) if known else None


KIND = TaskKind(NAME, VERSION, run, AtlasCellInputs, in_place=True)

STAGE = Stage(
    name=NAME,
    unit="atlas cell: a square of a ground tile",
    place=Place.ATLAS_CELL,
    text="patches of the units in it → pages shared by all formats",
    kinds=(KIND,),
    needs=(_textures,),
    task=lambda city, atlas_cell: task(city.survey, atlas_cell, _units_on(city, atlas_cell)),
    asked=lambda city, name: city.survey.textures and city.exports(name.rpartition(".")[0]),
    count=_count,
    parameters=(AtlasParameters,),
    cost=Cost(3.0, 900.0, 8.0),
)

"""Stage ``atlas``: the patches of the units of a leaf, a fixed square of a ground tile, on pages of its own."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Status
from cityflow.core.texture import FIRST_IMAGE, Patch, TexturePage, UnitTexture
from cityflow.flow.task import Json, Outcome, Task
from cityflow.flow.workspace import Workspace
from cityflow.io.image_write import jpeg_bytes, png_bytes
from cityflow.stages.atlas_parameters import AtlasParameters
from cityflow.stages.survey import Survey, UnitEntry
from cityflow.stages.texture_files import SETS, decode_unit
from cityflow.texture.pages import Page, corners_on_page, merged_names, pages_of, renumbered, uvd
from cityflow.texture.placement.place import Placement, place

STAGE = "atlas"
VERSION = 1
LEAF = "leaf.json"
FOLDER = "products/textures"
MEDIA = {"jpeg": ("jpg", "image/jpeg"), "png": ("png", "image/png")}


def leaf_of(survey: Survey, unit: UnitEntry) -> str:
    """Name of the leaf that a unit belongs to: tile, and column and row in it, south-west first."""
    n, (x, y) = survey.parameters.atlas.leaves(survey.parameters.tiles.tile_m), unit.point
    x_0, y_0, x_1, y_1 = survey.tiles[unit.tile].bounds
    col, row = int((x - x_0) / (x_1 - x_0) * n), int((y - y_0) / (y_1 - y_0) * n)
    return f"{unit.tile}.{min(max(col, 0), n - 1)}_{min(max(row, 0), n - 1)}"


def task(survey: Survey, leaf: str, units: Sequence[str]) -> Task | None:
    """Pages of the units of a leaf; None where none of them has a texture."""
    made = {u: survey.outputs_of("texture", u) for u in sorted(units)}
    files = {u: next(iter(outputs.items())) for u, outputs in made.items() if outputs}
    if not files:
        return None
    return Task(
        STAGE, leaf, "cityflow.stages.atlas:run", VERSION,
        parameters=survey.parameters_for(STAGE, leaf, survey.parameters.atlas),
        inputs={f"texture {u}": digest for u, (_, digest) in files.items()},
        arguments={"textures": {u: path for u, (path, _) in files.items()}},
        limits=survey.limits(STAGE),
        in_place=True,
    )  # fmt: skip


def run(workspace: Workspace, task: Task) -> Outcome:
    """Place all patches anew, together, and write pages, what each texel came from, and where each face is."""
    parameters = AtlasParameters.model_validate(task.parameters)
    units = {u: decode_unit(workspace.read(path)) for u, path in task.arguments["textures"].items()}
    names = merged_names(t.images for t, _ in units.values())
    manifest: dict[str, Any] = {"images": list(names), "plain": {}, "sets": {}}
    figures: dict[str, Json] = {"units": len(units)}
    for number, name in enumerate(SETS):
        patches = [(u, p) for u, (t, _) in units.items() for p in _patches(t, number, names)]
        placement = place([p.mask for _, p in patches], parameters.placement) if patches else Placement((), ())
        pages = [_publish(workspace, task.unit, name, k, page, parameters) for k, page in enumerate(pages_of([p for _, p in patches], placement))]  # fmt: skip
        manifest["sets"][name] = {"pages": [asdict(p) for p in pages], "faces": _faces(patches, placement, units)}
        figures[name] = {"pages": len(pages), "patches": len(patches), "pixels": int(sum(p.mask.sum() for _, p in patches)),
                         "page_pixels": int(sum(h * w for h, w in placement.pages))}  # fmt: skip
    for unit, (texture, rings) in units.items():
        manifest["plain"][unit] = [[rings[k], list(f.colour), f.reason] for k, f in sorted(texture.plain.items())]
    if any(manifest["sets"][name]["pages"] for name in SETS):
        meaning = {
            "0": "no texture",
            "1": "interpolated",
            **{str(i): n for i, n in enumerate(names, start=FIRST_IMAGE)},
        }
        workspace.publish(f"{FOLDER}/{task.unit}.images.json", _text(meaning))
    workspace.write(LEAF, _text(manifest))
    return workspace.outcome(Status.DONE, "", figures)


def _patches(texture: UnitTexture, number: int, names: Sequence[str]) -> Iterable[Patch]:
    """A unit's patches of a set, their indices counting the leaf's images."""
    place_of = {n: i for i, n in enumerate(names)}
    for p in (texture.raw, texture.rectified)[number]:
        yield Patch(p.key, p.pixels, renumbered(p.index, texture.images, place_of), p.mask, p.corners, p.figures)


def _publish(workspace: Workspace, leaf: str, name: str, number: int, page: Page, parameters: AtlasParameters) -> TexturePage:  # fmt: skip
    """A page, and beside it the page that tells where each texel came from."""
    ending, media = MEDIA[parameters.form]
    pixels = without_black(page)
    data = jpeg_bytes(pixels, parameters.quality) if parameters.form == "jpeg" else png_bytes(pixels)
    path = workspace.publish(f"{FOLDER}/{leaf}.{name}.{number}.{ending}", data)
    workspace.publish(f"{FOLDER}/{leaf}.{name}.{number}.index.png", png_bytes(page.index[..., None]))
    return TexturePage(path, page.pixels.shape[1], page.pixels.shape[0], media)


def without_black(page: Page) -> NDArray[np.uint8]:
    """The pixels of a page with its mean colour where no patch is: nothing dark bleeds in at coarse levels of a mipmap, and JPEG has no hard edges."""
    used = page.owner > 0
    if not used.any():
        return page.pixels
    mean = np.rint(page.pixels[used].mean(axis=0)).astype(np.uint8)
    return np.where(used[..., None], page.pixels, mean)


def _faces(patches: Sequence[tuple[str, Patch]], placement: Placement, units: Mapping[str, Any]) -> list[dict[str, Any]]:  # fmt: skip
    rows = []
    for (unit, patch), spot in zip(patches, placement.spots, strict=True):
        size = placement.pages[spot.page]
        corners = [uvd(corners_on_page(c, patch.mask.shape, spot), size).tolist() for c in patch.corners]
        rows.append({"unit": unit, "page": spot.page, "rings": units[unit][1][patch.key], "uvd": corners, "figures": asdict(patch.figures)})  # fmt: skip
    return rows


def _text(tree: Mapping[str, Any]) -> bytes:
    return json.dumps(tree, ensure_ascii=False, separators=(",", ":")).encode()

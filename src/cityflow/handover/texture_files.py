"""Results of texture and atlas tasks as files: patches on pages, and the position of each face."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cityflow.core.building import Building, Lod
from cityflow.core.texture import FaceFigures, FaceKey, Patch, PlainFace, UnitTexture
from cityflow.handover.array_file import decode_arrays, encode_arrays
from cityflow.texture.pages import Page, pages_of, trimmed
from cityflow.texture.placement.place import Placement, PlacementParameters, Spot, place
from cityflow.texture.planes import face_planes

SETS = ("raw", "rectified")
PAGES = "products/textures"
"""Where pages are written."""
ATLAS_CELL = "atlas_cell.json"
"""What an atlas task leaves of its atlas cell."""
Rings = tuple[tuple[tuple[float, float, float], ...], ...]
"""World vertices of a face's rings: what a face is known by, whoever has numbered it."""


def encode_unit(texture: UnitTexture, rings: Mapping[FaceKey, Rings], parameters: PlacementParameters) -> bytes:
    """A unit's patches on atlases of its own, one for each set, with all that is known of them."""
    arrays: dict[str, NDArray[Any]] = {}
    attributes: dict[str, Any] = {
        "images": list(texture.images),
        "plain": [[*key, _world(rings[key]), list(f.colour), f.reason] for key, f in sorted(texture.plain.items())],
    }
    for name, patches in zip(SETS, (texture.raw, texture.rectified), strict=True):
        placement = place([p.mask for p in patches], parameters) if patches else Placement((), ())
        pages = [trimmed(p) for p in pages_of(patches, placement)]
        for number, page in enumerate(pages):
            arrays[f"{name} {number} pixels"] = page.pixels
            arrays[f"{name} {number} index"] = page.index
            arrays[f"{name} {number} owner"] = page.owner
        attributes[name] = {
            "pages": len(pages),
            "patches": [
                {
                    "key": list(p.key), "rings": _world(rings[p.key]), "corners": [c.tolist() for c in p.corners], "shape": list(p.mask.shape),
                    "spot": [s.page, s.row, s.col, s.quarter_turns], "figures": asdict(p.figures),
                }
                for p, s in zip(patches, placement.spots, strict=True)
            ],
        }  # fmt: skip
    return encode_arrays(arrays, attributes)


def decode_unit(data: bytes) -> tuple[UnitTexture, dict[FaceKey, Rings]]:
    """What `encode_unit` wrote."""
    arrays, attributes = decode_arrays(data)
    rings: dict[FaceKey, Rings] = {}
    sets = []
    for name in SETS:
        pages = [Page(*(arrays[f"{name} {n} {part}"] for part in ("pixels", "index", "owner"))) for n in range(attributes[name]["pages"])]  # fmt: skip
        sets.append(tuple(_patch(n, tree, pages) for n, tree in enumerate(attributes[name]["patches"], start=1)))
        rings.update({_key(tree["key"]): rings_of(tree["rings"]) for tree in attributes[name]["patches"]})
    plain = {_key((shell, face)): PlainFace((c[0], c[1], c[2]), why) for shell, face, _, c, why in attributes["plain"]}
    rings.update({_key((shell, face)): rings_of(world) for shell, face, world, _, _ in attributes["plain"]})
    return UnitTexture(tuple(attributes["images"]), sets[0], sets[1], plain), rings


def _patch(number: int, tree: Mapping[str, Any], pages: Sequence[Page]) -> Patch:
    """A patch cut out of its unit's atlas, turned back."""
    spot = Spot(*tree["spot"])
    rows, cols = tree["shape"] if spot.quarter_turns % 2 == 0 else tree["shape"][::-1]
    page, window = pages[spot.page], np.s_[spot.row : spot.row + rows, spot.col : spot.col + cols]
    turns = -spot.quarter_turns
    mask = np.rot90(page.owner[window], turns) == number
    index = np.where(mask, np.rot90(page.index[window], turns), 0).astype(np.uint16)
    corners = tuple(np.array(c, np.float64).reshape(-1, 3) for c in tree["corners"])
    return Patch(
        _key(tree["key"]),
        np.rot90(page.pixels[window], turns),
        index,
        mask,
        corners,
        FaceFigures(**tree["figures"]),
    )


def _key(tree: Sequence[Any]) -> FaceKey:
    return tree[0], int(tree[1])


def _world(rings: Rings) -> list[list[list[float]]]:
    return [[list(p) for p in ring] for ring in rings]


def faces_of(building: Building) -> dict[Rings, FaceKey]:
    """The faces of a building that can have a texture, by the world vertices of their rings."""
    faces = face_planes(building.solids[Lod.LOD22], building.beyond)
    return {rings_of([ring.tolist() for ring in face.rings]): face.key for face in faces}


def rings_of(tree: Sequence[Sequence[Sequence[float]]]) -> Rings:
    return tuple(tuple((p[0], p[1], p[2]) for p in ring) for ring in tree)

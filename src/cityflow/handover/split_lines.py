"""The splitting of an outline as JSON: coordinates are exact."""

from __future__ import annotations

import json
from math import nan
from typing import Any

import shapely
from shapely import LineString

from cityflow.core.building import Direction
from cityflow.core.json_values import finite
from cityflow.core.splitting import CutLine, Splitting
from cityflow.flow.task import Json

_FIGURES = ("vertical", "sloped", "height_step_m", "gap_m", "confidence", "angle_sigma_deg")


def encode_splitting(splitting: Splitting) -> bytes:
    """One line of UTF-8 text."""
    tree: dict[str, Json] = {
        "units": [shapely.geometry.mapping(u) for u in splitting.units],
        "cut_lines": [_cut_tree(c) for c in splitting.cut_lines],
        "rejected": [_cut_tree(c) for c in splitting.rejected],
        "aspects": [[d.degrees, d.sigma, d.weight] for d in splitting.aspects],
        "slopes": [[d.degrees, d.sigma, d.weight] for d in splitting.slopes],
        "reason": splitting.reason,
        "notes": [list(note) for note in splitting.notes],
    }
    return (json.dumps(tree, ensure_ascii=False, separators=(",", ":")) + "\n").encode()


def decode_splitting(text: bytes) -> Splitting:
    tree = json.loads(text)
    return Splitting(
        tuple(shapely.geometry.shape(u) for u in tree["units"]),
        tuple(map(_cut, tree["cut_lines"])),
        tuple(map(_cut, tree["rejected"])),
        tuple(Direction(*d) for d in tree["aspects"]),
        tuple(Direction(*d) for d in tree["slopes"]),
        tree["reason"],
        tuple((str(name), float(value)) for name, value in tree["notes"]),
    )


def _cut_tree(cut: CutLine) -> dict[str, Json]:
    figures = {name: float(getattr(cut, name)) for name in _FIGURES}
    return {"line": shapely.get_coordinates(cut.line).tolist(), "kind": cut.kind, **finite(figures)}


def _cut(tree: dict[str, Any]) -> CutLine:
    figures = {name: nan if tree[name] is None else float(tree[name]) for name in _FIGURES}
    return CutLine(LineString(tree["line"]), tree["kind"], **figures)


def read_splits(text: bytes) -> list[tuple[str, Splitting]]:
    """Id of the outline, and how it was split."""
    rows = (line.split(b"\t", 1) for line in text.splitlines())
    return [(json.loads(name), decode_splitting(tree)) for name, tree in rows]

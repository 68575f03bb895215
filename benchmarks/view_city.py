"""A city for benchmarks of the view: the textured town of a run, repeated by the project's own writers."""

from __future__ import annotations

import json
import math
import os
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from cityflow.core.building import Building, Polyhedron
from cityflow.core.coarse import Coarse
from cityflow.core.texture import TexturePage, TextureSet
from cityflow.flow.store import Store
from cityflow.handover.texture_files import ATLAS_CELL
from cityflow.io.city_models.cityjson import Transform, read_feature
from cityflow.io.city_models.coarse_merge import for_above
from cityflow.io.city_models.coarse_scene import coarse_of
from cityflow.io.city_models.tiles3d import FOLDER, PORTABLE, RAW, About, Scene, tile_files
from cityflow.io.city_models.tiles3d_tree import TileRoot, tree_over
from cityflow.io.crs import resolve
from cityflow.io.globe import globe_of
from cityflow.io.globe_frame import frame_at
from cityflow.reporting.view_frame import PageFrame
from cityflow.reporting.view_units import FIELDS, ends_of, id_parts
from cityflow.stages.export.far_contents import FarContents
from cityflow.stages.export.textured_faces import texture_sets
from cityflow.viewer.view_page import page_files

GAP_M = 20.0
CRS = "EPSG:7415"


class _Files:
    """What `texture_sets` asks of a workspace: to read."""

    def __init__(self, run: Path) -> None:
        self.store = Store.open(run)

    def read(self, path: str) -> bytes:
        return self.store.read_bytes(path)


def town_of(run: Path) -> tuple[dict[str, Building], dict[str, TextureSet]]:
    """Buildings of a finished run, and their textures."""
    found: dict[str, Building] = {}
    for path in sorted((run / "products/cityjson").glob("*.city.jsonl")):
        header, *lines = path.read_bytes().splitlines()
        transform = Transform.of_header(json.loads(header))
        for line in lines:
            if b'"TINRelief"' not in line:
                building = read_feature(line, transform)
                found[building.id] = building
    records = (sorted(folder.glob("[0-9]*.json"))[-1] for folder in sorted((run / "records/atlas").iterdir()))
    outputs = [json.loads(r.read_text())["outputs"] for r in records]
    # of a run whose leaves were cut otherwise before, only those that are still there
    leaves = [p for o in outputs if all((run / q).exists() for q in o) for p in o if p.endswith(ATLAS_CELL)]
    files: Any = _Files(run)
    sets = texture_sets(files, leaves, found)
    for name, made in sets.items():
        faces, plain = (sum(len(getattr(b, key)) for b in made.buildings.values()) for key in ("faces", "plain"))
        print(f"{name}: {faces:,} faces of {len(made.buildings)} buildings wear photographs, {plain:,} do not")
    return found, sets


def write_city(run: Path, out: Path, buildings: int) -> int:
    """A folder that the view can be served from; returns how many buildings it has."""
    town, sets = town_of(run)
    corners = np.array([b.footprint.bounds for b in town.values()])
    low, high = corners[:, :2].min(axis=0), corners[:, 2:].max(axis=0)
    step, copies = high - low + GAP_M, math.ceil(buildings / len(town))
    across = math.ceil(math.sqrt(copies))
    bounds = (*low.tolist(), *(low + step * across).tolist())
    globe, reference, about = globe_of(resolve(CRS), bounds), resolve(CRS), About("Repeated town")
    page = PageFrame.over(reference, bounds)
    tilesets: dict[str, dict[str, TileRoot]] = {PORTABLE: {}, RAW: {}}
    ground = _ground(low, step, min(b.ground_height for b in town.values()))
    here = (*low.tolist(), *(low + step).tolist())
    far = coarse_of(tuple(town.values()), *ground, here, sets["rectified"], None, _Files(run).read)
    parts: dict[str, Coarse] = {}
    rows, pixels = [], dict.fromkeys(sets, 0)
    for copy in range(copies):
        shift = step * [copy % across, copy // across]
        moved = {f"{u}~{copy}": _moved(b, f"{u}~{copy}", shift) for u, b in town.items()}
        textures = {name: _renamed(s, copy, run, out, pixels, name) for name, s in sets.items()}
        middle = tuple((low + shift + step / 2).tolist())
        name, coarse = f"{copy}_0", _coarse_at(far, shift, copy)
        surface = ground[0] + [*shift, 0.0], ground[1]
        scene = Scene(name, tuple(moved.values()), surface, textures["rectified"], textures["raw"], coarse=coarse)
        parts[name] = for_above(coarse)
        for path, data in tile_files(scene, frame_at(globe, (middle[0], middle[1], 0.0)), about).items():
            _write(out / path, data)
            if path.endswith((f"/{PORTABLE}", f"/{RAW}")):
                tilesets[path.rsplit("/", 1)[1]][name] = TileRoot.of(path.removeprefix(f"{FOLDER}/"), data)
        rows += list(_rows(moved, copy, page))
    shown = FarContents("city", parts, globe, "", lambda path, data: _write(out / path, data))
    for name, roots in tilesets.items():
        tree = tree_over(roots.values(), about, name, contents=shown.over({r.uri: n for n, r in roots.items()}))
        assert tree is not None
        for path, data in tree.files.items():
            _write(out / path, data)
    _write_page(out, rows, page, pixels)
    return len(rows)


def _moved(building: Building, name: str, shift: np.ndarray) -> Building:
    def at(solid: Polyhedron) -> Polyhedron:
        return replace(solid, vertices=np.round(solid.vertices + np.array([*shift, 0.0]), 4))

    solids = {lod: at(solid) for lod, solid in building.solids.items()}
    beyond = None if building.beyond is None else at(building.beyond)
    footprint = shapely.affinity.translate(building.footprint, *shift)
    return replace(building, id=name, footprint=footprint, solids=solids, beyond=beyond)


def _coarse_at(coarse: Coarse, shift: np.ndarray, copy: int) -> Coarse:
    """The same somewhere else."""
    x, y = shift.tolist()
    at = tuple(v + d for v, d in zip(coarse.bounds, (x, y, x, y), strict=True))
    plans = tuple(shapely.affinity.translate(plan, x, y) for plan in coarse.blocks.plans)
    blocks = replace(coarse.blocks, ids=tuple(f"{u}~{copy}" for u in coarse.blocks.ids), plans=plans)
    return replace(coarse, bounds=at, extent=at, vertices=coarse.vertices + np.array([x, y, 0.0]), blocks=blocks)


def _renamed(textures: TextureSet, copy: int, run: Path, out: Path, pixels: dict[str, int], name: str) -> TextureSet:
    """The same set with pages of its own, since no two towns wear the same photographs."""
    pages = []
    for page in textures.pages:
        path = f"products/textures/{copy}.{Path(page.path).name}"
        (out / path).parent.mkdir(parents=True, exist_ok=True)
        if not (out / path).exists():
            os.link(run / page.path, out / path)
        pages.append(TexturePage(path, page.width, page.height, page.media_type))
        pixels[name] += page.width * page.height
    return replace(textures, pages=tuple(pages), buildings={f"{u}~{copy}": b for u, b in textures.buildings.items()})


def _ground(low: np.ndarray, step: np.ndarray, height: float) -> tuple[np.ndarray, np.ndarray]:
    n = 12
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    xyz = np.column_stack([low[0] + x.ravel() * step[0], low[1] + y.ravel() * step[1], np.full(n * n, height - 0.2)])
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    return xyz, np.concatenate([np.column_stack([a, a + 1, a + n]), np.column_stack([a + 1, a + n + 1, a + n])])


def _rows(moved: Mapping[str, Building], copy: int, page: PageFrame) -> Iterator[list[Any]]:
    for unit, building in moved.items():
        x, y = building.footprint.centroid.coords[0]
        place = page.plan(np.array([x, y]), building.ground_height + 4.0)[0]
        yield [unit, f"{copy}_0", "done", "good", 0.03, 0.06, np.round(place, 2).tolist(), 15.0]


def _write_page(out: Path, rows: list[Any], page: PageFrame, pixels: Mapping[str, int]) -> None:
    places = np.array([row[-2] for row in rows])
    low, high = places.min(axis=0) - 15.0, places.max(axis=0) + 15.0
    about = {
        "title": "Repeated town", "verdict": f"{len(rows):,} buildings", "state": "", "frame": page.frame.matrix, "world": page.to_world.tolist(),
        "sets": {"rectified": f"products/tiles3d/{PORTABLE}", "raw": f"products/tiles3d/{RAW}"}, "texture_pixels": dict(pixels),
        "bounds": [*low.tolist(), *high.tolist()], "heights": [0.0, 20.0], "counts": {"done": len(rows)}, "scales": {"nmad": 0.1, "rmse": 0.1},
        "tiles": [], "notes": [], "layers": {}, "missing": {}, "said": {},
    }  # fmt: skip
    _write(out / "view/data/city.json", json.dumps(about).encode())
    tiles: dict[str, list[Any]] = defaultdict(list)
    for row in rows:
        tiles[row[1]].append(row)
    for tile, found in tiles.items():
        table = {"fields": FIELDS, "rows": found, "failures": [], "cuts": {"fields": [], "rows": []}}
        _write(out / f"view/data/index/{tile}.json", json.dumps(table).encode())
    parts = list(id_parts({tile: [row[0] for row in found] for tile, found in tiles.items()}))
    for number, (_, part) in enumerate(parts):
        _write(out / f"view/data/ids/{number}.json", json.dumps(part).encode())
    index = {
        "fields": ["name"],
        "rows": [[tile] for tile in tiles],
        "ids": [first for first, _ in parts],
        "ends": ends_of(rows),
    }
    _write(out / "view/data/index.json", json.dumps(index).encode())
    for path, data in page_files("Repeated town", "", ()):
        _write(out / path, data)


def _write(path: Path, data: bytes) -> str:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)
    return str(path)

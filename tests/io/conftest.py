"""Buildings made by hand, with hostile ids and attributes, for the writers' tests."""

from __future__ import annotations

import importlib
import json
import json.encoder
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import jsonschema_rs
import numpy as np
import pytest
from shapely import Polygon
from shapely.affinity import translate

from cityflow.core.building import Building, Face, Lod, Polyhedron, RoofPlane, Semantic, Status
from cityflow.core.reference import Reference
from textured_houses import with_overhang

SCHEMAS = Path(__file__).parents[1] / "data" / "schemas" / "cityjson-2.0.2"

GROUND = -1.2345
EAVE, RIDGE = 4.0101, 7.5


def _extrusion(rings: Sequence[np.ndarray], top: float, neighbour: str | None = None) -> Polyhedron:
    """A prism over rings (exterior counter-clockwise, holes clockwise); the first wall is a party wall if asked."""
    vertices: list[np.ndarray] = []
    floor: list[tuple[int, ...]] = []
    roof: list[tuple[int, ...]] = []
    walls: list[Face] = []
    for ring in rings:
        start, n = sum(len(v) for v in vertices), len(ring)
        low, high = range(start, start + n), range(start + n, start + 2 * n)
        vertices += [np.column_stack([ring, np.full(n, z)]) for z in (GROUND, top)]
        floor.append(tuple(reversed(low)))
        roof.append(tuple(high))
        walls += [Face(((low[i], low[(i + 1) % n], high[(i + 1) % n], high[i]),), Semantic.WALL) for i in range(n)]
    if neighbour is not None:
        walls[0] = Face(walls[0].rings, Semantic.WALL, neighbour=neighbour)
    faces = (Face(tuple(floor), Semantic.GROUND), *walls, Face(tuple(roof), Semantic.ROOF, plane=0))
    return Polyhedron(np.round(np.concatenate(vertices), 4), faces)


def make_gable(
    identifier: str, x: float = 84967.5731, y: float = 447497.4452, neighbour: str | None = None
) -> Building:
    """A 10 × 8 m house with a gable roof, its ridge along x."""
    footprint = translate(Polygon([(0, 0), (10, 0), (10, 8), (0, 8)]), x, y)
    xy = np.round(np.asarray(footprint.exterior.coords)[:-1], 4)
    ridge = np.array([[x, y + 4, RIDGE], [x + 10, y + 4, RIDGE]])
    low, eaves = (np.column_stack([xy, np.full(4, z)]) for z in (GROUND, EAVE))
    vertices = np.round(np.concatenate([low, eaves, ridge]), 4)
    wall, roof = Semantic.WALL, Semantic.ROOF
    faces = (
        Face(((3, 2, 1, 0),), Semantic.GROUND),
        Face(((0, 1, 5, 4),), wall),
        Face(((1, 2, 6, 9, 5),), wall, neighbour=neighbour),
        Face(((2, 3, 7, 6),), wall),
        Face(((3, 0, 4, 8, 7),), wall),
        Face(((4, 5, 9, 8),), roof, plane=0),
        Face(((6, 7, 8, 9),), roof, plane=1),
    )
    slope = (RIDGE - EAVE) / 4
    planes = (
        RoofPlane(0.0, slope, EAVE, (x, y), 612, 0.0312345),
        RoofPlane(0.0, -slope, EAVE, (x, y + 8), 598, float("nan")),
    )
    return Building(
        id=identifier,
        footprint=Polygon(xy),
        ground_height=GROUND,
        solids={
            Lod.LOD12: _extrusion([xy], 5.5),
            Lod.LOD13: _extrusion([xy], 5.75),
            Lod.LOD22: Polyhedron(vertices, faces),
        },
        planes=planes,
        attributes={
            "identificatiebagpnd": 503100000018603,
            "status": "bestaand",
            "inonderzoek": False,
            "hoek": None,
            "nmad_m": 0.1 + 0.2,
            'Größe <m²> & "mehr"': "ä<&>\x00'\"",
            "ridge_height": RIDGE,
        },
    )


def make_courtyard(identifier: str, x: float = 85010.0, y: float = 447510.0) -> Building:
    """A flat-roofed 20 × 20 m block around a court, its model simpler than asked for."""
    outer = np.array([(0, 0), (20, 0), (20, 20), (0, 20)]) + np.array([x, y])
    inner = np.array([(6, 6), (6, 14), (14, 14), (14, 6)]) + np.array([x, y])
    solid = _extrusion([outer, inner], 9.8765)
    return Building(
        id=identifier,
        footprint=Polygon(outer, [inner]),
        ground_height=GROUND,
        solids={Lod.LOD12: solid, Lod.LOD13: solid, Lod.LOD22: solid},
        planes=(RoofPlane(0.0, 0.0, 9.8765, (x, y), 900, 0.02),),
        attributes={"identificatiebagpnd": 7, "status": "bestaand"},
        status=Status.DEGRADED,
        reason="two planes, too few points for the rest",
    )


def make_refused(identifier: str) -> Building:
    """A unit without any geometry."""
    return Building(identifier, Polygon(), 0.0, {}, status=Status.REFUSED, reason="outline has no area")


@pytest.fixture
def gable() -> Building:
    return make_gable("0503100000018603", neighbour="NL <x> é")


@pytest.fixture
def courtyard() -> Building:
    return make_courtyard("NL <x> é")


@pytest.fixture
def buildings(gable: Building, courtyard: Building) -> list[Building]:
    return [gable, courtyard, make_gable('a b/"c"', 85040.0, 447500.0), make_refused("_x20_ \u2028 ∅")]


@pytest.fixture
def neighbours() -> list[Building]:
    """A gable with an overhang, and beside it a block with a court; they share a wall."""
    x, y = 84967.5731, 447497.4452
    gable = with_overhang(make_gable("0503 <west>", x, y, neighbour="0503 <east>"), x, y, EAVE)
    block = make_courtyard("0503 <east>", x + 10, y - 6)
    solid = block.solids[Lod.LOD22]
    # the west wall of the block, walls come after the floor
    faces = tuple(replace(f, neighbour=gable.id) if i == 4 else f for i, f in enumerate(solid.faces))
    return [gable, replace(block, solids={**block.solids, Lod.LOD22: Polyhedron(solid.vertices, faces)})]


@pytest.fixture
def amersfoort() -> Reference:
    return Reference("EPSG:7415", 28992, 5709, "Amersfoort / RD New + NAP height")


@pytest.fixture
def local() -> Reference:
    return Reference("local", None, None, "local metric frame")


@pytest.fixture
def terrain() -> tuple[np.ndarray, np.ndarray]:
    """(V, 3) vertices and (T, 3) triangles of a small bumpy patch, counter-clockwise from above."""
    n = 12
    x, y = np.meshgrid(np.arange(n, dtype=float), np.arange(n, dtype=float))
    z = np.sin(x / 3) + y / 10
    vertices = np.round(np.column_stack([x.ravel() + 84960, y.ravel() + 447490, z.ravel() - 1]), 4)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate(
        [np.column_stack([corner, corner + 1, corner + n]), np.column_stack([corner + 1, corner + n + 1, corner + n])]
    )
    return vertices, triangles.astype(np.int64)


@pytest.fixture(scope="session")
def cjio() -> ModuleType:
    """cjio's reader; importing it cuts the floats of every later `json.dumps` in the process, which is undone here."""
    settings = vars(json.encoder)
    before = dict(settings)
    reader = importlib.import_module("cjio.cityjson")
    settings["c_make_encoder"] = before["c_make_encoder"]
    if "float" not in before:
        settings.pop("float", None)
    return reader


@pytest.fixture(scope="module")
def schema_of() -> dict[str, jsonschema_rs.Validator]:
    """CityJSON 2.0's schemas of a document and of a line of a sequence."""
    schemas = [json.loads(path.read_text()) for path in sorted(SCHEMAS.glob("*.schema.json"))]
    registry = jsonschema_rs.Registry([(schema["$id"], schema) for schema in schemas])
    return {
        kind: jsonschema_rs.validator_for(schema, registry=registry)
        for kind in ("CityJSON", "CityJSONFeature")
        for schema in schemas
        if schema["$id"].endswith(f"/{kind.lower()}.schema.json")
    }

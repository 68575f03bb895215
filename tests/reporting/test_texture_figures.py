from __future__ import annotations

import json
from typing import Any, cast

import numpy as np
import pytest

from cityflow.core.building import Status
from cityflow.flow.store import Store
from cityflow.flow.task import Record
from cityflow.reporting.atlas_cell_faces import read_atlas_cells
from cityflow.reporting.texture_figures import MOST_ATLAS_CELLS, texture_figures
from cityflow.runs.current import CurrentRecords
from cityflow.survey.survey import Survey
from cityflow.viewer.texture_rows import MovedPhotograph


class Textured:
    textures = True


def face(rings: list[list[list[float]]], gsd: float, interpolated: float) -> dict[str, Any]:
    figures = {
        "gsd_m": gsd,
        "incidence_deg": 10.0,
        "candidates": 3,
        "images": 2,
        "occluded": 0.0,
        "interpolated": interpolated,
    }
    return {
        "unit": "a",
        "page": 0,
        "rings": rings,
        "uvd": [[[0.1, 0.1, 2.0] for _ in r] for r in rings],
        "figures": figures,
    }


def square(size: float, z: float = 5.0) -> list[list[float]]:
    return [[0, 0, z], [size, 0, z], [size, size, z], [0, size, z]]


def atlas_cell() -> dict[str, Any]:
    """A roof of 100 m² with a hole of 4 m² and a wall of 20 m², textured; a wall of 30 m² and a floor that want or have none."""
    hole = [[4, 4, 5.0], [4, 6, 5.0], [6, 6, 5.0], [6, 4, 5.0]]
    seen = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 0.0, 2.0], [0.0, 0.0, 2.0]]
    hidden = [[0, 9, 0], [0, 9, 3], [10, 9, 3], [10, 9, 0]]
    faces = [face([square(10), hole], 0.08, 0.25), face([seen], 0.2, 0.0)]
    made = {"pages": [{"path": "products/textures/p.jpg"}], "faces": faces}
    plain = {"a": [[[hidden], [1, 2, 3], "no image sees it"], [[square(3, 0.0)[::-1]], [4, 5, 6], ""]]}
    return {"images": ["i", "j"], "plain": plain, "sets": {"raw": made, "rectified": made}}


def record(stage: str, unit: str, outputs: dict[str, str], result: dict[str, Any]) -> Record:
    return Record(stage, unit, 1, "", 1, Status.DONE, "", outputs, result, {}, {})


def run_of(atlas_cells: int) -> tuple[Store, CurrentRecords]:
    store = Store.open(f"memory://leaves{atlas_cells}")
    atlas = []
    for k in range(atlas_cells):
        store.write_bytes(f"work/{k}/atlas_cell.json", json.dumps(atlas_cell()).encode())
        atlas.append(record("atlas", str(k), {f"work/{k}/atlas_cell.json": ""}, {"raw": {"pages": 1}}))
    texture = [record("texture", "a", {}, {"textured": 2}), record("texture", "b", {}, {"textured": 0})]
    return store, CurrentRecords({"atlas": atlas, "texture": texture})


def test_shares_by_kind_of_surface() -> None:
    store, records = run_of(1)
    found = texture_figures(store, cast(Survey, Textured()), records)
    assert found is not None
    assert [(s.kind, s.area_m2, s.textured) for s in found.shares] == [("roofs", 96.0, 1.0), ("façades", 50.0, 0.4)]
    assert (found.buildings, found.asked, found.faces, found.images, found.pages) == (1, 2, 2, 2, 1)
    assert found.gsd_m == 0.08
    assert found.interpolated == pytest.approx(96 * 0.25 / 116)
    assert [(p.reason, p.count, p.area_m2) for p in found.plain] == [("no image sees it", 1, 30.0)]


def test_of_a_large_city_so_many_squares_are_read() -> None:
    store, records = run_of(MOST_ATLAS_CELLS + 30)
    found = texture_figures(store, cast(Survey, Textured()), records)
    assert found is not None
    assert (found.read, found.squares) == (MOST_ATLAS_CELLS, MOST_ATLAS_CELLS + 30)
    assert found.shares[1].textured == pytest.approx(0.4)


def test_photographs_that_lie_beside_the_models_are_named() -> None:
    store, records = run_of(1)
    moved = [{"p": (2.0, -1.0), "q": (3.0, 0.0)}, {"p": (3.0, 0.0)}, {}]
    texture = [record("texture", str(k), {}, {"textured": 1, "moved": m}) for k, m in enumerate(moved)]
    found = texture_figures(store, cast(Survey, Textured()), CurrentRecords({"texture": texture}))
    assert found is not None
    assert found.moved_images == 2
    assert found.moved == (MovedPhotograph("p", 2, 2.5, -0.5), MovedPhotograph("q", 1, 3.0, 0.0))
    bare = texture_figures(store, cast(Survey, Textured()), records)
    assert bare is not None
    assert bare.moved == ()


def test_corners_come_back_where_they_were() -> None:
    store, _ = run_of(1)
    (found,) = read_atlas_cells(store, ["work/0/atlas_cell.json"])
    assert np.allclose(found.arrays.vertices[:4] + found.arrays.origin, square(10))
    assert found.page.tolist() == [0, 0, -1, -1]
    assert found.uvd[-1].tolist() == [0.0, 0.0, 1.0]


def test_textures_not_asked_for_or_not_made() -> None:
    store = Store.open("memory://none")
    nothing = CurrentRecords({})
    assert texture_figures(store, cast(Survey, type("Bare", (), {"textures": False})()), nothing) is None
    found = texture_figures(store, cast(Survey, Textured()), nothing)
    assert found is not None
    assert (found.faces, found.shares, found.gsd_m, found.interpolated) == (0, (), None, None)

"""Which images a building wears: shares of pixels, counted from the index pages of the atlas."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
import pytest
from PIL import Image

from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, OUTSIDE
from cityflow.flow.store import Store
from cityflow.handover.texture_files import PAGES
from cityflow.reporting.view_images import AtlasCell, images_of_atlas_cell

IMAGES = ["nadir_07.jpg", "left_03.jpg", "right_11.jpg"]
NADIR, LEFT, RIGHT = range(FIRST_IMAGE, FIRST_IMAGE + 3)
ROWS, COLS = 60, 100
ATLAS_CELL = AtlasCell("0_0", "work/atlas/0_0/atlas_cell.json", "")


def _ring(col0: int, row0: int, col1: int, row1: int) -> list[list[float]]:
    """A box of whole pixels of a page, by the centres of its outermost pixels, in glTF's upright texture coordinates."""
    corners = [(col0, row0), (col1 - 1, row0), (col1 - 1, row1 - 1), (col0, row1 - 1)]
    return [[(col + 0.5) / COLS, 1 - (row + 0.5) / ROWS, 1.0] for col, row in corners]


def _face(unit: str, page: int, *rings: list[list[float]]) -> dict[str, Any]:
    return {"unit": unit, "page": page, "uvd": list(rings)}


def _store(name: str, faces: list[dict[str, Any]], pages: list[np.ndarray | None]) -> Store:
    """A run's folder with one atlas cell; pages that are None are missing."""
    store = Store.open(f"memory://view-images-{name}")
    said = {"pages": [{}] * len(pages), "faces": faces}
    store.write_bytes(ATLAS_CELL.path, json.dumps({"images": IMAGES, "sets": {"rectified": said}}).encode())
    for number, page in enumerate(pages):
        if page is not None:
            file = io.BytesIO()
            Image.fromarray(page).save(file, "PNG")
            store.write_bytes(f"{PAGES}/{ATLAS_CELL.name}.rectified.{number}.index.png", file.getvalue())
    return store


def _page() -> np.ndarray:
    return np.full((ROWS, COLS), OUTSIDE, np.uint16)


def test_shares_are_those_of_the_pixels_of_all_faces_on_all_pages() -> None:
    first, second = _page(), _page()
    first[10:30, 10:40] = NADIR
    first[10:30, 40:50] = LEFT
    second[5:25, 20:30] = RIGHT
    second[40:50, 60:80] = LEFT
    faces = [
        _face("house", 0, _ring(10, 10, 50, 30)), _face("house", 1, _ring(20, 5, 30, 25)), _face("shed", 1, _ring(60, 40, 80, 50)),
    ]  # fmt: skip
    found = images_of_atlas_cell(_store("pages", faces, [first, second]), ATLAS_CELL)
    assert list(found) == ["house", "shed"]
    assert [name for name, _ in found["house"]] == ["nadir_07.jpg", "left_03.jpg", "right_11.jpg"], (
        "by share, then by name"
    )
    assert [share for _, share in found["house"]] == pytest.approx([0.6, 0.2, 0.2], abs=0.001)
    assert found["shed"] == [["left_03.jpg", 1.0]], "pixels of the house beside it do not count"


def test_what_came_from_no_image_is_not_counted() -> None:
    page = _page()
    page[10:30, 10:30] = NADIR
    page[10:30, 30:40] = LEFT
    page[10:30, 40:70] = INTERPOLATED
    page[0:10] = RIGHT
    (shares,) = images_of_atlas_cell(
        _store("inside", [_face("house", 0, _ring(10, 10, 70, 30))], [page]), ATLAS_CELL
    ).values()
    assert [name for name, _ in shares] == ["nadir_07.jpg", "left_03.jpg"], "what lies beside the face does not count"
    assert [share for _, share in shares] == pytest.approx([2 / 3, 1 / 3], abs=0.001)


def test_what_lies_in_the_hole_of_a_face_is_another_s() -> None:
    page = _page()
    page[10:50, 10:50] = NADIR
    page[20:40, 20:40] = RIGHT
    faces = [_face("ring", 0, _ring(10, 10, 50, 50), _ring(20, 20, 40, 40)), _face("court", 0, _ring(20, 20, 40, 40))]
    found = images_of_atlas_cell(_store("hole", faces, [page]), ATLAS_CELL)
    assert found["court"] == [["right_11.jpg", 1.0]]
    assert found["ring"][0][0] == "nadir_07.jpg"
    assert found["ring"][0][1] > 0.9, "but for the hole's rim"


def test_a_page_that_is_missing_or_damaged_leaves_the_others() -> None:
    page = _page()
    page[10:30, 10:50] = LEFT
    faces = [_face("a", 0, _ring(10, 10, 50, 30)), _face("b", 1, _ring(10, 10, 50, 30))]
    store = _store("missing", faces, [page, None])
    assert images_of_atlas_cell(store, ATLAS_CELL) == {"a": [["left_03.jpg", 1.0]], "b": []}
    store.write_bytes(f"{PAGES}/{ATLAS_CELL.name}.rectified.1.index.png", b"no picture")
    assert images_of_atlas_cell(store, ATLAS_CELL) == {"a": [["left_03.jpg", 1.0]], "b": []}


def test_a_leaf_that_is_gone_has_no_images() -> None:
    assert images_of_atlas_cell(Store.open("memory://view-images-none"), ATLAS_CELL) == {}

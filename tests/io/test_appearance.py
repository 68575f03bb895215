from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.building import Building
from cityflow.core.reference import Reference
from cityflow.core.texture import BuildingTexture, FaceFigures, FaceTexture, PlainFace, TexturePage, TextureSet
from cityflow.io.city_models.appearance import (
    Appearance,
    attributes_of_look,
    coordinates_of,
    figure_attributes,
    looks_of,
)
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.city_models.cityjson import Transform, feature_line
from cityflow.io.city_models.obj import write_obj

FIGURES = FaceFigures(0.05, 12.0, 40, 3, 0.25, 0.125)
PAGE = TexturePage("products/textures/r/0_0.jpg", 512, 256, "image/jpeg")


def _textured(corners: np.ndarray, page: int = 0) -> FaceTexture:
    return FaceTexture(page, (corners,), FIGURES)


@pytest.mark.parametrize(
    ("folder", "image"),
    [
        ("products/obj", "../textures/r/0_0.jpg"),
        ("products", "textures/r/0_0.jpg"),
        ("products/textures/r", "0_0.jpg"),
        ("products/a/b", "../../textures/r/0_0.jpg"),
    ],
)
def test_images_are_named_from_where_the_file_stands(folder: str, image: str) -> None:
    assert Appearance(folder).image(PAGE) == image


def test_figures_that_are_not_numbers_are_left_out() -> None:
    odd = FaceFigures(float("inf"), float("nan"), 0, 0, 0.0, 1.0)
    assert figure_attributes(odd) == {
        "texture_candidates": 0, "texture_images": 0, "texture_occluded": 0.0, "texture_interpolated": 1.0,
    }  # fmt: skip


def test_a_reason_may_hold_anything_and_an_empty_one_is_not_said() -> None:
    assert attributes_of_look(PlainFace((1, 2, 3), "")) == {}
    assert attributes_of_look(PlainFace((1, 2, 3), "a\x00b <&>")) == {"texture_missing": "a\ufffdb <&>"}


def test_looks_come_in_the_order_of_the_faces_whatever_the_order_of_the_textures() -> None:
    corners = np.zeros((3, 3))
    faces = {("beyond", 0): _textured(corners), ("solid", 9): _textured(corners), ("solid", 2): _textured(corners)}
    plain = {("solid", 5): PlainFace((1, 2, 3), ""), ("beyond", 1): PlainFace((1, 2, 3), "")}
    texture = BuildingTexture(faces, plain)  # type: ignore[arg-type]
    assert list(looks_of(texture, "solid")) == [2, 5, 9]
    assert list(looks_of(texture, "beyond")) == [0, 1]


def test_coordinates_are_rounded_closed_and_never_minus_nothing() -> None:
    corners = np.array([[0.123456789, -1e-12, 1.0], [1.0, 0.5, 1.0], [0.25, 1.0, 1.0]])
    (ring,) = coordinates_of([_textured(corners)], closed=True)
    assert ring == [[0.1234568, 0.0, 1.0], [1.0, 0.5, 1.0], [0.25, 1.0, 1.0], [0.1234568, 0.0, 1.0]]
    assert str(ring[0][1]) == "0.0"
    assert list(coordinates_of([PlainFace((1, 2, 3), "")])) == []


def test_a_building_that_the_textures_do_not_know_looks_as_ever(gable: Building, amersfoort: Reference) -> None:
    """Its CityJSON and OBJ, that is; a CityGML file declares the namespace once for all buildings."""
    others = Appearance("products/x", TextureSet(True, (PAGE,), {"somebody else": BuildingTexture({})}))
    assert feature_line(gable, appearance=others) == feature_line(gable)
    with_and_without = (
        [line for line in _obj(gable, amersfoort, look) if not line.startswith("#")] for look in (others, None)
    )
    assert next(with_and_without) == next(with_and_without)
    target, bare = io.BytesIO(), io.BytesIO()
    write_citygml(target, [gable], amersfoort, appearance=others)
    write_citygml(bare, [gable], amersfoort)
    assert target.getvalue().partition(b"<cityObjectMember>")[2] == bare.getvalue().partition(b"<cityObjectMember>")[2]


def _obj(building: Building, reference: Reference, look: Appearance | None) -> list[str]:
    files = write_obj("t", [building], reference, Transform(), appearance=look or Appearance(""))
    return files["t.obj"].decode().splitlines()


def test_textures_of_a_level_that_a_building_lacks_are_no_matter(gable: Building, local: Reference) -> None:
    corners = np.zeros((4, 3))
    known = {gable.id: BuildingTexture({("solid", 1): _textured(corners), ("beyond", 0): _textured(corners)})}
    look = Appearance("products/x", TextureSet(True, (PAGE,), known))
    bare = replace(gable, solids={})
    assert b'"appearance"' not in feature_line(bare, appearance=look)
    target = io.BytesIO()
    write_citygml(target, [bare], local, appearance=look)
    assert b"<app:appearance>" not in target.getvalue()
    assert b"\nvt " not in write_obj("t", [bare], local, Transform(), appearance=look)["t.obj"]


def test_jpegs_are_named_as_such(gable: Building) -> None:
    known = {gable.id: BuildingTexture({("solid", 1): _textured(np.full((4, 3), 0.5))})}
    look = Appearance("products/x", TextureSet(True, (PAGE,), known))
    assert b'{"type":"JPG","image":"../textures/r/0_0.jpg"' in feature_line(gable, appearance=look)

"""Windows from photographs to products: painted on walls, found where they were painted, and nowhere else, whatever is run again."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import geopandas
import numpy as np
import pytest
import shapely
from lxml import etree
from numpy.typing import NDArray
from PIL import Image

from cityflow.core.building import Lod
from cityflow.core.camera import Camera
from cityflow.errors import CityflowError
from cityflow.evaluation.written import faulty
from cityflow.flow.task import Task
from cityflow.io.city_models.cityjson import Transform, read_feature
from cityflow.survey.area import Area
from stages.painted_houses import (
    CRS_CODE,
    FLOOR,
    MIDDLE,
    PANE,
    PLANS,
    Painted,
    Windows,
    X,
    Y,
    looking,
    pictures,
    survey_in,
)
from stages.test_texture_sources import Run, features, run, source_of
from textured_houses import sample
from written_products import written

FINE = Camera(900, 660, 990.0, 990.0, 450.0, 330.0)
"""Seven centimetres a pixel."""
IMAGES = tuple(
    looking(name, place, at, FINE)
    for name, place, at in (
        ("nadir", (38, 45, 75), (38, 45, 0)), ("south", (38, -10, 45), MIDDLE), ("north", (38, 100, 55), MIDDLE),
        ("west", (-17, 45, 55), MIDDLE), ("east", (93, 45, 55), MIDDLE),
    )
)  # fmt: skip
WIDE, HIGH = 1.2, 1.5


def rows(columns: tuple[float, ...], sills: tuple[float, ...]) -> list[tuple[float, float, float, float]]:
    return [(left, sill, WIDE, HIGH) for sill in sills for left in columns]


PAINTED: Windows = {
    ("a", "south"): rows((1.5, 5.0, 8.5), (1.2, 4.6)),
    ("b", "south"): rows((2.0, 5.5, 9.0), (1.6,)),
    ("c", "south"): rows((1.5, 4.5, 8.5, 11.5), (1.2, 4.6)),
    ("a", "east"): rows((2.0, 6.5), (5.8,)),
}
"""Those in the eastern wall of a look over the lower roof of b; below it the wall is a party wall."""
STOREYS = {"a": 2, "b": 1, "c": 2}
FORMATS: dict[str, Any] = {"export": {"formats": ["cityjson", "citygml"]}}
GML = {"b": "http://www.opengis.net/citygml/building/2.0", "gml": "http://www.opengis.net/gml"}


@pytest.fixture(scope="module")
def painted(tmp_path_factory: pytest.TempPathFactory) -> Painted:
    survey = survey_in(tmp_path_factory.mktemp("windows"))
    survey.write_images(pictures(IMAGES, PAINTED, chequer=2.0))
    survey.describe()
    return survey


@pytest.fixture(scope="module")
def whole(painted: Painted, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run(source_of(painted, **FORMATS), tmp_path_factory.mktemp("run") / "run")


@pytest.mark.parametrize("form", ["cityjson", "citygml"])
def test_walls_with_holes_and_what_fills_them_keep_the_rules(whole: Run, form: str) -> None:
    folder = Path(str(whole.store.root)) / "products" / form
    read = [g for path in sorted(folder.iterdir()) for g in written(path)]
    assert sum(len(p) > 1 for g in read if g.lod == "3" for p in g.polygons) >= 3
    assert [(f.geometry.owner, f.geometry.lod, str(f.faults[0])) for f in faulty(read)] == []


def true_rings(house: str) -> NDArray[np.float64]:
    """(N, 2, 3) lower and upper corner of the windows of a house, world."""
    x_0, y_0, x_1, _ = PLANS[house]
    found = []
    for (name, side), windows in PAINTED.items():
        if name == house:
            low = [(x_0 + w[0], y_0) if side == "south" else (x_1, y_0 + w[0]) for w in windows]
            step = (WIDE, 0) if side == "south" else (0, WIDE)
            found += [
                ((x, y, FLOOR + w[1]), (x + step[0], y + step[1], FLOOR + w[1] + HIGH))
                for (x, y), w in zip(low, windows, strict=True)
            ]
    return in_order(np.array(found))


def in_order(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    middles = corners.mean(axis=1).round(0)
    return corners[np.lexsort((middles[:, 2], middles[:, 1], middles[:, 0]))]


def windows_of(feature: Mapping[str, Any], transform: Transform) -> NDArray[np.float64]:
    """(N, 2, 3) lower and upper corner of the windows in a CityJSONFeature."""
    vertices = transform.decode(feature["vertices"])
    (thing,) = feature["CityObjects"].values()
    found = []
    for geometry in thing["geometry"]:
        if geometry["lod"] == "3":
            surfaces, values = geometry["semantics"]["surfaces"], geometry["semantics"]["values"]
            for boundary, value in zip(geometry["boundaries"], values, strict=True):
                surface = surfaces[value]
                if surface["type"] == "Window":
                    assert "is_party_wall" not in surfaces[surface["parent"]]
                    assert surface["confidence"] > 0.6
                    found.append((vertices[boundary[0]].min(axis=0), vertices[boundary[0]].max(axis=0)))
    return in_order(np.array(found).reshape(-1, 2, 3))


def products(made: Run) -> dict[str, NDArray[np.float64]]:
    """Building → its windows, from the city's CityJSON."""
    lines = made.store.read_bytes("products/city.city.jsonl").splitlines()
    transform = Transform.of_header(json.loads(lines[0]))
    return {f["id"]: windows_of(f, transform) for f in features(made) if f["id"][0] in PLANS}


def citygml(made: Run) -> list[bytes]:
    return [made.store.read_bytes(p) for p in made.store.find("products/citygml") if p.endswith(".gml")]


def attributes(made: Run, unit: str) -> dict[str, Any]:
    (feature,) = [f for f in features(made) if f["id"] == unit]
    said: dict[str, Any] = feature["CityObjects"][unit]["attributes"]
    return said


def test_windows_are_in_the_products_where_they_were_painted(whole: Run) -> None:
    found = products(whole)
    for house in PLANS:
        true = true_rings(house)
        assert found[house].shape == true.shape, house
        assert np.abs(found[house] - true).max() < 0.2, house


def test_citygml_has_the_same_windows(whole: Run) -> None:
    buildings = [b for text in citygml(whole) for b in etree.fromstring(text).iter(f"{{{GML['b']}}}Building")]
    assert len(buildings) == len(PLANS)
    found = products(whole)
    for house in buildings:
        rings = [
            np.array(str(e.text).split(), float).reshape(-1, 3) for e in house.iterfind(".//b:Window//gml:posList", GML)
        ]
        corners = np.array([(r.min(axis=0), r.max(axis=0)) for r in rings])
        assert in_order(corners) == pytest.approx(found[str(house.findtext("gml:name", namespaces=GML))], abs=1e-4)


def test_windows_wear_the_dark_panes_of_the_photographs(whole: Run) -> None:
    """At LoD3, where viewers that show the highest level would else show bare walls."""
    transform = Transform.of_header(json.loads(whole.store.read_bytes("products/city.city.jsonl").splitlines()[0]))
    for feature in (f for f in features(whole) if f["id"] in PLANS):
        look, (thing,) = feature["appearance"], feature["CityObjects"].values()
        (fine,) = [g for g in thing["geometry"] if g["lod"] == "3"]
        vertices, uv = transform.decode(feature["vertices"]), np.array(look["vertices-texture"])
        pages = [pixels_of(whole.store.read_bytes(f"products/{t['image']}")) for t in look["textures"]]
        surfaces, said = fine["semantics"]["surfaces"], fine["texture"]["photographs"]["values"]
        panes = [k for k, s in enumerate(surfaces) if s["type"] == "Window"]
        assert len(panes) == len(true_rings(feature["id"]))
        for k in panes:
            page, *corners = said[k][0]
            inside, outside = (sample(pages[page], about_middle(uv[corners], f)).mean(axis=1) for f in (0.6, 1.6))
            assert inside.max() < PANE + 25 < outside.min() - 25
        for rings, values in zip(fine["boundaries"], said, strict=True):
            if values[0][0] is not None:
                size = np.array(pages[values[0][0]].shape[1::-1])
                assert [len(v) - 1 for v in values] == [len(r) for r in rings]
                assert off_affine(vertices[rings[0]], uv[values[0][1:]] * size) < 0.01


def pixels_of(data: bytes) -> NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))


def about_middle(ring: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    middle = ring.mean(axis=0)
    return np.asarray(middle + factor * (ring - middle))


def off_affine(ring: NDArray[np.float64], at: NDArray[np.float64]) -> float:
    """How far places on a page are from the best affine map of the corners of a face, pixels."""
    terms = np.column_stack([np.ones(len(ring)), ring - ring.mean(axis=0)])
    fitted = np.linalg.lstsq(terms, at, rcond=1e-4)[0]
    return float(np.abs(terms @ fitted - at).max())


def test_buildings_and_walls_say_their_share_and_storeys(whole: Run) -> None:
    for house, (x_0, _, x_1, _) in PLANS.items():
        said = attributes(whole, house)
        assert said["windows"] == len(true_rings(house))
        assert said.get("storeys_by_windows") == STOREYS[house], house
        assert said["windows_confidence"] > 0.6
        wide, high = x_1 - x_0, {"a": 8.0, "b": 5.0, "c": 8.0}[house]
        (feature,) = [f for f in features(whole) if f["id"] == house]
        (solid,) = [
            g for g in feature["CityObjects"][house]["geometry"] if g["lod"] == Lod.LOD22 and g["type"] == "Solid"
        ]
        walls = [s for s in solid["semantics"]["surfaces"] if s.get("windows")]
        share = len(PAINTED[house, "south"]) * WIDE * HIGH / (wide * high)
        assert any(w["window_to_wall_ratio"] == pytest.approx(share, rel=0.25) for w in walls), house
        assert not [s for s in solid["semantics"]["surfaces"] if s.get("is_party_wall") and "windows" in s]


def test_an_area_has_the_same_windows_and_no_others(painted: Painted, whole: Run, tmp_path: Path) -> None:
    made = run(source_of(painted, Area(shapely.box(X + 40, Y + 30, X + 49, Y + 40)), **FORMATS), tmp_path / "run")
    assert {u for s, u in made.records if s == "windows"} == {"b"}
    assert made.records["windows", "b"].outputs == whole.records["windows", "b"].outputs
    found, all_of = products(made), products(whole)
    assert list(found) == ["b"]
    assert found["b"].tolist() == all_of["b"].tolist()


def test_a_wish_for_one_building_runs_its_windows_and_the_export_again(
    painted: Painted, whole: Run, tmp_path: Path
) -> None:
    request = {("windows", "c"): {"least_confidence": 1.0}}
    made = run(source_of(painted, overrides=request, **FORMATS), tmp_path / "run", whole)
    assert {n for n in made.ran if n[0] != "export"} == {("windows", "c")}
    found, before = products(made), products(whole)
    assert len(found["c"]) == 0
    assert attributes(made, "c")["windows"] == 0
    assert "storeys_by_windows" not in attributes(made, "c")
    assert [found[u].tolist() for u in ("a", "b")] == [before[u].tolist() for u in ("a", "b")]


def test_a_search_that_fails_leaves_a_building_that_says_so(painted: Painted, whole: Run, tmp_path: Path) -> None:
    def fail(task: Task) -> None:
        if task.stage == "windows":
            raise CityflowError("the worker was out of memory")

    request = {("windows", "c"): {"least_confidence": 0.61}}
    made = run(source_of(painted, overrides=request, **FORMATS), tmp_path / "run", whole, fail)
    said = attributes(made, "c")
    assert said["windows_missing"] == "the worker was out of memory"
    assert "windows" not in said
    healed = run(source_of(painted, **FORMATS), tmp_path / "healed", Run(made.store, made.records, set()))
    assert {n for n in healed.ran if n[0] != "export"} == {("windows", "c")}
    assert features(healed) == features(whole)


def test_nobody_wants_windows(painted: Painted, whole: Run, tmp_path: Path) -> None:
    made = run(source_of(painted, windows={"when": "never"}, **FORMATS), tmp_path / "run", whole)
    assert {s for s, _ in made.ran} == {"export"}
    assert not [u for s, u in made.records if s == "windows"]
    assert all(len(w) == 0 for w in products(made).values())
    text = b"".join(citygml(made))
    assert b"<bldg:WallSurface" in text
    assert b"lod3MultiSurface" not in text
    assert b"windows" not in text


def test_a_cut_through_a_house_leaves_windows_in_both_halves(painted: Painted, whole: Run, tmp_path: Path) -> None:
    """A person has drawn it; the wall between the halves is a party wall."""
    edits = tmp_path / "edits.gpkg"
    cut = shapely.LineString([(X + 37.2, Y + 54.8), (X + 37.2, Y + 65.2)])
    geopandas.GeoDataFrame(geometry=[cut], crs=CRS_CODE.replace("7415", "28992")).to_file(edits, layer="cut_lines")
    made = run(source_of(painted, edits={"path": str(edits)}, **FORMATS), tmp_path / "run", whole)
    found = products(made)
    halves = sorted(u for u in found if u.startswith("c"))
    assert [len(found[u]) for u in halves] == [4, 4]
    together = in_order(np.concatenate([found[u] for u in halves]))
    assert np.abs(together - true_rings("c")).max() < 0.25
    assert [found[u].tolist() for u in ("a", "b")] == [products(whole)[u].tolist() for u in ("a", "b")]


def test_features_with_windows_are_read_again(whole: Run) -> None:
    lines = whole.store.read_bytes("products/city.city.jsonl").splitlines()
    transform = Transform.of_header(json.loads(lines[0]))
    read = {b.id for b in (read_feature(line, transform) for line in lines[1:] if b'"Building"' in line)}
    assert read == set(PLANS)

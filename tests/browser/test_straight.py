"""A photograph taken steeply is straight on its wall where the page divides at every pixel, and bent where it does not."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from shapely import Polygon

from browser.chromium import Chromium
from browser.conftest import READY, served
from cityflow.core.building import Building, Face, Lod, Polyhedron, Semantic
from cityflow.core.texture import BuildingTexture, FaceFigures, FaceTexture, TexturePage, TextureSet
from cityflow.io.city_models.tiles3d import RAW, About, Scene, tile_files
from cityflow.io.city_models.tiles3d_tree import city_tilesets
from cityflow.io.globe_frame import frame_at
from cityflow.viewer.view_page import page_files

EYE, FORWARD, FOCAL, SIDE = np.array([9.0, -14.0, 16.0]), np.array([-0.1, 0.8, -0.6]), 0.25, 2048
"""Of the camera: centre, direction, focal length as a share of the picture's side; the picture's side in pixels."""
WIDTH_M, HEIGHT_M, BORDER_M = 12.0, 9.0, 4.5
LOWER, UPPER = (200, 40, 160), (40, 170, 60)


def _axes() -> np.ndarray:
    forward = FORWARD / np.linalg.norm(FORWARD)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(forward, right), forward])


def _photograph() -> np.ndarray:
    """The wall y = 0, below and above its border in two colours, as the camera sees it."""
    col, row = np.meshgrid(np.arange(SIDE) + 0.5, np.arange(SIDE) + 0.5)
    at = np.stack([(col / SIDE - 0.5) / FOCAL, (row / SIDE - 0.5) / FOCAL, np.ones_like(col)], axis=-1)
    rays = at @ _axes()
    height = EYE[2] - EYE[1] / rays[..., 1] * rays[..., 2]
    return np.where((height > BORDER_M)[..., None], UPPER, LOWER).astype(np.uint8)


def _textures(corners: np.ndarray) -> TextureSet:
    seen = (corners - EYE) @ _axes().T
    place = seen[:, :2] / seen[:, 2:] * FOCAL + 0.5
    rings = (np.column_stack([place[:, 0], 1 - place[:, 1], seen[:, 2]]),)
    face = FaceTexture(0, rings, FaceFigures(0.1, 0.0, 1, 1, 0.0, 0.0))
    page = TexturePage("products/textures/p.png", SIDE, SIDE, "image/png")
    return TextureSet(False, (page,), {"wall": BuildingTexture({("solid", 0): face})})


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    run = tmp_path_factory.mktemp("wall")
    corners = np.array([(0.0, 0, 0), (WIDTH_M, 0, 0), (WIDTH_M, 0, HEIGHT_M), (0, 0, HEIGHT_M)])
    solid = Polyhedron(corners, (Face(((0, 1, 2, 3),), Semantic.WALL),))
    wall = Building("wall", Polygon(corners[:, [0, 2]]), 0.0, {Lod.LOD22: solid})
    frame = frame_at(None, (0.0, 0.0, 0.0))
    nothing = np.empty((0, 3)), np.empty((0, 3), np.int64)
    files = tile_files(Scene("0_0", (wall,), nothing, None, _textures(corners)), frame, About("Wall"))
    trees = city_tilesets({p: d for p, d in files.items() if p.endswith(RAW)}, About("Wall"), RAW)
    about = {
        "title": "Wall", "verdict": "", "frame": frame.matrix, "world": None, "sets": {"rectified": None, "raw": f"products/tiles3d/{RAW}"},
        "texture_pixels": {"raw": SIDE**2}, "bounds": [0, -1, 0, WIDTH_M, 1, HEIGHT_M], "heights": [0, HEIGHT_M], "counts": {}, "tiles": [],
        "scales": {"nmad": 0.1, "rmse": 0.1}, "notes": [], "layers": {}, "missing": {}, "said": {},
    }  # fmt: skip
    data = {
        "view/data/city.json": about,
        "view/data/index.json": {"fields": ["name"], "rows": [], "ids": [], "ends": []},
    }
    pages = dict(page_files("Wall", "", ()))
    for path, content in {**files, **trees, **pages, **{p: json.dumps(t).encode() for p, t in data.items()}}.items():
        (run / path).parent.mkdir(parents=True, exist_ok=True)
        (run / path).write_bytes(content)
    (run / "products/textures").mkdir()
    Image.fromarray(_photograph()).save(run / "products/textures/p.png")
    return str(run)


def _share_right(browser: Chromium) -> float:
    """Of places on the wall, 0.25 m or more from the border: how many show the colour of their side."""
    x, z = np.meshgrid(np.linspace(0.3, WIDTH_M - 0.3, 40), np.linspace(0.3, HEIGHT_M - 0.3, 40))
    clear = np.abs(z - BORDER_M) > 0.25
    places = np.column_stack([x[clear], np.zeros(int(clear.sum())), z[clear]])
    pixels = np.array(browser.run(
        f"""(() => {{ const V = cityflowView.stage.camera.position.constructor;
        return {json.dumps(places.tolist())}.map((p) => cityflowView.stage.onPage(new V(...p))); }})()"""
    ))  # fmt: skip
    seen = browser.picture()[pixels[:, 1].astype(int), pixels[:, 0].astype(int)].astype(int)
    wanted = np.where((places[:, 2] > BORDER_M)[:, None], UPPER, LOWER)
    return float(np.mean(np.abs(seen - wanted).max(axis=1) < 40))


def _choose(browser: Chromium, label: str) -> None:
    """Choose how raw photographs are shown, in the page's own list, with the keyboard."""
    words = {"divided": "raw, perspective-correct", "bent": "raw, not corrected (bent)"}
    browser.run("document.getElementById('textures').focus()")
    key = "ArrowDown" if label == "bent" else "ArrowUp"
    browser.key(key)
    browser.wait("!cityflowView.isBusy")
    chosen = browser.run("document.getElementById('textures').selectedOptions[0].text")
    assert chosen == words[label]


def test_dividing_keeps_the_border_straight_and_not_dividing_bends_it(browser: Chromium, address: str) -> None:
    with served(Path(address)) as url:
        browser.messages.clear()
        browser.open(url, READY)
        browser.run("cityflowView.stage.look([6.5, -16, 5], [6, 0, 4.4])")
        shares, pictures = {}, {}
        assert browser.run("document.getElementById('textures').value") == "divided", "what is straight comes first"
        shares["at first"] = _share_right(browser)
        for choice in ("bent", "divided"):
            _choose(browser, choice)
            shares[choice] = _share_right(browser)
            pictures[choice] = browser.picture()[60:700, 245:]
        assert f"textures={choice}" in browser.run("cityflowView.link.address")
        assert browser.messages == []
        browser.open("about:blank")
    assert shares["at first"] > 0.995
    assert shares["divided"] > 0.995
    assert shares["bent"] < 0.97
    differing = np.abs(pictures["bent"].astype(int) - pictures["divided"]).max(axis=2) > 60
    assert differing.sum() > 2000, "one sees which of them was chosen"

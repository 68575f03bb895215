"""Where things of the painted run are on its page, and what the page shows there."""

from __future__ import annotations

import json

import numpy as np

from browser import painted_run as town
from browser.chromium import Chromium
from cityflow.core.arrays import ByteArray, FloatArray

SETTLED = "!window.cityflowView.isBusy"


def on_page(page: Chromium, places: FloatArray) -> FloatArray:
    """(N, 2) pixels where world positions are drawn, through the page's own camera and frame."""
    frame = json.loads(page.run("JSON.stringify(cityflowView.about.world)"))
    found: list[list[float]] = page.run(
        f"""(() => {{
        const V = cityflowView.stage.camera.position.constructor;
        return {json.dumps(local_of(np.array(frame), places).tolist())}.map((p) => cityflowView.stage.onPage(new V(...p)));
        }})()"""
    )
    pixels: FloatArray = np.array(found, np.float64)
    return pixels


def local_of(world: FloatArray, places: FloatArray) -> FloatArray:
    """Positions in the page's frame, by turning its polynomials round (Newton)."""
    local: FloatArray = places - world[:, 0]
    for _ in range(6):
        e, n, u = local.T
        terms = np.column_stack([np.ones_like(e), e, n, u, e * e, e * n, n * n, e * u, n * u])
        local = np.asarray(local + (places - terms @ world.T), np.float64)
    return local


def world_of(page: Chromium, local: FloatArray) -> FloatArray:
    """World positions (N, 3) of positions in the page's frame."""
    frame = np.array(json.loads(page.run("JSON.stringify(cityflowView.about.world)")))
    e, n, u = local.T
    found: FloatArray = np.column_stack([np.ones_like(e), e, n, u, e * e, e * n, n * n, e * u, n * u]) @ frame.T
    return found


def over(name: str, z: float, n: int = 12, margin: float = 0.8) -> FloatArray:
    """(n², 3) positions over an outline, inside by `margin`."""
    x0, y0, x1, y1 = town.OUTLINES[name].bounds
    x, y = np.meshgrid(np.linspace(x0 + margin, x1 - margin, n), np.linspace(y0 + margin, y1 - margin, n))
    return np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)])


def colours_at(picture: ByteArray, pixels: FloatArray) -> FloatArray:
    rows, cols = pixels[:, 1].astype(int), pixels[:, 0].astype(int)
    found: FloatArray = picture[rows, cols].astype(np.float64)
    return found


def middle(page: Chromium, name: str, dx: float = 0.0) -> tuple[float, float]:
    shape = town.OUTLINES[name]
    height = town.TOPS.get(name, town.GROUND)
    place = np.array([[shape.centroid.x + dx, shape.centroid.y, height + (3.0 if dx < 0 else 0.0)]])
    x, y = on_page(page, place)[0]
    return float(x), float(y)


def check(page: Chromium, element: str) -> None:
    page.run(f"document.getElementById({element!r}).click()")
    page.wait(SETTLED)


def differing(a: ByteArray, b: ByteArray) -> int:
    return int((np.abs(a.astype(int) - b.astype(int)).max(axis=2) > 12).sum())


def canvas(page: Chromium) -> ByteArray:
    """What the page shows beside its panels: legend and status lines do not count."""
    return page.picture()[60:760, 245:]

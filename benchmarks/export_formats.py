"""What writing costs: seconds per 1,000 buildings in each format, beside the standard library's JSON on the same lines.

Run it on an idle machine: ``python benchmarks/export_formats.py [BUILDINGS]``. Each building has 18 faces at each of
three levels of detail, one of them with a court, and 30 attributes; every figure is the best of three runs on one core.
Textured, every face of the finest level but the floor has a place on one of some pages, and says how it is founded.
"""

from __future__ import annotations

import io
import json
import sys
import time
from collections.abc import Callable

import numpy as np
from shapely import Polygon

from cityflow.core.building import Building, Lod, RoofPlane, Semantic
from cityflow.core.texture import BuildingTexture, FaceFigures, FaceKey, FaceTexture, TexturePage, TextureSet
from cityflow.io.city_models.appearance import Appearance
from cityflow.io.city_models.citygml import write_citygml
from cityflow.io.city_models.cityjson import Transform, feature_line, read_feature
from cityflow.io.city_models.cityjson_sequence import extent_of
from cityflow.io.city_models.obj import write_obj
from cityflow.io.crs import resolve
from cityflow.io.tables.outlines_gpkg import outline_layer, unit_layer, write_geopackage
from cityflow.reconstruction.extruded import extrude

RUNS = 3
REFERENCE = resolve("EPSG:7415")


def building(number: int) -> Building:
    """A block of twelve outer walls around a court of four."""
    centre = np.array([84000.0 + 30 * (number % 100), 447000.0 + 30 * (number // 100)])
    turns = np.arange(12) * np.pi / 6
    ring = centre + np.column_stack([np.cos(turns), np.sin(turns)]) * (8 + (np.arange(12) % 2))[:, None]
    court = centre + np.array([(-2, -2), (-2, 2), (2, 2), (2, -2)])
    footprint = Polygon(np.round(ring, 4), [np.round(court, 4)])
    solids = {lod: extrude(footprint, 0.0, top) for lod, top in ((Lod.LOD12, 9.0), (Lod.LOD13, 9.5), (Lod.LOD22, 10.0))}
    attributes = {f"attribute_{i}": number * 1.1 + i for i in range(30)}
    plane = RoofPlane(0.0, 0.0, 10.0, (centre[0], centre[1]), 500, 0.03)
    return Building(f"{number:016d}", footprint, 0.0, solids, (plane,), attributes)


def textures(city: list[Building], rectified: bool) -> Appearance:
    """A hundred buildings to a page."""
    pages = tuple(
        TexturePage(f"products/textures/{i}.png", 8192, 8192, "image/png") for i in range(len(city) // 100 + 1)
    )
    known = {b.id: texture(b, number // 100, rectified) for number, b in enumerate(city)}
    return Appearance("products/city", TextureSet(rectified, pages, known))


def texture(building: Building, page: int, rectified: bool) -> BuildingTexture:
    rng = np.random.default_rng(page)
    figures = FaceFigures(0.05, 12.3, 40, 3, 0.25, 0.1)
    faces: dict[FaceKey, FaceTexture] = {}
    for i, face in enumerate(building.solids[Lod.LOD22].faces):
        if face.semantic is not Semantic.GROUND:
            rings = [rng.random((len(ring), 3)) for ring in face.rings]
            distance = [0.0, 0.0, 1.0] if rectified else [0.0, 0.0, 500.0]
            faces["solid", i] = FaceTexture(page, tuple(r * [1, 1, not rectified] + distance for r in rings), figures)
    return BuildingTexture(faces)


def best(function: Callable[[], object]) -> float:
    """Seconds of the fastest run."""
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def main(count: int) -> None:
    city = [building(i) for i in range(count)]
    lines = [feature_line(b) for b in city]
    write_obj("warm", city[:2], REFERENCE, Transform())
    raw, straight = textures(city, rectified=False), textures(city, rectified=True)
    work: dict[str, Callable[[], object]] = {
        "reference: json.loads and json.dumps of the lines": lambda: [json.dumps(json.loads(line)) for line in lines],
        "CityJSONSeq, written": lambda: [feature_line(b) for b in city],
        "CityJSONSeq, read": lambda: [read_feature(line) for line in lines],
        "CityJSONSeq, textured": lambda: [feature_line(b, appearance=straight) for b in city],
        "CityGML": lambda: write_citygml(io.BytesIO(), city, REFERENCE, extent_of(city)),
        "CityGML, textured": lambda: write_citygml(io.BytesIO(), city, REFERENCE, extent_of(city), appearance=straight),
        "OBJ": lambda: write_obj("city", city, REFERENCE, Transform()),
        "OBJ, textured (triplets)": lambda: write_obj("city", city, REFERENCE, Transform(), appearance=raw),
        "GeoPackage": lambda: write_geopackage([outline_layer([]), unit_layer(city)], REFERENCE),
    }
    seconds = {name: best(function) * 1000 / count for name, function in work.items()}
    reference = next(iter(seconds.values()))
    for name, value in seconds.items():
        print(f"{name:<52} {value:6.2f} s per 1,000 buildings   {value / reference:5.1f} x")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)

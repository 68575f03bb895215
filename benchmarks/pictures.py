"""Pictures of a run's city, to be looked at: plan by roof aspect, oblique views, DSM and DTM shaded.

python benchmarks/pictures.py RUN FOLDER
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import rasterio
from matplotlib.collections import PolyCollection
from matplotlib.colors import LightSource, hsv_to_rgb

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_normals, triangulate
from cityflow.io.city_models.cityjson import Transform, read_feature

mpl.use("Agg")
SUN = np.array([-0.5, -0.6, 0.62])


def read_city(run: Path) -> list[Building]:
    header, *lines = (run / "products" / "city.city.jsonl").read_bytes().splitlines()
    transform = Transform.of_header(json.loads(header))
    return [read_feature(line, transform) for line in lines if b'"TINRelief"' not in line]


def colours(solid: Polyhedron) -> FloatArray:
    """(F, 3): roofs by aspect (hue) and slope (saturation), walls grey, party walls orange; shaded by the sun."""
    normals = face_normals(solid)
    light = 0.45 + 0.55 * np.clip(normals @ SUN / np.linalg.norm(SUN), 0, 1)
    hue = np.degrees(np.arctan2(normals[:, 0], normals[:, 1])) % 360 / 360
    slope = np.clip(np.hypot(normals[:, 0], normals[:, 1]) * 1.2, 0, 0.8)
    roof = np.array([f.semantic is Semantic.ROOF for f in solid.faces])
    party = np.array([f.neighbour is not None for f in solid.faces])
    rgb = np.where(roof[:, None], hsv_to_rgb(np.column_stack([hue, slope, np.full(len(hue), 0.95)])), 0.82)
    rgb = np.where(party[:, None], [1.0, 0.6, 0.2], rgb)
    return np.asarray(np.clip(rgb * light[:, None], 0, 1))


def plan(buildings: list[Building], path: Path) -> None:
    figure, axes = plt.subplots(figsize=(16, 13))
    for building in buildings:
        solid = building.solids[Lod.LOD22]
        roofs = [i for i, f in enumerate(solid.faces) if f.semantic is Semantic.ROOF]
        rings = [solid.ring(solid.faces[i].rings[0])[:, :2] for i in roofs]
        axes.add_collection(PolyCollection(rings, facecolors=colours(solid)[roofs], edgecolors="black", linewidths=0.4))
        x, y = building.footprint.exterior.xy
        axes.plot(x, y, color="red" if building.status != "done" else "black", linewidth=0.9)
    axes.set_aspect("equal")
    axes.autoscale()
    figure.savefig(path, dpi=90, bbox_inches="tight")
    plt.close(figure)


def oblique(buildings: list[Building], path: Path, azimuth: float, elevation: float = 35) -> None:
    """Faces of all buildings seen from a direction (degrees), by parallel projection, the nearest drawn last."""
    polygons, shades, depths = [], [], []
    view = view_from(azimuth, elevation)
    for building in buildings:
        solid = building.solids[Lod.LOD22]
        mesh, rgb, normals = triangulate(solid), colours(solid), face_normals(solid)
        for number, face in enumerate(solid.faces):
            if normals[number] @ view[2] <= 0:
                continue
            rings = (
                [solid.ring(face.rings[0])]
                if len(face.rings) == 1
                else list(mesh.vertices[mesh.triangles[mesh.faces == number]])
            )
            polygons += [ring @ view[:2].T for ring in rings]
            depths += [float((ring @ view[2]).max()) for ring in rings]
            shades += [rgb[number]] * len(rings)
    order = np.argsort(depths, kind="stable")
    figure, axes = plt.subplots(figsize=(16, 9))
    drawn = PolyCollection(
        [polygons[i] for i in order], facecolors=[shades[i] for i in order], edgecolors="#333333", linewidths=0.3
    )
    axes.add_collection(drawn)
    axes.set_aspect("equal")
    axes.autoscale()
    axes.set_axis_off()
    figure.savefig(path, dpi=80, bbox_inches="tight", pad_inches=0.05)
    plt.close(figure)


def view_from(azimuth: float, elevation: float) -> FloatArray:
    """(3, 3) rows: right, up, towards the viewer, who stands in direction `azimuth` (degrees from x) at `elevation`."""
    a, e = np.radians(azimuth), np.radians(elevation)
    towards = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def shaded(run: Path, name: str, path: Path) -> None:
    """A raster of the run, hillshaded."""
    with rasterio.open(run / "products" / f"{name}.vrt") as data:
        heights = data.read(1)
    relief = LightSource(azdeg=315, altdeg=45).hillshade(np.nan_to_num(heights, nan=np.nanmin(heights)), dx=0.5, dy=0.5)
    plt.imsave(path, relief[::1, ::1], cmap="gray")


def main(run: Path, folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    buildings = read_city(run)
    plan(buildings, folder / "plan.png")
    for azimuth in (-60, 30, 120, 210):
        oblique(buildings, folder / f"oblique_{azimuth % 360}.png", azimuth)
    for name in ("dsm", "dtm"):
        shaded(run, name, folder / f"{name}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))

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
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Building, Lod, Polyhedron, Semantic
from cityflow.geometry.polyhedron import face_normals, triangulate
from cityflow.io.cityjson import Transform, read_feature

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
    """Faces of all buildings seen from a direction (degrees)."""
    triangles, shades = [], []
    for building in buildings:
        solid = building.solids[Lod.LOD22]
        mesh, rgb = triangulate(solid), colours(solid)
        triangles.append(mesh.vertices[mesh.triangles])
        shades.append(rgb[mesh.faces])
    corners = np.concatenate(triangles)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    figure = plt.figure(figsize=(16, 11))
    axes = figure.add_subplot(projection="3d", computed_zorder=True)
    axes.add_collection3d(
        Poly3DCollection(corners - low, facecolors=np.concatenate(shades), edgecolors="none", zsort="average")
    )
    for axis, size in zip("xyz", high - low, strict=True):
        getattr(axes, f"set_{axis}lim")(0, size)
    axes.set_box_aspect(tuple(high - low))
    axes.view_init(elev=elevation, azim=azimuth)
    axes.set_axis_off()
    figure.savefig(path, dpi=90, bbox_inches="tight")
    plt.close(figure)


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

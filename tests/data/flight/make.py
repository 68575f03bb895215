"""Make the files of this folder: a flight of fifteen small pictures over some houses, with the truth beside it; see README.md."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.arrays import FloatArray
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Grid
from cityflow.io.crs import resolve
from cityflow.io.images.image_write import jpeg_bytes
from cityflow.io.orientation.colmap import write_colmap
from cityflow.io.tables.outlines_gpkg import Layer, write_geopackage
from cityflow.synthetic.caster import Scene
from cityflow.synthetic.flight import FlightParameters, Head, head_rotation, small_rotation
from cityflow.synthetic.render import RenderParameters, render
from cityflow.synthetic.town import Town, TownParameters, make_town
from cityflow.synthetic.town_truth import judged_cells, truth_rasters

SEED = 7
CENTRE = (85050.0, 447025.0)
HALF_M = 17.0
"""Half of the patch that every place of is seen from all sides."""
TOWN = TownParameters(
    origin_x=CENTRE[0] - 120, origin_y=CENTRE[1] - 112, width_m=240, height_m=240, relief=0.3, park_share=0.0,
    street_tree_share=0.1, car_share=0.1,
)  # fmt: skip
NADIR, NORTHWARD = Head(), Head(name="north", direction="forward", tilt_deg=45, focal_factor=1.4)
FLIGHT = FlightParameters(gsd_m=0.125, width_px=320, height_px=240, heads=(NADIR, NORTHWARD))
NADIR_PLACES = [(dx, dy) for dy in (-6.5, 0.0, 6.5) for dx in (-10.0, 0.0, 10.0)]
OBLIQUE_PLACES = [(dx, dy) for dy in (-4.0, 4.0) for dx in (-10.0, 0.0, 10.0)]
TRUTH_CELL_M, TIE_STEP_M = 0.2, 4.0
JPEG_QUALITY = 88


def images(ground: float) -> list[OrientedImage]:
    """Nadir views on a lattice, and oblique ones that look north from where their middle is on another."""
    rng = np.random.default_rng(SEED)
    height = FLIGHT.flying_height_m
    back = height * np.tan(np.radians(NORTHWARD.tilt_deg))
    plan = [(f"n{i}", NADIR, x, y) for i, (x, y) in enumerate(NADIR_PLACES)]
    plan += [(f"o{i}", NORTHWARD, x, y - back) for i, (x, y) in enumerate(OBLIQUE_PLACES)]
    made = []
    for name, head, x, y in plan:
        centre = np.array([CENTRE[0] + x, CENTRE[1] + y, ground + height]) + rng.normal(0, 0.4, 3)
        rotation = head_rotation(head, 0.0) @ small_rotation(rng.normal(0, np.radians(0.5), 3))
        made.append(OrientedImage(name, FLIGHT.camera(head), rotation, centre))
    return made


def tie_points(town: Town) -> FloatArray:
    """(N, 3) points on the ground and on roofs, as an aerotriangulation leaves them."""
    lattice = np.arange(-40, 40, TIE_STEP_M) + TIE_STEP_M / 2
    x, y = (a.ravel() for a in np.meshgrid(CENTRE[0] + lattice, CENTRE[1] + lattice))
    free = ~shapely.contains_xy(shapely.union_all([u.roof_outline for u in town.units]), x, y)
    ground = np.column_stack([x, y, town.dtm(x, y)])[free]
    faces = [face for unit in town.units for face in unit.roof_planes]
    places = shapely.get_coordinates([f.polygon.representative_point() for f in faces])
    roofs = np.column_stack([places, [float(f.plane.z(*p)) for f, p in zip(faces, places, strict=True)]])
    near = np.abs(roofs[:, :2] - CENTRE).max(axis=1) < 40
    return np.round(np.concatenate([ground, roofs[near]]), 3)


def main(folder: Path) -> None:
    town = make_town(SEED, TOWN)
    patch = shapely.box(*(c - HALF_M for c in CENTRE), *(c + HALF_M for c in CENTRE))
    inside = [u for u in town.units if patch.contains(u.wall_outline)]
    ground = float(town.dtm(np.array([CENTRE[0]]), np.array([CENTRE[1]]))[0])
    flown = images(ground)
    (folder / "images").mkdir(parents=True, exist_ok=True)
    scene = Scene(town.mesh())
    for image in flown:
        pixels = render(scene, image, RenderParameters(), SEED)
        (folder / "images" / f"{image.name}.jpg").write_bytes(jpeg_bytes(pixels, JPEG_QUALITY))
    named = [replace(i, name=f"{i.name}.jpg") for i in flown]
    write_colmap(folder / "sparse", named, tie_points(town), (*CENTRE, 0.0))
    layer = Layer("outlines", [u.wall_outline for u in inside], [{"id": u.id} for u in inside])
    (folder / "outlines.gpkg").write_bytes(write_geopackage([layer], resolve("EPSG:7415")))
    grid = Grid.covering(patch.bounds, TRUTH_CELL_M)
    truth = truth_rasters(town, grid)
    judged = judged_cells(truth)
    np.savez_compressed(
        folder / "truth.npz", bounds=np.array(grid.bounds), dsm=truth.dsm.astype(np.float32), dtm=truth.dtm.astype(np.float32),
        open_cells=judged.open_cells,
    )  # fmt: skip


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)

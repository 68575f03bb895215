"""Compile once what numba compiles, on a small synthetic town: houses found and made, and pictures matched, fused and laid over their surface.

Otherwise the first tasks of the first run wait for it.
"""

from __future__ import annotations

import gc
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numba
import numpy as np
import shapely
from numba.core.compiler import Flags
from shapely import Polygon

from cityflow.adjustment.descriptor_matching import MatchingParameters
from cityflow.adjustment.features import Features
from cityflow.adjustment.guided_matching import guided_matches
from cityflow.core.arrays import Float32Array, FloatArray
from cityflow.core.camera import Camera, OrientedImage
from cityflow.core.colour_image import ColourImage
from cityflow.core.depth_map import DepthMap, joined, standing_points
from cityflow.core.facade_points import WallPoints
from cityflow.core.grid import Grid
from cityflow.core.ground_cells import GroundCells
from cityflow.core.local_frame import LocalFrame
from cityflow.core.pixels import ArrayPixels
from cityflow.core.points import PointCloud
from cityflow.core.reconstruction import Evidence
from cityflow.core.splitting import FrameRasters, SplitEvidence
from cityflow.flow.store import Store
from cityflow.flow.workspace import Workspace
from cityflow.geometry.textured_view import TexturedTriangles
from cityflow.handover.depth_map_files import decode_depth_map, encode_depth_map
from cityflow.io.images.image_tiles import Strips, tile_strips
from cityflow.io.points.las_image_points import write_image_points
from cityflow.matching.match import MatchParameters, match
from cityflow.outlines.find_outlines import FindParameters, RegionSurface, find_outlines
from cityflow.outlines.from_images.photographed import Photographed
from cityflow.outlines.from_walls.covered_points import find_covered_points
from cityflow.outlines.from_walls.wall_points import WallPointParameters, find_wall_points
from cityflow.outlines.under_eaves.facades_inside import SeenHouses
from cityflow.outlines.under_eaves.found_walls import found_walls_in, seen_in
from cityflow.outlines.under_eaves.walls_in import WallsInParameters
from cityflow.reconstruction.extruded import extrude
from cityflow.reconstruction.measures import measure
from cityflow.reconstruction.model import ModelParameters
from cityflow.reconstruction.verdicts.judge import judged_model
from cityflow.runs.known_keys import CITY, SYNTH, known_keys
from cityflow.splitting.split import SplitParameters, split
from cityflow.stages.synth import SynthSource, run_picture
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.surface.image_surface import image_surface
from cityflow.surface.ortho_visibility import BlockingSurface
from cityflow.surface.point_classes import classify_points
from cityflow.surface.sample import sample
from cityflow.surface.tile_surface import surface_of_tile
from cityflow.surface.true_ortho import true_ortho
from cityflow.surface.witnesses import Witness, WitnessParameters, words_for
from cityflow.synthetic.flight_presets import preset
from cityflow.synthetic.town import TownParameters, make_town
from cityflow.synthetic.town_lidar import town_lidar
from cityflow.texture.placement.place import place
from cityflow.texture.planes import face_planes
from cityflow.texture.unit import Surroundings, TextureParameters, texture_unit
from cityflow.viewer.model_view import draw_models, surfaces_of, terrain_surfaces
from cityflow.viewer.side_view import draw_side, side_camera
from cityflow.windows.find_windows import find_unit_windows
from cityflow.windows.window_parameters import WindowParameters

HOUSES = 4
METHODS = ("orientation_histogram", "volumetric", "roof_types", "primitives", "monolithic")
CELL_M = 0.125


def reconstruct_houses() -> None:
    town = make_town(1, TownParameters(width_m=100, height_m=100))
    scan = town_lidar(town, 1)
    for unit in town.units[: 3 * HOUSES : 3]:
        points = scan.points.take(np.flatnonzero(scan.truth_unit == unit.index))
        evidence = Evidence(unit.id, unit.wall_outline, points, float(points.xyz[:, 2].min()), around=points)
        for methods in (("orientation_histogram",), METHODS):
            judged = judged_model(evidence, ModelParameters(methods=methods))
            measure(judged.choice, evidence, judged.fit)


def photographs() -> list[ColourImage]:
    """Three views of a textured plain."""
    texture = (
        np.random.default_rng(1).integers(40, 215, (60, 128, 3)).astype(np.uint8).repeat(4, axis=0).repeat(4, axis=1)
    )
    camera, upright = Camera(320, 240, 450.0, 450.0, 160.0, 120.0), np.diag([1.0, -1.0, -1.0])
    views = [OrientedImage(f"view{i}", camera, upright, np.array([42.0 + 8 * i, 50.0, 60.0])) for i in range(3)]
    pixels = [ArrayPixels(np.ascontiguousarray(texture[:, 60 * i : 60 * i + 320])) for i in range(3)]
    return [ColourImage(view, own) for view, own in zip(views, pixels, strict=True)]


def match_pictures() -> None:
    """Match and fuse, and lay the ortho over what comes of it, in arrays of the kinds that a run has."""
    left, middle, right = images = photographs()
    cells = GroundCells((0.0, 0.0, 100.0, 100.0), 10.0, tuple((c, r) for c in range(3, 7) for r in range(3, 7)))
    partners = [(left.image, left.pixels), (right.image, right.pixels)]
    made: dict[str, DepthMap] = {}
    match(middle.image, middle.pixels, partners, {"": cells}, (-5.0, 12.0), MatchParameters(), made.__setitem__)
    assert made, "the plain was not matched"
    found = decode_depth_map(encode_depth_map(made[""]))
    everywhere, seen_once = (-1e3, -1e3, 1e3, 1e3), np.isfinite(found.depth).astype(np.uint8)
    points = standing_points(found, seen_once, middle.image, everywhere)
    lens = replace(middle.image.camera, distortion=(0.01, -0.001, 0.0, 0.0))
    standing_points(found, seen_once, replace(middle.image, camera=lens), everywhere)
    lens.distort(np.zeros((1, 2)))
    # the plain stood on its edge is a wall
    upright = replace(points, xyz=np.ascontiguousarray(points.xyz[:, [0, 2, 1]]))
    assert len(find_wall_points(upright, WallPointParameters()).xyz), "the wall was not found"
    seen = [Witness.of(view.image, [found]) for view in images]
    words_for(seen, cells.bounds, WitnessParameters())
    slanting = replace(points, names=("aside",), centres=points.centres + np.array([60.0, 0.0, 0.0]))
    surface = image_surface(joined([points, slanting]), (40.0, 40.0, 60.0, 60.0), CELL_M, 4)
    floating = joined([points, replace(points, xyz=points.xyz + np.array([0.0, 0.0, 15.0]))])
    find_covered_points(replace(floating, views=np.full_like(floating.views, 2)))
    write_image_points(floating, classify_points(floating, surface))
    heights, grid = surface.fine.dsm_filled.astype(np.float32), surface.fine.grid
    sample(grid, heights, np.array([50.0]), np.array([50.0]))
    true_ortho(grid, heights, BlockingSurface(grid, heights), images)


def tile_picture() -> None:
    """A picture of two strips with its pyramid."""
    pixels = np.zeros((600, 520, 3), np.uint8)
    with TemporaryDirectory() as folder:
        tile_strips(Strips(600, 520, 3, "uint8", [(0, pixels[:512]), (512, pixels[512:])]), Path(folder) / "image.tif")


def tie_pictures() -> None:
    """Points of two photographs that show the same."""
    one, other = (view.image for view in photographs()[:2])
    uv = np.array([(100.0, 120.0), (200.0, 120.0)])
    same = Features(uv, np.full(2, 3.0, np.float32), np.eye(2, 128, dtype=np.uint8))
    guided_matches((one, other), (same, same), (-1.0, 1.0), 12.0, MatchingParameters())


def paint_house() -> None:
    """Textures, windows and pictures of a house on the plain."""
    grid = Grid(40.0, 60.0, CELL_M, 160, 160)
    heights = np.zeros(grid.shape, np.float32)
    house = extrude(shapely.box(46.0, 46.0, 54.0, 54.0), -2.0, 4.0)
    made = texture_unit(
        face_planes(house, None),
        photographs(),
        Surroundings([house], [], heights.astype(np.float64), grid),
        TextureParameters(),
    )
    assert made.texture.raw, "the house got no texture"
    place([p.mask for p in made.texture.raw])
    find_unit_windows(face_planes(house, None), {p.key: p for p in made.texture.rectified}, WindowParameters())
    draw_models(surfaces_of([house]), terrain_surfaces(heights, grid), 200)
    corners = np.array([(44.0, 45.0, 0.0), (56.0, 45.0, 0.0), (56.0, 45.0, 9.0)])
    page, uvd = np.zeros((8, 8, 3), np.uint8), np.array([(0.1, 0.1, 1.0), (0.9, 0.1, 1.0), (0.9, 0.9, 1.0)])
    wall = TexturedTriangles(corners, uvd, np.array([(0, 1, 2)]), np.array([0]), np.array([(90, 90, 90)]), [page])
    draw_side(wall, side_camera(np.array([50.0, 45.0, 3.0]), 60.0, 0.0))


def split_row() -> None:
    """A row of houses whose roofs differ, cut by what pictures show of it, and by points."""
    outline, grid = shapely.box(2.0, 2.0, 32.0, 12.0), Grid(0.0, 14.0, 0.25, 56, 136)
    x, y = grid.centres()
    inside, odd = shapely.contains_xy(outline, x, y), x // 6.0 % 2
    noise = np.random.default_rng(1).normal(0.0, 0.02, x.shape)
    dsm = (np.where(inside, 8.0 + 0.7 * odd, 0.0) + noise).astype(np.float32)
    grey, nadir = (60 + 80 * odd).astype(np.uint8), LocalFrame("nadir", np.eye(3), np.zeros(3))
    pictures = FrameRasters(nadir, grid, dsm, np.stack([grey] * 3), np.ones(grid.shape, bool))
    points = PointCloud.of(np.column_stack([x[inside], y[inside], dsm[inside].astype(np.float64)]))
    for frame, cloud in ((pictures, None), (FrameRasters(nadir, grid, dsm), points)):
        found = split(SplitEvidence("row", outline, (frame,), 0.0, cloud), SplitParameters())
        assert len(found.units) > 1, "the row was not cut"


def find_house() -> None:
    """The outline of an angled house in its heights and façades, as pictures show them, and in the points of a laser."""
    house = Polygon([(10.0, 10.0), (24.0, 10.0), (24.0, 16.0), (17.0, 16.0), (17.0, 22.0), (10.0, 22.0)])
    grid, rng = Grid.covering((0.0, 0.0, 34.0, 32.0), 0.4), np.random.default_rng(1)
    x, y = rng.uniform((0.0, 0.0), (34.0, 32.0), (12000, 2)).T
    scan = np.column_stack(
        [x, y, np.where(shapely.contains_xy(house, x, y), 6.0, 0.0) + rng.normal(0.0, 0.02, x.shape)]
    )
    facades, normals = _facades(house, rng)
    cloud = np.concatenate([scan, facades])
    scanned = surface_of_tile(PointCloud.of(cloud), grid.bounds, 0.0)
    ndsm = np.where(shapely.contains_xy(house, *grid.centres()), 6.0, 0.0).astype(np.float32)
    walls = WallPoints(facades, normals, np.full(len(facades), 0.05, np.float32), np.full(len(facades), 3, np.uint8))
    for surface in (
        RegionSurface(grid, ndsm, np.where(ndsm > 2, 6, 2).astype(np.uint8), np.zeros(grid.shape, bool), grid.bounds,
                      np.ones(grid.shape, np.uint32), walls, np.zeros(grid.shape, np.float32), highest=False,
                      photographed=Photographed(photographs(), lambda _: (grid, ndsm))),
        RegionSurface(scanned.grid, scanned.ndsm, scanned.klass, scanned.holes, grid.bounds, scanned.count.astype(np.uint32), None, scanned.dtm),
    ):  # fmt: skip
        found = find_outlines(surface, FindParameters())
        assert len(found) == 1, "the house was not found"
        found_walls_in(found, seen_in(surface) or SeenHouses.of(cloud, None), WallsInParameters())


def _facades(house: Polygon, rng: np.random.Generator) -> tuple[FloatArray, Float32Array]:
    """Points on the walls of a house, and which way each looks."""
    xyz, normals = [], []
    for a, b in pairwise(shapely.get_coordinates(shapely.orient_polygons(house))):
        along = (b - a) / np.hypot(*(b - a))
        s, z = np.meshgrid(np.arange(0.05, np.hypot(*(b - a)), 0.1), np.arange(0.1, 5.9, 0.1))
        normal = np.array([along[1], -along[0]])
        plan = a + s.reshape(-1, 1) * along + rng.normal(0.0, 0.03, (s.size, 1)) * normal
        xyz.append(np.column_stack([plan, z.ravel()]))
        normals.append(np.tile(normal, (s.size, 1)))
    return np.concatenate(xyz), np.concatenate(normals).astype(np.float32)


def render() -> None:
    """A picture of a synthetic town, as the demonstration takes them."""
    flight = preset("nadir", width_px=96, height_px=64, gsd_m=0.3)
    task = next(iter(SynthSource(SynthParameters(size=(20.0, 20.0), flight=flight)).initial()))
    with TemporaryDirectory() as folder:
        run_picture(Workspace(Store.open(folder), task), task)


def compile_plainly() -> None:
    """Leave out what costs time and no kernel wants: of its own functions numba makes forms for Python and for C, too, which nobody calls."""
    gc.disable()
    numba.config.DISABLE_ERROR_MESSAGE_HIGHLIGHTING = 1
    for name in ("no_cpython_wrapper", "no_cfunc_wrapper"):
        Flags.options[name]._default = True
    # asked for wherever one function calls another; numba would ask each of its thirty options for its default again
    defaults = {name: option.default for name, option in Flags.options.items()}
    Flags.values = lambda flags: {**defaults, **flags._values}


if __name__ == "__main__":
    # the longest first; a house is painted when the first has compiled what both want
    with ProcessPoolExecutor(2, initializer=compile_plainly) as pool:
        for part in [
            pool.submit(p)
            for p in (
                reconstruct_houses,
                match_pictures,
                tile_picture,
                tie_pictures,
                find_house,
                split_row,
                paint_house,
                render,
            )
        ]:
            part.result()
    for of in (CITY, SYNTH):
        known_keys(of)  # so that the first typing error is answered at once

"""Single houses of known roof type with a drawn ortho and surface model: cheap enough to judge hundreds.

The ortho has Lambert's shading under a drawn sun, shadows, texture, chimneys and blur; the surface model is the truth averaged
over cells of any size, with the noise of image matching, in whole metres if asked for, as national surveys store them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from scipy.ndimage import gaussian_filter, map_coordinates
from shapely import Polygon

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.reconstruction import HeightRaster, Picture
from cityflow.core.roof_type_names import RoofType
from cityflow.synthetic import roofs
from cityflow.synthetic.roofs import CHIMNEY, DORMER, Placement, TruthFace
from scenes.house_shapes import SHAPES

FINE_M = 0.125
RIM_M = 5.0
SIMPLE = ("flat", "shed", "gable", "gable off", "hip", "half-hip", "pyramid")
COMPLEX = ("L gable", "T gable", "L hip", "gable dormers")
BEYOND = ("mansard", "butterfly", "sawtooth", "cone")
DORMERED = ("level dormers", "shed dormers", "gabled dormers")
TYPES = {
    "level dormers": RoofType.GABLE, "shed dormers": RoofType.GABLE, "gabled dormers": RoofType.GABLE,
    "gable off": RoofType.GABLE, "L gable": RoofType.GABLE, "T gable": RoofType.GABLE, "L hip": RoofType.HIP, "gable dormers": RoofType.GABLE,
}  # fmt: skip
"""Roof type of shapes that are not named by it."""


@dataclass(frozen=True)
class DrawnHouse:
    """One house.

    Attributes
    ----------
    shape : name of the shape;  type : its roof type
    outline : walls, world metres
    faces : visible roof faces, without overlap
    grid : of the fine rasters, cells of `FINE_M`
    height : (rows, cols) metres, house and ground;  ground : terrain
    normal : (rows, cols, 2) slope in x and y
    albedo : (rows, cols, 3) colours, 0 to 1
    """

    shape: str
    type: RoofType
    outline: Polygon
    faces: tuple[TruthFace, ...]
    grid: Grid
    height: FloatArray
    ground: float
    slope: FloatArray
    albedo: FloatArray
    seed: int = 0
    prisms: tuple[TruthFace, ...] = field(default=(), repr=False)

    def ortho(self, epoch: int = 0, cell: float = 0.25, lean: tuple[float, float] = (0.0, 0.0)) -> Picture:
        """The house under the sun of an epoch; `lean` is the displacement per metre of height of a plain ortho."""
        rng = np.random.default_rng([self.seed, 77, epoch])
        azimuth, elevation = rng.uniform(0.55 * np.pi, 1.45 * np.pi), np.radians(rng.uniform(28, 58))
        sun = np.array([np.sin(azimuth) * np.cos(elevation), np.cos(azimuth) * np.cos(elevation), np.sin(elevation)])
        gx, gy = self.slope[..., 0], self.slope[..., 1]
        lambert = np.clip((-gx * sun[0] - gy * sun[1] + sun[2]) / np.sqrt(1 + gx**2 + gy**2), 0, 1)
        lit = ~_shadow(self.height, sun)
        light = 0.38 + 0.62 * lambert * lit
        grey = _texture(rng, self.height.shape)
        colour = self.albedo * (light * grey)[..., None] * rng.uniform(0.8, 1.15)
        if any(lean):
            colour = leaning(colour, self.height - self.ground, FINE_M, lean)
        return Picture(*_pixels(colour, self.grid, cell, rng), not any(lean), f"epoch {epoch}")

    def heights(self, cell: float, noise: float = 0.35, whole_metres: bool = True, epoch: int = 0) -> HeightRaster:
        """Surface model: means over cells, blurred as by matching, with correlated noise bounded by three sigma."""
        rng = np.random.default_rng([self.seed, 78, epoch, round(cell * 100)])
        smooth = gaussian_filter(self.height, 0.3 / FINE_M) if noise > 0.1 else self.height
        grid = Grid.covering(self.grid.bounds, cell)
        grid = Grid(grid.x_min, grid.y_max, cell, grid.rows, grid.cols)
        z = _cell_means(smooth, self.grid, grid)
        error = gaussian_filter(rng.normal(0, 1, z.shape), 0.5 / cell) if cell < 1 else rng.normal(0, 1, z.shape)
        z = z + np.clip(noise * error / max(float(error.std()), 1e-9), -3 * noise, 3 * noise)
        above = z - self.ground
        dsm = self.ground + (np.round(above) if whole_metres else above)
        return HeightRaster(grid, dsm, np.full(z.shape, self.ground))


def drawn_house(shape: str, seed: int) -> DrawnHouse:
    """A house of a shape with everything else drawn from the seed."""
    rng = np.random.default_rng([seed, sum(map(ord, shape))])
    volumes = SHAPES[shape](rng)
    place = Placement(
        float(rng.uniform(84000, 86000)), float(rng.uniform(446000, 448000)), float(rng.uniform(0, 2 * np.pi)), float(rng.uniform(0, 60))
    )  # fmt: skip
    prisms = tuple(place.face(f) for v in volumes for f in v.faces)
    grounded = shapely.union_all([Polygon(v.ring) for v in volumes if v.bottom is None], grid_size=1e-6)
    ring = np.asarray(shapely.geometry.polygon.orient(grounded.simplify(1e-4)).exterior.coords)[:-1]
    outline = Polygon(np.round(place.to_world([tuple(p) for p in ring]), 3))
    ground = place.z
    grid = Grid.covering(_grown(outline.buffer(1.0).bounds, RIM_M), FINE_M)
    height, slope, top = _cast(prisms, grid, ground)
    albedo = _albedo(rng, prisms, top)
    kind = TYPES.get(shape) or RoofType(shape)
    return DrawnHouse(
        shape, kind, outline, roofs.visible_faces(prisms), grid, height, ground, slope, albedo, seed, prisms
    )


def dormer_outlines(house: DrawnHouse) -> list[Polygon]:
    """Where dormers stand out of the roof, one polygon each."""
    faces = [f.polygon.buffer(1e-3, join_style="mitre") for f in house.faces if f.kind == DORMER]
    # Both halves of a gable meet their slope in a point far behind the eaves: thin tips are left out.
    united = shapely.union_all(faces, grid_size=1e-4).buffer(-0.05, join_style="mitre").buffer(0.05, join_style="mitre")
    return [p for p in shapely.get_parts(united) if p.geom_type == "Polygon" and p.area > 0.5]


def disturbed(outline: Polygon, rng: np.random.Generator, rmse: float) -> Polygon:
    """Every corner moved by a normal error; `rmse` is that of the corners' distances, metres."""
    ring = np.asarray(outline.exterior.coords)[:-1]
    while True:
        other = Polygon(np.round(ring + rng.normal(0, rmse / np.sqrt(2), ring.shape), 4))
        if other.is_valid and other.area > 0.5 * outline.area:
            return shapely.geometry.polygon.orient(other)


def _grown(bounds: tuple[float, float, float, float], by: float) -> tuple[float, float, float, float]:
    return bounds[0] - by, bounds[1] - by, bounds[2] + by, bounds[3] + by


def _cast(prisms: tuple[TruthFace, ...], grid: Grid, ground: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Height, slope and number of the highest face at every cell centre; −1 for ground."""
    x, y = grid.centres()
    height, slope, top = np.full(x.shape, ground), np.zeros((*x.shape, 2)), np.full(x.shape, -1.0)
    for number, face in enumerate(prisms):
        inside = shapely.intersects_xy(face.polygon, x, y)
        z = face.plane.z(x, y)
        wins = inside & (z > height)
        height[wins], slope[wins], top[wins] = z[wins], (face.plane.slope_x, face.plane.slope_y), number
    return height, slope, top


def _albedo(rng: np.random.Generator, prisms: tuple[TruthFace, ...], top: FloatArray) -> FloatArray:
    roof = [(0.62, 0.33, 0.25), (0.45, 0.27, 0.22), (0.36, 0.37, 0.4), (0.55, 0.52, 0.48)][int(rng.integers(4))]
    ground = [(0.38, 0.44, 0.28), (0.5, 0.49, 0.47), (0.6, 0.56, 0.48)][int(rng.integers(3))]
    albedo = np.where(top[..., None] >= 0, roof, ground)
    for number, face in enumerate(prisms):
        if face.kind == CHIMNEY:
            albedo[top == number] = (0.5, 0.35, 0.3)
    patches = gaussian_filter(rng.normal(0, 1, top.shape), 1.5 / FINE_M)
    paved = (patches > 0.8 * patches.std()) & (top < 0)
    albedo[paved] = (0.55, 0.54, 0.52)
    return np.asarray(albedo, np.float64)


def _shadow(height: FloatArray, sun: FloatArray) -> BoolArray:
    """Cells from which something hides the sun."""
    flat = float(np.hypot(sun[0], sun[1]))
    step = 2.0
    rise, reach = step * FINE_M * sun[2] / flat, int((height.max() - height.min()) * flat / sun[2] / FINE_M / step) + 1
    dark = np.zeros(height.shape, bool)
    rows, cols = height.shape
    for k in range(1, reach + 1):
        dc, dr = round(k * step * sun[0] / flat), round(-k * step * sun[1] / flat)
        if abs(dc) >= cols or abs(dr) >= rows:
            break
        here = slice(max(-dr, 0), rows - max(dr, 0)), slice(max(-dc, 0), cols - max(dc, 0))
        there = slice(max(dr, 0), rows + min(dr, 0)), slice(max(dc, 0), cols + min(dc, 0))
        dark[here] |= height[there] > height[here] + k * rise + 0.05
    return dark


def _texture(rng: np.random.Generator, shape: tuple[int, ...]) -> FloatArray:
    coarse = gaussian_filter(rng.normal(0, 1, shape), 1.0 / FINE_M)
    fine = rng.normal(0, 1, shape)
    return np.asarray(1 + 0.05 * coarse / coarse.std() + 0.12 * fine)


def leaning(colour: FloatArray, above: FloatArray, cell: float, lean: tuple[float, float]) -> FloatArray:
    """What a camera beside sees, brought to the ground: each place shows the highest thing that was displaced to it.

    Parameters
    ----------
    colour : (rows, cols, bands);  above : (rows, cols) metres above the ground, both of cells of `cell` metres
    lean : displacement in x and y per metre of height
    """
    rows, cols = np.indices(above.shape).astype(np.float64)
    best, result = np.full(above.shape, -1.0), colour.copy()
    for level in np.arange(0, above.max() + 0.25, 0.25):
        r, c = rows + lean[1] * level / cell, cols - lean[0] * level / cell
        there = map_coordinates(above, [r, c], order=1, mode="nearest")
        hit = (np.abs(there - level) <= 0.4) & (level >= best)
        r, c = (np.clip(np.round(v), 0, n - 1).astype(np.int64) for v, n in zip((r, c), above.shape, strict=True))
        result[hit], best[hit] = colour[r[hit], c[hit]], level
    return result


def _pixels(colour: FloatArray, grid: Grid, cell: float, rng: np.random.Generator) -> tuple[Grid, ByteArray]:
    part = Grid.covering(grid.bounds, cell)
    inner = Grid(part.x_min + cell, part.y_max - cell, cell, part.rows - 2, part.cols - 2)
    blurred = [gaussian_filter(colour[..., b], 0.5 * cell / FINE_M) for b in range(3)]
    bands = np.stack([_cell_means(b, grid, inner) for b in blurred])
    noisy = 255 * bands + rng.normal(0, 2.5, bands.shape)
    return inner, np.clip(np.round(noisy), 0, 255).astype(np.uint8)


def _cell_means(values: FloatArray, fine: Grid, coarse: Grid) -> FloatArray:
    """Means of fine cells whose centres lie in each coarse cell; what lies outside is the nearest."""
    x, y = fine.x_centres(), fine.y_centres()
    row = np.clip(np.floor((coarse.y_max - y) / coarse.cell), 0, coarse.rows - 1).astype(np.int64)
    col = np.clip(np.floor((x - coarse.x_min) / coarse.cell), 0, coarse.cols - 1).astype(np.int64)
    index = (row[:, None] * coarse.cols + col[None]).ravel()
    n = coarse.rows * coarse.cols
    total, count = np.bincount(index, values.ravel(), n), np.bincount(index, minlength=n)
    return np.asarray((total / np.maximum(count, 1)).reshape(coarse.shape))

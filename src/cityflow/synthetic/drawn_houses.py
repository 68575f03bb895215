"""Single houses of known roof type with a drawn ortho and surface model: cheap enough to judge hundreds.

The ortho has Lambert's shading under a drawn sun, shadows, texture, chimneys and blur; the surface model is the truth averaged
over cells of any size, with the noise of image matching, in whole metres if asked for, as national surveys store them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from scipy.ndimage import gaussian_filter, map_coordinates
from shapely import Polygon

from cityflow.core.arrays import BoolArray, ByteArray, FloatArray
from cityflow.core.grid import Grid
from cityflow.core.reconstruction import HeightRaster, Picture
from cityflow.core.roof_types import RoofType
from cityflow.synthetic import roofs
from cityflow.synthetic import town_shapes as shapes
from cityflow.synthetic.roofs import CHIMNEY, DORMER, LocalFace, Placement, TruthFace, rectangle
from cityflow.synthetic.town_shapes import Overhang, Volume

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


def _size(rng: np.random.Generator) -> tuple[float, float, float, float, Overhang]:
    length, depth = float(rng.uniform(9, 17)), float(rng.uniform(7, 10))
    over = 0.0 if rng.random() < 0.3 else float(rng.uniform(0.1, 0.8))
    return (
        length,
        depth,
        float(rng.uniform(3, 8)),
        float(np.tan(np.radians(rng.uniform(22, 50)))),
        Overhang.all_round(over),
    )


def _chimneys(rng: np.random.Generator, length: float, depth: float, ridge: float, slope: float) -> list[Volume]:
    count = int(rng.integers(0, 3))
    return [
        shapes.chimney(
            float(rng.uniform(0.25, 0.7)) * length,
            depth / 2 + float(rng.choice([-1.3, 0.5])) * float(rng.uniform(0.7, 1.3)),
            ridge + float(rng.uniform(0.3, 0.9)),
            ridge - 2.5 * slope - 0.5,
        )
        for _ in range(count)
    ]


def _flat(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, _, _ = _size(rng)
    return [shapes.flat_roof(rectangle(0, 0, length, depth), eave), *_chimneys(rng, length, depth, eave, 0.1)]


def _shed(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, _, over = _size(rng)
    slope = float(np.tan(np.radians(rng.uniform(8, 25))))
    return [shapes.shed_roof(length, depth, eave, slope, over)]


def _gable(rng: np.random.Generator, at: float = 0.5) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    ridge = eave + slope * depth / 2
    return [shapes.gable_roof(length, depth, eave, slope, over, at), *_chimneys(rng, length, depth, ridge, slope)]


def _gable_off(rng: np.random.Generator) -> list[Volume]:
    return _gable(rng, 0.5 + float(rng.choice([-1, 1])) * float(rng.uniform(0.06, 0.16)))


def _hip(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    length = max(length, depth + 2.0)
    ridge = eave + slope * depth / 2
    return [shapes.hip_roof(length, depth, eave, slope, over.left), *_chimneys(rng, length, depth, ridge, slope)]


def _half_hip(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    slope, ridge = max(slope, 0.7), eave + max(slope, 0.7) * depth / 2
    main = shapes.half_hip_roof(length, depth, eave, slope, over.left, float(rng.uniform(0.4, 0.65)))
    return [main, *_chimneys(rng, length, depth, ridge, slope)]


def _pyramid(rng: np.random.Generator) -> list[Volume]:
    _, _, eave, slope, over = _size(rng)
    side = float(rng.uniform(7, 11))
    return [shapes.hip_roof(side, side, eave, slope, over.left)]


def _dormers(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    slope = max(slope, 0.75)
    ridge = eave + slope * depth / 2
    main = shapes.gable_roof(length, depth, eave, slope, over)
    dormers = []
    for side in (0, 1)[: int(rng.integers(1, 3))]:
        count, width = int(rng.integers(1, 4)), float(rng.uniform(1.5, 2.5))
        back = float(rng.uniform(0.5, 1.0))
        top = min(eave + slope * back + 1.6, ridge - 0.4)
        for k in range(count):
            u = (k + 0.5) * length / count - width / 2
            v = (back, depth / 2) if side == 0 else (depth / 2, depth - back)
            dormers.append(shapes.dormer(u, v, width, top, eave))
    return [main, *dormers, *_chimneys(rng, length, depth, ridge, slope)]


def _dormered(rng: np.random.Generator, kind: str) -> list[Volume]:
    """A gable with one to three dormers on one side or both, of 2 to 3.2 m width that run at least 1.5 m into the roof."""
    length, depth, eave, slope, over = _size(rng)
    length, depth, slope = max(length, 11.0), max(depth, 8.0), max(slope, 0.75)
    ridge = eave + slope * depth / 2
    volumes = [shapes.gable_roof(length, depth, eave, slope, over)]
    for side in (0, 1)[: int(rng.integers(1, 3))]:
        count, width = int(rng.integers(1, 4)), float(rng.uniform(2.0, 3.2))
        back, run = float(rng.uniform(0.5, 1.0)), float(rng.uniform(1.5, 2.0))
        for k in range(count):
            u = (k + 0.5) * length / count - width / 2
            at = (u, back, width, run) if side == 0 else (length - u - width, back, width, run)
            own = _dormer_of(kind, at, eave, slope, ridge - 0.25)
            volumes.append(own if side == 0 else shapes.moved(own, np.pi, length, depth))
    return [*volumes, *_chimneys(rng, length, depth, ridge, slope)]


def _dormer_of(kind: str, at: tuple[float, float, float, float], eave: float, slope: float, most: float) -> Volume:
    """A dormer on the slope of v: u and v of its front's start, width, and how far its eave runs into the roof."""
    u, v, width, run = at
    ring, tilt = rectangle(u, v, u + width, v + run + 2.5), 0.35 * slope if kind == "shed" else 0.0
    low = min(eave + slope * v + (slope - tilt) * run, most - tilt * run)
    if kind != "gabled":
        return Volume(ring, (LocalFace(ring, 0, tilt, low - tilt * v, DORMER),), 0.0, eave, DORMER)
    rise = min(0.45 * width / 2, most - low)
    pitch, middle = rise / (width / 2), u + width / 2
    left, right = rectangle(u, v, middle, v + run + 2.5), rectangle(middle, v, u + width, v + run + 2.5)
    faces = (
        LocalFace(left, pitch, 0, low - pitch * u, DORMER),
        LocalFace(right, -pitch, 0, low + pitch * (u + width), DORMER),
    )
    return Volume(ring, faces, 0.0, eave, DORMER)


def _level_dormers(rng: np.random.Generator) -> list[Volume]:
    return _dormered(rng, "level")


def _shed_dormers(rng: np.random.Generator) -> list[Volume]:
    return _dormered(rng, "shed")


def _gabled_dormers(rng: np.random.Generator) -> list[Volume]:
    return _dormered(rng, "gabled")


def _winged(rng: np.random.Generator, at: float) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    width = float(rng.uniform(0.5, 0.8)) * depth
    length = max(length, 1.6 * width + 3)
    reach = depth / 2 + float(rng.uniform(3.5, 7))
    low = eave - float(rng.choice([0.0, 0.0, 0.5, 1.2]))
    main = shapes.gable_roof(length, depth, eave, slope, over)
    wing = shapes.gable_roof(reach, width, low, slope, replace(over, left=0.0))
    return [
        main,
        shapes.moved(wing, np.pi / 2, at * (length - width) + width, depth / 2),
        *_chimneys(rng, length, depth, eave + slope * depth / 2, slope),
    ]


def _l_gable(rng: np.random.Generator) -> list[Volume]:
    return _winged(rng, float(rng.choice([0.0, 1.0])))


def _t_gable(rng: np.random.Generator) -> list[Volume]:
    return _winged(rng, float(rng.uniform(0.2, 0.8)))


def _l_hip(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, slope, over = _size(rng)
    length = max(length, 2.0 * depth)
    width = depth if rng.random() < 0.5 else float(rng.uniform(0.7, 0.95)) * depth
    reach = depth + float(rng.uniform(4, 8))
    main = shapes.hip_roof(length, depth, eave, slope, over.left)
    wing = shapes.hip_roof(max(reach, width + 1), width, eave, slope, over.left)
    return [main, shapes.moved(wing, np.pi / 2, width, 0.0)]


def _mansard(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, _, _ = _size(rng)
    steep, gentle = float(np.tan(np.radians(rng.uniform(62, 70)))), float(np.tan(np.radians(rng.uniform(18, 30))))
    run = float(rng.uniform(0.9, 1.4))
    top, half = eave + steep * run, depth / 2
    last = top + gentle * (half - run)
    faces = (
        LocalFace(rectangle(0, 0, length, run), 0, steep, eave),
        LocalFace(rectangle(0, run, length, half), 0, gentle, top - gentle * run),
        LocalFace(rectangle(0, half, length, depth - run), 0, -gentle, last + gentle * half),
        LocalFace(rectangle(0, depth - run, length, depth), 0, -steep, eave + steep * depth),
    )
    return [Volume(rectangle(0, 0, length, depth), faces)]


def _butterfly(rng: np.random.Generator) -> list[Volume]:
    length, depth, eave, _, _ = _size(rng)
    slope, half = float(np.tan(np.radians(rng.uniform(12, 25)))), depth / 2
    faces = (
        LocalFace(rectangle(0, 0, length, half), 0, -slope, eave + slope * half),
        LocalFace(rectangle(0, half, length, depth), 0, slope, eave - slope * half),
    )
    return [Volume(rectangle(0, 0, length, depth), faces)]


def _sawtooth(rng: np.random.Generator) -> list[Volume]:
    _, _, eave, _, _ = _size(rng)
    count, pitch, depth = int(rng.integers(3, 6)), float(rng.uniform(5, 8)), float(rng.uniform(14, 22))
    slope = float(rng.uniform(2.0, 3.0)) / pitch
    rings = [rectangle(k * pitch, 0, (k + 1) * pitch, depth) for k in range(count)]
    return [Volume(r, (LocalFace(r, slope, 0, eave - slope * k * pitch),)) for k, r in enumerate(rings)]


def _cone(rng: np.random.Generator) -> list[Volume]:
    radius = float(rng.uniform(4, 9))
    angle = np.arange(24) * 2 * np.pi / 24
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return [shapes.cone_roof(ring, (0.0, 0.0), float(rng.uniform(4, 9)), float(rng.uniform(0.4, 1.0)), 0.0)]


SHAPES: dict[str, Callable[[np.random.Generator], list[Volume]]] = {
    "flat": _flat, "shed": _shed, "gable": _gable, "gable off": _gable_off, "hip": _hip, "half-hip": _half_hip, "pyramid": _pyramid,
    "L gable": _l_gable, "T gable": _t_gable, "L hip": _l_hip, "gable dormers": _dormers,
    "mansard": _mansard, "butterfly": _butterfly, "sawtooth": _sawtooth, "cone": _cone,
    "level dormers": _level_dormers, "shed dormers": _shed_dormers, "gabled dormers": _gabled_dormers,
}  # fmt: skip

"""Places buildings of many shapes in street blocks on a terrain."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.polygon import orient

from cityflow.core.arrays import FloatArray
from cityflow.core.grid import Bounds
from cityflow.synthetic import roofs
from cityflow.synthetic.roofs import LocalFace, Placement, TruthBuilding
from cityflow.synthetic.terrain import Terrain

BLOCK_M = (54.0, 36.0)
STREET_M = 10.0
MAX_FALL_M = 4.0
"""Terrain under one building falls no more than this."""
HILL_FALL_M = 8.0
"""The same where houses are cut into a hill: its roof is above the ground all the same."""
LEAST_EAVE_M = 1.0

Ring = tuple[tuple[float, float], ...]
Draft = tuple[str, Ring, list[LocalFace]]
"""Shape name, outline and faces in the frame of a block."""
Block = Callable[[np.random.Generator], list[list[Draft]]]


def place_buildings(
    rng: np.random.Generator,
    terrain: Terrain,
    bounds: Bounds,
    blocks: Sequence[Block] | None = None,
    most_fall_m: float = MAX_FALL_M,
) -> tuple[TruthBuilding, ...]:
    """Buildings of a scene, block after block; ids count from ``b0001``. `most_fall_m`: of the ground under one of them."""
    blocks = blocks or BLOCKS
    heading = rng.uniform(-0.6, 0.6)
    buildings: list[TruthBuilding] = []
    for number, (x, y) in enumerate(_block_corners(bounds, heading)):
        block = blocks[(number + int(rng.integers(2))) % len(blocks)]
        placement = Placement(x, y, heading, 0.0)
        for group in block(rng):
            buildings += _build_group(group, placement, terrain, most_fall_m, bounds, len(buildings))
    return tuple(buildings)


def _block_corners(bounds: Bounds, heading: float) -> list[tuple[float, float]]:
    """South-west corners of the blocks of a rotated street grid that meet `bounds`, row after row."""
    pitch = BLOCK_M[0] + STREET_M, BLOCK_M[1] + STREET_M
    centre = (bounds[0] + bounds[2]) / 2, (bounds[1] + bounds[3]) / 2
    reach = int(np.hypot(bounds[2] - bounds[0], bounds[3] - bounds[1]) / 2 / pitch[1]) + 2
    c, s = np.cos(heading), np.sin(heading)
    corners = []
    for j in range(-reach, reach + 1):
        for i in range(-reach, reach + 1):
            u, v = i * pitch[0], j * pitch[1]
            x, y = centre[0] + c * u - s * v, centre[1] + s * u + c * v
            if bounds[0] - 60 < x < bounds[2] + 20 and bounds[1] - 60 < y < bounds[3] + 20:
                corners.append((float(x), float(y)))
    return corners


def _build_group(
    group: list[Draft], block: Placement, terrain: Terrain, most_fall_m: float, bounds: Bounds, count: int
) -> list[TruthBuilding]:
    """Buildings that touch each other; a unit that the terrain does not allow is left out."""
    built: list[TruthBuilding] = []
    for shape, ring, local_faces in group:
        outline = orient(Polygon(block.to_world(ring)))
        x, y = shapely.get_coordinates(outline.segmentize(2.0)).T
        inside = (x > bounds[0] + 2) & (x < bounds[2] - 2) & (y > bounds[1] + 2) & (y < bounds[3] - 2)
        z = terrain.z(x, y)
        if not inside.all() or not terrain.is_buildable(x, y).all() or np.ptp(z) > most_fall_m:
            continue
        placement = Placement(block.x, block.y, block.heading, round(float(z.mean()), 2))
        if most_fall_m > MAX_FALL_M and _buried(local_faces, placement, terrain):
            continue
        prisms = tuple(placement.face(f) for f in local_faces)
        name = f"b{count + len(built) + 1:04d}"
        built.append(TruthBuilding(name, shape, outline, roofs.visible_faces(prisms), prisms, float(z.min())))
    return built


def _buried(faces: list[LocalFace], placement: Placement, terrain: Terrain) -> bool:
    """Whether the ground comes nearer than `LEAST_EAVE_M` to a roof's corner."""
    corners = np.concatenate([shapely.get_coordinates(placement.face(f).polygon) for f in faces])
    planes = np.concatenate(
        [placement.face(f).plane.z(*shapely.get_coordinates(placement.face(f).polygon).T) for f in faces]
    )
    return bool((planes < terrain.z(*corners.T) + LEAST_EAVE_M).any())


def _moved(faces: list[LocalFace], u: float, v: float) -> list[LocalFace]:
    """Faces shifted within their frame."""
    return [
        LocalFace(
            tuple((a + u, b + v) for a, b in f.ring),
            f.slope_u,
            f.slope_v,
            f.height - f.slope_u * u - f.slope_v * v,
            f.kind,
        )
        for f in faces
    ]


def _house(rng: np.random.Generator, shape: str, u: float, v: float) -> Draft:
    """A detached house of at most 17 x 13 m with its corner at (u, v)."""
    length, depth = rng.uniform(9, 13), rng.uniform(7.5, 9.5)
    eave, slope = rng.uniform(3.0, 7.5), np.tan(np.radians(rng.uniform(25, 48)))
    ring: Ring = roofs.rectangle(0, 0, length, depth)
    if shape == "gable":
        faces = roofs.gable(0, length, (0, depth), eave, slope)
        faces += _dormers_and_chimney(rng, length, depth, eave, slope)
    elif shape == "hip":
        faces = roofs.hip(length, depth, eave, slope)
    elif shape == "pyramid":
        ring, faces = roofs.rectangle(0, 0, depth, depth), roofs.hip(depth, depth, eave, slope)
    elif shape == "shed":
        faces = roofs.shed(length, depth, eave, rng.uniform(0.08, 0.35))
    elif shape == "flat":
        faces = roofs.flat(length, depth, eave)
    else:
        ring, faces = _l_gable(rng, length, depth, eave, slope)
    return shape, tuple((a + u, b + v) for a, b in ring), _moved(faces, u, v)


def _l_gable(
    rng: np.random.Generator, length: float, depth: float, eave: float, slope: float
) -> tuple[Ring, list[LocalFace]]:
    """Two wings at a right angle with one eave height; the second one is as wide or narrower."""
    width, reach = rng.uniform(0.75, 1.0) * depth, depth + rng.uniform(3.5, 5.5)
    ring = ((0.0, 0.0), (length, 0.0), (length, depth), (width, depth), (width, reach), (0.0, reach))
    faces = roofs.gable(0, length, (0, depth), eave, slope)
    return ring, faces + roofs.gable_across((0, width), depth / 2, reach, eave, slope)


def _dormers_and_chimney(
    rng: np.random.Generator, length: float, depth: float, eave: float, slope: float
) -> list[LocalFace]:
    ridge = eave + slope * depth / 2
    extra = []
    if rng.random() < 0.5 and slope > 0.6:
        width, at = rng.uniform(1.8, 3.2), rng.uniform(1.0, length - 4.5)
        extra.append(roofs.dormer(at, (0.6, depth / 2), width, min(eave + slope * 0.6 + 1.6, ridge - 0.5)))
    if rng.random() < 0.6:
        extra.append(roofs.chimney(rng.uniform(1, length - 2), depth / 2 - rng.uniform(-0.5, 1.5), ridge + 0.8))
    return extra


def _terrace(rng: np.random.Generator, v: float, count: int) -> list[Draft]:
    """Touching houses along u: steps in eaves, ridges and façades; common walls have all vertices of both."""
    edges = np.concatenate([[0.0], np.cumsum(rng.uniform(5.0, 7.2, count))]).round(3)
    front = v + np.where(rng.random(count) < 0.35, rng.uniform(0.6, 1.8, count), 0.0).round(3)
    back = front + np.where(rng.random(count) < 0.7, 9.0, rng.uniform(8, 10.5, count)).round(3)
    eave = 5.5 + np.cumsum(np.where(rng.random(count) < 0.6, rng.uniform(-0.9, 0.9, count), 0.0))
    slope = np.tan(np.radians(rng.uniform(32, 45)))
    is_flat = rng.random() < 0.25
    drafts = []
    for i in range(count):
        low, high = float(front[i]), float(back[i])
        ring = _noded_ring((float(edges[i]), float(edges[i + 1])), i, front, back)
        if is_flat:
            drafts.append(("terrace flat", ring, [LocalFace(ring, 0, 0, float(eave[i]))]))
            continue
        faces = roofs.gable(float(edges[i]), float(edges[i + 1]), (low, high), float(eave[i]), float(slope))
        if rng.random() < 0.3:
            top = float(eave[i] + slope * 0.5 + 1.5)
            faces.append(roofs.dormer(float(edges[i]) + 1.2, (low + 0.5, (low + high) / 2), 2.6, top))
        drafts.append(("terrace gable", ring, faces))
    return drafts


def _noded_ring(u: tuple[float, float], i: int, front: FloatArray, back: FloatArray) -> Ring:
    """Rectangle of unit i of a terrace with the corners of both neighbours inserted in its side walls."""
    low, high = float(front[i]), float(back[i])

    def between(j: int) -> list[float]:
        if not 0 <= j < len(front):
            return []
        return sorted(v for v in (float(front[j]), float(back[j])) if low < v < high)

    right = [(u[1], v) for v in [low, *between(i + 1), high]]
    left = [(u[0], v) for v in [high, *reversed(between(i - 1)), low]]
    return tuple(right + left)


def _houses(rng: np.random.Generator) -> list[list[Draft]]:
    """Six detached houses, of all shapes in turn."""
    shapes = rng.permutation(["gable", "hip", "l-gable", "shed", "pyramid", "flat", "gable"])
    spots = [(u, v) for v in (0.0, 19.0) for u in (0.0, 18.5, 37.0)]
    return [[_house(rng, str(s), u + rng.uniform(0, 2.5), v)] for s, (u, v) in zip(shapes, spots, strict=False)]


def _terraces(rng: np.random.Generator) -> list[list[Draft]]:
    return [_terrace(rng, 0.0, int(rng.integers(5, 9))), _terrace(rng, 22.0, int(rng.integers(4, 8)))]


def _hall(rng: np.random.Generator) -> list[list[Draft]]:
    """A hall of low slope with a lower annexe in the same outline."""
    length, depth, eave = rng.uniform(34, 44), rng.uniform(20, 26), rng.uniform(7, 11)
    ring = ((0.0, 0.0), (length, 0.0), (length, depth), (12.0, depth), (12.0, depth + 7), (0.0, depth + 7))
    faces = roofs.gable(0, length, (0, depth), eave, rng.uniform(0.05, 0.15))
    annexe = LocalFace(roofs.rectangle(0, depth, 12, depth + 7), 0, 0, eave - rng.uniform(2.5, 4.0))
    return [[("hall", ring, [*faces, annexe])]]


def _stepped(rng: np.random.Generator) -> list[list[Draft]]:
    """A block of three flat parts of different height in one outline, and a tower."""
    cuts, heights = [0.0, rng.uniform(10, 13), rng.uniform(22, 26), 36.0], rng.permutation([6.0, 9.5, 15.0])
    faces = [
        LocalFace(roofs.rectangle(a, 0, b, 14), 0, 0, float(h) + rng.uniform(-0.8, 0.8))
        for a, b, h in zip(cuts[:-1], cuts[1:], heights, strict=True)
    ]
    lift = LocalFace(roofs.rectangle(4, 5, 8, 9), 0, 0, float(heights.max()) + 2.8, roofs.DORMER)
    tower = roofs.flat(11, 11, rng.uniform(22, 32))
    return [
        [("stepped", roofs.rectangle(0, 0, 36, 14), [*faces, lift])],
        [("tower", tuple((a + 40, b + 18) for a, b in roofs.rectangle(0, 0, 11, 11)), _moved(tower, 40, 18))],
        [_house(rng, "l-gable", 8.0, 19.5)],
    ]


def _large_hall(rng: np.random.Generator) -> list[list[Draft]]:
    """A hall of 60 m."""
    depth, eave = rng.uniform(24, 30), rng.uniform(9, 12)
    return [[("hall", roofs.rectangle(0, 0, 60, depth), roofs.gable(0, 60, (0, depth), eave, rng.uniform(0.03, 0.12)))]]


def _towers(rng: np.random.Generator) -> list[list[Draft]]:
    """Two towers, one of them 60 m high, and a house."""
    high, low = roofs.flat(18, 16, 60.0), roofs.flat(14, 14, rng.uniform(20, 40))
    high.append(LocalFace(roofs.rectangle(6, 6, 11, 10), 0, 0, 63.0, roofs.DORMER))
    return [
        [("tower", roofs.rectangle(0, 0, 18, 16), high)],
        [("tower", tuple((a + 36, b + 4) for a, b in roofs.rectangle(0, 0, 14, 14)), _moved(low, 36, 4))],
        [_house(rng, "gable", 8.0, 22.0)],
    ]


BLOCKS: tuple[Block, ...] = (_houses, _terraces, _hall, _houses, _stepped)
HILL_BLOCKS: tuple[Block, ...] = (_houses, _large_hall, _terraces, _towers, _houses, _stepped)

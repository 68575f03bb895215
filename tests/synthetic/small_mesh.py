"""Hand-synthetic town meshes for tests of the renderer."""

from __future__ import annotations

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.synthetic.mesh import Material, Part, TownMesh

Face = tuple[list[tuple[float, float, float]], Part, Material, tuple[int, int, int]]


def mesh_of(faces: list[Face]) -> TownMesh:
    """A mesh of convex planar faces, each with its own frame (u level, v up the slope) and seed."""
    vertices: list[FloatArray] = []
    rows: list[tuple[int, ...]] = []
    triangles, frames = [], []
    for number, (ring, part, material, tint) in enumerate(faces):
        xyz = np.array(ring, float)
        normal = np.cross(xyz[1] - xyz[0], xyz[2] - xyz[1])
        normal /= np.linalg.norm(normal)
        u = np.cross([0.0, 0.0, 1.0], normal)
        u = u / np.linalg.norm(u) if np.linalg.norm(u) > 1e-6 else np.array([1.0, 0.0, 0.0])
        start = sum(len(v) for v in vertices)
        vertices.append(xyz)
        for i in range(1, len(xyz) - 1):
            triangles.append((start, start + i, start + i + 1))
            frames.append((xyz[0], u, np.cross(normal, u)))
            rows.append((int(part), int(material), *tint, 1000 + 77777 * number))
    r, f = np.array(rows), np.array(frames)
    return TownMesh(
        np.concatenate(vertices), np.array(triangles, np.int32), r[:, 0].astype(np.uint8), r[:, 1].astype(np.uint8),
        np.full(len(r), -1, np.int32), r[:, 2:5].astype(np.uint8), f[:, 0], f[:, 1], f[:, 2], r[:, 5].astype(np.uint32),
    )  # fmt: skip


def ground(
    x: tuple[float, float], y: tuple[float, float], slope: float = 0.0, material: Material = Material.GRASS,
    tint: tuple[int, int, int] = (95, 110, 60), z: float = 0.0,
) -> Face:  # fmt: skip
    ring = [(a, b, z + slope * (a - x[0])) for a, b in ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))]
    return ring, Part.GROUND, material, tint


def house(
    at: tuple[float, float], size: tuple[float, float], heights: tuple[float, float, float], wall: Material = Material.BRICK
) -> list[Face]:  # fmt: skip
    """A house with its ridge along x; `heights` are world metres of floor, eave and ridge."""
    (x, y), (w, d), (low, eave, ridge) = at, size, heights
    red, tone = (160, 80, 60), (200, 190, 170) if wall is Material.PLASTER else (150, 90, 70)
    corners = [(x, y), (x + w, y), (x + w, y + d), (x, y + d)]
    faces: list[Face] = []
    for i, (a, b) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True)):
        ring = [(*a, low), (*b, low), (*b, eave), (*a, eave)]
        if i % 2:
            ring.insert(3, (a[0], y + d / 2, ridge))
        faces.append((ring, Part.WALL, wall, tone))
    middle = y + d / 2
    faces.append(
        (
            [(x, y, eave), (x + w, y, eave), (x + w, middle, ridge), (x, middle, ridge)],
            Part.ROOF,
            Material.ROOF_TILE,
            red,
        )
    )
    faces.append(
        (
            [(x + w, y + d, eave), (x, y + d, eave), (x, middle, ridge), (x + w, middle, ridge)],
            Part.ROOF,
            Material.ROOF_TILE,
            red,
        )
    )
    for k in range(int(w // 2.5)):
        wx = x + 0.8 + 2.5 * k
        for wz in np.arange(low + 1.0, eave - 1.4, 2.8):
            ring = [
                (wx, y - 0.01, wz),
                (wx + 1.1, y - 0.01, wz),
                (wx + 1.1, y - 0.01, wz + 1.3),
                (wx, y - 0.01, wz + 1.3),
            ]
            faces.append((ring, Part.WINDOW, Material.GLASS, (90, 100, 110)))
    return faces


def village(size: float = 120.0, slope: float = 0.05, origin: tuple[float, float] = (0.0, 0.0)) -> TownMesh:
    """Rows of houses on a slope with a street between, well beyond `size` on all sides."""
    x0, y0 = origin
    rng = np.random.default_rng(4)
    wide = (x0 - 2 * size, x0 + 3 * size), (y0 - 2 * size, y0 + 3 * size)
    faces = [ground(*wide, slope)]
    for j in range(int(size // 24)):
        y = y0 + 3 + 24 * j
        street = ground(wide[0], (y + 11, y + 17), slope, Material.ASPHALT, (110, 110, 112), 0.02)
        faces.append(street)
        x = x0 + 2.0
        while x < x0 + size - 14:
            w, eave = rng.uniform(6, 12), rng.uniform(4, 9)
            floor = slope * (x - wide[0][0]) - 0.5
            wall = Material.PLASTER if rng.random() < 0.5 else Material.BRICK
            faces += house((x, y), (w, 9.0), (floor, floor + eave, floor + eave + rng.uniform(2, 5)), wall)
            x += w + (0.0 if rng.random() < 0.5 else rng.uniform(0.8, 5))
    return mesh_of(faces)

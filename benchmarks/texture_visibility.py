"""What of façades and roofs images are said to see, against a synthetic town whose every ray is known.

python benchmarks/texture_visibility.py --survey SURVEY [--run RUN] [--units 12]     # SURVEY as `cityflow synth` leaves it, RUN a run over it

Of the cells of faces that an image truly sees: how many are found (recall). Of those that any image truly sees: how many are found in one of these
(in_any). Of those that are said to be seen: in how many does the image truly show the unit's own face (precision), and what does it show else.
With true hulls and the true surface, and with those of RUN.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from cityflow.core.arrays import BoolArray, FloatArray, IntArray
from cityflow.core.building import Lod, Polyhedron, Semantic
from cityflow.core.camera import OrientedImage
from cityflow.core.grid import Bounds, Grid, grown
from cityflow.core.texture import FacePlane
from cityflow.io.rasters.surface_dataset import grids_of, read_layers
from cityflow.stages.synth.synthetic_survey import SynthParameters
from cityflow.synthetic import caster
from cityflow.synthetic.mesh import Part, TownMesh
from cityflow.synthetic.town import Town, make_town
from cityflow.synthetic.town_truth import truth_rasters
from cityflow.texture.planes import face_planes
from cityflow.texture.ranking.face_views import views_of
from cityflow.texture.ranking.field_of_view import in_frame
from cityflow.texture.ranking.ranking_parameters import RankingParameters
from cityflow.texture.visibility.scene import Scene
from cityflow.texture.visibility.seen import coarse_grid, face_cells, seen_faces
from cityflow.texture.visibility.visibility_parameters import VisibilityParameters
from town_models import buildings_of, true_model
from true_shells import true_shells

IMAGES_PER_FACE = 30
LEAST_M2 = 0.5
REACH_M = 60.0
NEAR_M = 0.5
"""So far from the plane of a face the true building may stand where a reconstructed one was made of it."""
ALIKE = 0.8
"""Cosine of the angle up to which a true face is the one that a reconstructed one was made of: eaves before a wall are not the wall."""
BIAS_M = 0.03
BUILT = (Part.ROOF, Part.WALL, Part.OVERHANG, Part.WINDOW, Part.DOOR, Part.PIPE, Part.CHIMNEY)


@dataclass(frozen=True)
class House:
    """A unit's shells, and which true unit it is."""

    index: int
    outline: shapely.Polygon
    shells: tuple[Polyhedron, Polyhedron | None]

    @property
    def all(self) -> list[Polyhedron]:
        return [s for s in self.shells if s is not None]


@dataclass
class Count:
    """Cells, weighted by their area; m²."""

    truly: float = 0.0
    both: float = 0.0
    found: float = 0.0
    right: float = 0.0
    any_true: float = 0.0
    any_both: float = 0.0


class Truth:
    """The town as rays meet it."""

    def __init__(self, mesh: TownMesh) -> None:
        self.scene = caster.Scene(mesh)
        self.mesh = mesh

    def free(self, xyz: FloatArray, normal: FloatArray, centre: FloatArray) -> BoolArray:
        """Points with nothing between them and the camera."""
        start = xyz + BIAS_M * normal - self.scene.origin
        return ~self.scene.occluded(start, centre - self.scene.origin - start)

    def shown(
        self, xyz: FloatArray, face: FacePlane, centre: FloatArray, outline: shapely.Polygon
    ) -> tuple[BoolArray, BoolArray, IntArray]:
        """Points in whose place the camera shows what the face was made of; those of them where that looks the way the face does; the part of the town.

        That is something built, near the plane of the face and within the outline of its house: a house may be several units of the synthetic town.
        """
        start = centre - self.scene.origin
        rays = xyz - centre
        triangle, length = self.scene.first_hits(start, rays)
        met = centre + length[:, None] * rays
        part = np.where(triangle >= 0, self.mesh.part[triangle], 255).astype(np.int64)
        near = np.isin(part, [int(p) for p in BUILT]) & (np.abs((met - face.origin) @ face.normal) <= NEAR_M)
        near[near] = shapely.contains_xy(outline, *met[near, :2].T)
        alike = self.scene.surfaces.normal[triangle] @ face.normal > ALIKE
        return near, near & alike, part


def true_houses(town: Town) -> list[House]:
    return [House(u.index, u.wall_outline, true_shells(true_model(u), u.floor_m)) for u in town.units]


def run_houses(run: Path, town: Town) -> list[House]:
    tree = shapely.STRtree([u.wall_outline for u in town.units])
    houses = []
    for building in buildings_of(run):
        near = tree.query(building.footprint, predicate="intersects")
        common = [shapely.intersection(building.footprint, town.units[k].wall_outline).area for k in near]
        if common and building.solids.get(Lod.LOD22) is not None:
            houses.append(
                House(
                    int(near[int(np.argmax(common))]), building.footprint, (building.solids[Lod.LOD22], building.beyond)
                )
            )
    return houses


def true_surface(town: Town, bounds: Bounds, cell: float) -> tuple[Grid, FloatArray]:
    grid = Grid.covering(bounds, cell)
    return grid, truth_rasters(town, grid).dsm


def run_surface(run: Path) -> tuple[Grid, FloatArray]:
    lattice, grid = grids_of(str(run / "surface.zarr"))
    window, layers = read_layers(str(run / "surface.zarr"), lattice, grid.bounds, ["dsm_filled"])
    return window, layers["dsm_filled"].astype(np.float64)


def cut(surface: tuple[Grid, FloatArray], bounds: Bounds) -> tuple[Grid, FloatArray]:
    grid, heights = surface
    box = grid.bounds
    part = Grid.covering(
        (max(bounds[0], box[0]), max(bounds[1], box[1]), min(bounds[2], box[2]), min(bounds[3], box[3])), grid.cell
    )
    rows, cols = grid.slices(part)
    return part, heights[rows, cols]


def around(houses: Sequence[House], k: int, reach: float) -> list[Polyhedron]:
    return [s for n, h in enumerate(houses) if n != k and h.outline.distance(houses[k].outline) < reach for s in h.all]


def chosen(houses: Sequence[House], town: Town, area: Bounds, count: int, inset_m: float = 5.0) -> list[int]:
    """Units inside the area by at least `inset_m`, each n-th of them."""
    inner = shapely.box(*grown(area, -inset_m))
    held = [k for k, h in enumerate(houses) if inner.contains(town.units[h.index].roof_outline)]
    held.sort(key=lambda k: houses[k].index)
    if not held:
        raise SystemExit(
            f"no unit stands inside the surveyed area by {inset_m:g} m: try --inset with less, or a larger town"
        )
    return held[:: max(1, len(held) // count)][:count]


def faces_of(house: House) -> Iterator[FacePlane]:
    yield from (f for f in face_planes(*house.shells) if f.polygon.area >= LEAST_M2)


def _plan(house: House) -> shapely.Geometry:
    """Where a house stands out beyond its walls."""
    beyond = house.shells[1]
    if beyond is None:
        return shapely.Point()
    polygons = [shapely.Polygon(beyond.ring(f.rings[0])[:, :2]) for f in beyond.faces if f.semantic is Semantic.ROOF]
    return shapely.union_all(shapely.buffer(polygons, 0))


def judge(
    houses: Sequence[House], surface: tuple[Grid, FloatArray], world: tuple[Town, Truth, Sequence[OrientedImage], Bounds],
    asked: argparse.Namespace, true_hulls: bool,
) -> dict[str, object]:  # fmt: skip
    town, truth, images, area = world
    p = VisibilityParameters(**json.loads(asked.set))
    rng = np.random.default_rng(1)
    counts: dict[str, Count] = {}
    wrong: Counter[str] = Counter()
    rays, seconds, made = 0, 0.0, 0.0
    steep = RankingParameters().steepest_deg
    for k in chosen(houses, town, area, asked.units):
        house = houses[k]
        ground = shapely.buffer(shapely.union_all([house.outline, _plan(house)]), NEAR_M)
        shapely.prepare(ground)
        part = cut(surface, grown(house.outline.bounds, REACH_M))
        began = time.perf_counter()
        scene = Scene.of(part[1], part[0], house.all, around(houses, k, REACH_M), p)
        made += time.perf_counter() - began
        for face in faces_of(house):
            views = [v for v in views_of(face, images) if v.incidence_deg <= steep]
            if len(views) > IMAGES_PER_FACE:
                views = [views[i] for i in np.sort(rng.choice(len(views), IMAGES_PER_FACE, replace=False))]
            grid = coarse_grid(face, 0.05, asked.cells)
            inside, st = face_cells(face, grid)
            xyz, weight = face.world(st), grid.cell**2
            began = time.perf_counter()
            seen = seen_faces(face, views, images, scene, grid)
            seconds += time.perf_counter() - began
            count = counts.setdefault(str(face.semantic.value), Count())
            ever_true, ever_both = np.zeros(len(xyz), bool), np.zeros(len(xyz), bool)
            for one in seen:
                image = images[one.view.image]
                said = one.mask.mask()[inside]
                rays += len(said)
                own, alike, shown = truth.shown(xyz, face, image.centre, ground)
                free = (truth.free(xyz, face.normal, image.centre) if true_hulls else alike) & in_frame(image, xyz)
                count.truly += weight * np.count_nonzero(free)
                count.both += weight * np.count_nonzero(free & said)
                count.found += weight * np.count_nonzero(said)
                count.right += weight * np.count_nonzero(said & (free | own))
                ever_true |= free
                ever_both |= free & said
                names, number = np.unique(shown[said & ~free & ~own], return_counts=True)
                wrong.update({_name(int(n)): float(weight * c) for n, c in zip(names, number, strict=True)})
            count.any_true += weight * np.count_nonzero(ever_true)
            count.any_both += weight * np.count_nonzero(ever_both)
    return {**_shares(counts), "wrong_m2": {k: round(v) for k, v in wrong.most_common(6)}, "us_per_ray": round(seconds / max(rays, 1) * 1e6, 3),
            "rays": rays, "scene_s": round(made / asked.units, 3)}  # fmt: skip


def _name(part: int) -> str:
    return Part(part).name.lower() if part in set(Part) else "nothing"


def _shares(counts: dict[str, Count]) -> dict[str, object]:
    total = Count(*(sum(getattr(c, name) for c in counts.values()) for name in vars(Count())))
    return {
        name: {"recall": round(c.both / max(c.truly, 1e-9), 4), "precision": round(c.right / max(c.found, 1e-9), 4),
               "in_any": round(c.any_both / max(c.any_true, 1e-9), 4), "said_m2": round(c.found)}
        for name, c in {"all": total, **counts}.items()
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--survey", type=Path, required=True)
    parser.add_argument("--run", type=Path)
    parser.add_argument("--units", type=int, default=12)
    parser.add_argument("--cells", type=int, default=400)
    parser.add_argument("--cell", type=float, help="of the true surface, metres; as the survey's truth otherwise")
    parser.add_argument("--skip-true", action="store_true")
    parser.add_argument("--seed", type=int, help="another town, photographed in the same way")
    parser.add_argument("--set", default="{}", help="VisibilityParameters as JSON")
    asked = parser.parse_args()
    p = SynthParameters.model_validate(json.loads((asked.survey / "synth.json").read_text())["parameters"])
    if asked.seed is not None:
        p = p.model_copy(update={"seed": asked.seed})
    town = make_town(p.seed, p.whole_town)
    world = (town, Truth(town.mesh()), p.images, p.area)
    surface = true_surface(town, grown(p.area, p.around_m), asked.cell or p.truth_cell_m)
    if not asked.skip_true:
        print("true hulls, true surface", json.dumps(judge(true_houses(town), surface, world, asked, True)), flush=True)
    if asked.run is not None:
        found = judge(run_houses(asked.run, town), run_surface(asked.run), world, asked, False)
        print("hulls and surface of the run", json.dumps(found))


if __name__ == "__main__":
    main()

"""Pictures of methods that need no run: voids cut out of a model, a step of a roof in photographs, a row split from LiDAR.

python benchmarks/method_pictures.py FOLDER [voids seen_steps splitting_lidar]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from cityflow.core.building import Polyhedron
from cityflow.core.grid import Grid
from cityflow.edges.edge_places import CHANGE_CELLS, STEP_CELLS, places_across, votes_of
from cityflow.edges.image_window import window_over
from cityflow.reconstruction.model import ModelParameters, model
from cityflow.reconstruction.seen_steps.edge_lines import roof_steps
from cityflow.reconstruction.seen_steps.with_seen_steps import SeenStepParameters, with_seen_steps
from cityflow.splitting.split import SplitParameters, split
from cityflow.synthetic.town import TownParameters, make_town
from cityflow.synthetic.town_hulls import region_of
from cityflow.synthetic.town_units import Unit
from cityflow.viewer import model_view
from discontinuities import Views
from reconstruction.seen_steps import test_with_seen_steps as scene
from split_lidar import evidence_of, picture, town_of

mpl.use("Agg")
TOWN, TOWN_M = 1, 160.0
KINDS = ("arcade", "stilts", "passage")
LOW_DEG, ASIDE_DEG, AROUND_M, SIZE_PX = 8.0, 30.0, 6.0, 620
ROWS = 11


def drawn(solid: Polyhedron, floor_m: float, looking_deg: float) -> np.ndarray:
    """A solid on level ground, seen from a low place."""
    low, high = solid.vertices.min(axis=0) - AROUND_M, solid.vertices.max(axis=0) + AROUND_M
    rows, cols = int(high[1] - low[1]), int(high[0] - low[0])
    grid = Grid(float(low[0]), float(high[1]), 1.0, rows, cols)
    ground = model_view.terrain_surfaces(np.full(grid.shape, floor_m, np.float32), grid)
    return model_view.draw_models(model_view.surfaces_of([solid]), ground, SIZE_PX, looking_deg=looking_deg)


def voids(path: Path) -> None:
    """The first buildings of a town with an arcade, stilts and a passage, from exact points: without and with the search."""
    model_view.DOWN_DEG = LOW_DEG
    town = make_town(TOWN, TownParameters(width_m=TOWN_M, height_m=TOWN_M, level=2, relief=0.2))
    views = Views(town)
    chosen = [next(u for u in town.units if any(b.kind == kind for b in u.breaks)) for kind in KINDS]
    figure, axes = plt.subplots(len(chosen), 2, figsize=(11, 3.4 * len(chosen)), squeeze=False)
    for row, (kind, unit) in enumerate(zip(KINDS, chosen, strict=True)):
        evidence = views.evidence(unit, TOWN)
        for col, search in enumerate((False, True)):
            parameters = ModelParameters.model_validate({"voids": {"search": search}})
            made = model(evidence, parameters).candidate.solid
            assert made is not None
            axes[row, col].imshow(drawn(made, unit.floor_m, look_of(unit, kind)))
            axes[row, col].set_title(f"{kind}: {'with' if search else 'without'} the search of voids", fontsize=9)
            axes[row, col].axis("off")
    save(figure, path)


def look_of(unit: Unit, kind: str) -> float:
    """Where to look from the side of the opening, degrees clockwise from north."""
    opening = region_of(unit, next(b for b in unit.breaks if b.kind == kind)).centroid
    inward = np.subtract(unit.wall_outline.centroid.coords[0], opening.coords[0])
    return float(np.degrees(np.arctan2(inward[0], inward[1]))) + ASIDE_DEG


def seen_steps(path: Path) -> None:
    """A step that the model has 0.3 m off, in eight photographs."""
    evidence = scene.evidence_of(scene.two_roofs())
    before = scene.modelled(evidence)
    after = with_seen_steps(before, evidence, SeenStepParameters())
    assert before.solid is not None
    assert after.solid is not None
    edge = roof_steps(before.solid, evidence.outline)[0].edges[0]
    off = places_across(scene.CELL)
    cut = round(CHANGE_CELLS / STEP_CELLS / 2)
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5), width_ratios=(1, 1.2))
    image = evidence.photographs[1]
    left.imshow(image.pixels.window((0, image.pixels.height), (0, image.pixels.width), 0), cmap="gray")
    for solid, colour, words in ((before.solid, "red", "of the model before"), (after.solid, "cyan", "moved")):
        moved = roof_steps(solid, evidence.outline)[0].edges[0]
        ends, _ = image.image.project(moved.places(np.array([0.0, moved.length]), np.array([0.0])).reshape(-1, 3))
        left.plot(*ends.T, color=colour, lw=1.2, label=words)
    left.legend(loc="lower left", fontsize=8)
    left.set_title("the step in one of eight photographs", fontsize=9)
    left.axis("off")
    for photograph in evidence.photographs:
        window = window_over(photograph, edge.places(np.array([0.0, edge.length]), off).reshape(-1, 3), scene.CELL)
        votes = None if window is None else votes_of(edge, window, off, scene.CELL)
        if votes is not None:
            right.plot(off[cut:-cut], votes, lw=0.9)
    right.axvline(0.0, color="red", lw=1)
    right.axvline(
        float((scene.ORIGIN[0] + scene.TRUE_X - edge.start[0]) * edge.outward[0]), color="black", ls="--", lw=1
    )
    right.set(
        xlabel="metres outside the model's step (red); dashed: the true one",
        ylabel="how much of an edge each photograph shows",
    )
    save(figure, path)


def splitting_lidar(path: Path) -> None:
    """The first row of gables under a scanner of five pulses per m²."""
    town = town_of(ROWS, "5")
    row = next(r for r in town.rows if r.kind == "gables")
    evidence = evidence_of(town, row)
    picture(evidence, row, split(evidence, SplitParameters()), path)


def save(figure: Figure, path: Path) -> None:
    figure.tight_layout()
    figure.savefig(path, dpi=75)
    plt.close(figure)


def main(folder: Path, names: list[str]) -> None:
    for make in (voids, seen_steps, splitting_lidar):
        if not names or make.__name__ in names:
            make(folder / f"{make.__name__}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])

"""One building's model beside the truth: plan, height errors, and both from two sides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

from cityflow.core.arrays import ByteArray, FloatArray
from cityflow.core.building import Face, Polyhedron, Semantic
from cityflow.core.reconstruction import Candidate, Evidence
from cityflow.evaluation.models import TrueModel
from cityflow.evaluation.models_planes import model_surfaces
from cityflow.evaluation.models_surface import raised, true_samples
from cityflow.geometry.roof_distances import distances_to_roof
from cityflow.viewer.model_view import draw_models, surfaces_of

matplotlib.use("Agg")
import matplotlib.pyplot as plt

SIDES_DEG = (0.0, 140.0)
ERROR_M = 0.3


def draw_unit(path: Path, evidence: Evidence, truth: TrueModel, candidate: Candidate) -> None:
    """PNG: plan (model white, truth red), height of model above truth, model (upper row) and truth (lower row) from two sides."""
    figure, axes = plt.subplots(2, 3, figsize=(15, 10), layout="constrained")
    title = f"{evidence.id} {truth.shape}: {candidate.method} {candidate.roof_type} {candidate.reason}"
    figure.suptitle(title)
    _plan(axes[0, 0], evidence, truth, candidate)
    if candidate.solid is not None:
        xyz = true_samples(truth.surfaces, truth.walls, truth.unjudged)
        error = -distances_to_roof(candidate.solid, xyz)
        shown = axes[1, 0].scatter(xyz[:, 0], xyz[:, 1], c=error, s=3, cmap="RdBu_r", vmin=-ERROR_M, vmax=ERROR_M)
        figure.colorbar(shown, ax=axes[1, 0], label="model above truth, m")
    axes[1, 0].set_aspect("equal")
    true_solid = raised(truth.surfaces, evidence.ground_height)
    for column, turn in enumerate(SIDES_DEG, start=1):
        for row, drawn in enumerate((parts_of(candidate), [true_solid])):
            if drawn:
                axes[row, column].imshow(side_view(drawn, turn, 500))
            axes[row, column].axis("off")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=70)
    plt.close(figure)


def _plan(axes: matplotlib.axes.Axes, evidence: Evidence, truth: TrueModel, candidate: Candidate) -> None:
    if evidence.pictures:
        picture = evidence.pictures[0]
        x_0, y_0, x_1, y_1 = picture.grid.bounds
        axes.imshow(np.moveaxis(picture.pixels[:3], 0, -1), extent=(x_0, x_1, y_0, y_1))
    axes.plot(*evidence.points.xyz[::20, :2].T, ",", color="gold", alpha=0.4)
    for polygon, _ in () if candidate.solid is None else model_surfaces(candidate.solid):
        axes.plot(*polygon.exterior.xy, color="white", lw=2.0)
    for polygon, _ in truth.surfaces:
        axes.plot(*polygon.exterior.xy, color="red", lw=0.8)
    axes.plot(*truth.roof.exterior.xy, color="orange", lw=0.8)
    axes.set_aspect("equal")


def parts_of(candidate: Candidate) -> list[Polyhedron]:
    """The solid, and what of its roof stands out beyond the walls."""
    return [p for p in (candidate.solid, candidate.beyond) if p is not None]


def side_view(parts: Sequence[Polyhedron], turn_deg: float, pixels: int) -> ByteArray:
    """(rows, cols, 3) polyhedra turned about a vertical axis."""
    drawn = surfaces_of(parts)
    turn = np.radians(turn_deg)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    middle = drawn.corners.reshape(-1, 3).mean(axis=0)
    corners = (drawn.corners - middle) @ rotation.T
    ground = surfaces_of([_slab(corners)])
    return draw_models(replace(drawn, corners=corners), ground, pixels)


def _slab(corners: FloatArray) -> Polyhedron:
    """Ground below, so that shadows fall on something."""
    low, high = corners.reshape(-1, 3).min(axis=0), corners.reshape(-1, 3).max(axis=0)
    ring = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    ring = ring + 1.5 * np.sign(ring - ring.mean(axis=0))
    xyz = np.column_stack([ring, np.full(4, low[2])])
    return Polyhedron(xyz, (Face(((0, 1, 2, 3),), Semantic.OUTER_CEILING),))

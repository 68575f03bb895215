"""The most useful parameters: those that shipped workflows, README and docs set.

What is not here is set once in a while by somebody who knows the algorithm; ``cityflow parameters --all`` lists it.
"""

from __future__ import annotations

from collections.abc import Mapping

from cityflow.runs.known_keys import Key

COMMON = (
    "tiles.tile_m", "tiles.index_cell_m", "points.source",
    "raw.pattern", "raw.bits", "raw.calibration.folder", "raw.undistort", "raw.near_infrared.folder",
    "orient.bound_px", "orient.adjustment.calibrate", "orient.refine",
    "images.level", "images.cell_m", "images.least_views", "images.most_ortho_tilt", "images.frames",
    "match.memory_mb",
    "surface.cell_m", "surface.fill_m", "surface.dtm.method", "surface.cover.building_height_m",
    "image_surface.dtm.method", "image_surface.cover.building_height_m", "walls.noise.remove",
    "outline.source", "outline.found.regions.minimum_height_m", "outline.found.regions.minimum_area_m2",
    "outline.found.regions.minimum_courtyard_m2", "outline.walls_in.wanted",
    "split.when", "split.method.threshold", "split.method.minimum_area_m2", "edits.path",
    "reconstruct.methods", "reconstruct.with_overhangs",
    "texture.when", "texture.most_images", "texture.ranking", "texture.patches.finest_m",
    "atlas.form", "atlas.quality", "atlas.full_colour",
    "windows.when", "windows.coarsest_m",
    "export.formats", "export.drape_px", "export.terrain.tolerance_m",
    "report.pages.failed", "report.looks",
    "execution.max_in_flight", "execution.match.memory_mb", "execution.reconstruct.time_s", "execution.reconstruct.memory_mb",
)  # fmt: skip
"""In the order of the model."""


def described_common(keys: Mapping[str, Key]) -> str:
    """A line each of those that `keys` has, and how many more there are."""
    lines = [keys[name].line(name) for name in COMMON if name in keys]
    rest = len(keys) - len(lines)
    return "\n".join(
        [
            *lines,
            "",
            f"{rest} more: `cityflow parameters --all` shows them all, `cityflow parameters WORD` those with this word.",
        ]
    )


def offered(keys: Mapping[str, Key], begin: str) -> list[str]:
    """What a shell offers: the common ones where nothing is typed yet, else every key with this beginning."""
    return [key for key in keys if key.startswith(begin)] if begin else [key for key in COMMON if key in keys]

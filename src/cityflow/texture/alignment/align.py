"""The photographs of a unit, moved to the edges of the models where these are significantly off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cityflow.core.building import Polyhedron
from cityflow.texture.alignment.edge_shift import edge_shift, shifted
from cityflow.texture.alignment.model_edges import edge_samples
from cityflow.texture.ortho_image import is_ortho
from cityflow.texture.source_image import Source
from cityflow.texture.visibility.scene import Scene


def aligned(
    sources: Sequence[Source], models: Sequence[Polyhedron], scene: Scene, reach_px: float
) -> tuple[list[Source], dict[str, tuple[float, float]]]:
    """The sources, and by how many pixels (right, down) the principal points of which images were moved.

    Parameters
    ----------
    models : the unit, and those around it;  scene : what may stand before them
    reach_px : largest shift along each axis, pixels; 0: nothing is moved
    """
    found, moved = list(sources), {}
    samples = edge_samples(models) if reach_px > 0 else None
    for k, source in enumerate(sources):
        if samples is None or is_ortho(source.image):
            continue
        shift = edge_shift(source.colour, samples, scene, reach_px)
        if shift is not None and shift.is_significant:
            found[k] = replace(source, colour=shifted(source.colour, shift.shift))
            right, down = (round(float(v), 2) for v in shift.shift)
            moved[source.image.name] = (right, down)
    return found, moved

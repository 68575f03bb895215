"""How bright a unit is shown, so that nothing becomes white that is not white in the photographs.

The balance of a survey makes all images as bright as the median one, and the images of a unit as bright as their median. What is bright in an image that both
make brighter would be saturated. So one gain for all images and bands makes the whole unit darker, as far as its highlights need it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np

from cityflow.texture.comparisons import FaceSamples
from cityflow.texture.source import SAME, SATURATED, WHITE, LinearModel

HIGHLIGHTS = 0.999
"""Share of what images show of a unit that stays below white, where the photographs are; what is left are sparkles. Set by hand."""
FEWEST = 12
"""Fewer cells tell no highlights; set by hand."""


def below_white(
    models: Mapping[int, LinearModel], faces: Iterable[tuple[FaceSamples, Collection[int]]], images: Iterable[int]
) -> dict[int, LinearModel]:
    """The models of all `images`, each darker by the same gain where highlights need it; else the models as they are.

    Parameters
    ----------
    faces : of each the colours in the images, and those of them that it gets its pixels from
    """
    level = _level(models, faces)
    if level == 1.0:
        return dict(models)
    darker = LinearModel(np.full(3, level), np.zeros(3))
    return {image: darker.after(models.get(image, SAME)) for image in sorted(images)}


def _level(models: Mapping[int, LinearModel], faces: Iterable[tuple[FaceSamples, Collection[int]]]) -> float:
    """The gain, 1 at most."""
    brightest = [np.empty(0, np.float32)]
    for samples, own in faces:
        for image, colours in zip(samples.images, samples.colours, strict=True):
            if image in own:
                shown = models.get(image, SAME).applied(colours).max(axis=1)
                brightest.append(shown[~np.isnan(shown)])
    values = np.concatenate(brightest)
    if len(values) < FEWEST:
        return 1.0
    return min(1.0, SATURATED * WHITE / max(float(np.quantile(values, HIGHLIGHTS)), 1.0))

from __future__ import annotations

import numpy as np
import pytest

from cityflow.texture.comparisons import FaceSamples
from cityflow.texture.highlights import below_white
from cityflow.texture.source import LinearModel

BRIGHTER = LinearModel(np.full(3, 1.2), np.zeros(3))


def roof(*values: float) -> FaceSamples:
    """A face of so many greys in image 0, and in image 1 all of them near white."""
    colours = np.repeat(np.array([values, [245.0] * len(values)], np.float32)[..., None], 3, axis=2)
    return FaceSamples((0, 1), colours, np.ones(2))


def test_a_gain_makes_nothing_white_that_is_not_white_in_the_photograph() -> None:
    models = below_white({0: BRIGHTER}, [(roof(*np.linspace(60, 235, 400)), {0})], {0, 1})
    shown = models[0].applied(np.full((1, 3), 235, np.float32))
    assert shown.max() == pytest.approx(250, abs=1.5)
    # and all images of the unit go the same way
    assert models[0].gain / BRIGHTER.gain == pytest.approx(models[1].gain)


def test_units_without_highlights_stay_as_they_are() -> None:
    models = below_white({0: BRIGHTER}, [(roof(*np.linspace(60, 200, 400)), {0})], {0, 1})
    assert models == {0: BRIGHTER}


def test_highlights_of_a_face_are_those_of_the_images_that_paint_it() -> None:
    face = roof(*np.linspace(60, 200, 400))
    brighter = {0: BRIGHTER, 1: BRIGHTER}
    assert below_white(brighter, [(face, {0})], {0, 1}) == brighter
    assert below_white(brighter, [(face, {0, 1})], {0, 1})[1].gain[0] == pytest.approx(250 / 245, abs=0.01)


def test_what_the_sensor_cut_off_tells_nothing() -> None:
    face = roof(*np.linspace(60, 200, 400))
    face.colours[0, 200:] = np.nan
    assert below_white({0: BRIGHTER}, [(face, {0})], {0}) == {0: BRIGHTER}
    assert below_white({0: BRIGHTER}, [], {0}) == {0: BRIGHTER}

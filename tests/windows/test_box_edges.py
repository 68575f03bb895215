from __future__ import annotations

import numpy as np
import pytest

from cityflow.windows.box_edges import BRIGHT, DARK, without_bars
from cityflow.windows.facade_picture import Picture
from cityflow.windows.window_parameters import WindowParameters


def picture(light: np.ndarray, cell: float) -> Picture:
    everywhere = np.ones(light.shape, bool)
    return Picture(light, np.zeros_like(light), everywhere, everywhere, 0.0, light.shape[0] * cell, cell, cell)


@pytest.mark.parametrize("cell", [0.03, 0.045, 0.06, 0.08, 0.11, 0.17, 0.3])
@pytest.mark.parametrize("sign", [DARK, BRIGHT])
def test_taking_out_bars_moves_nothing(cell: float, sign: int) -> None:
    """Squares of even size have no middle cell; what is wider than a bar stays where it is, all the same."""
    light = np.full((60, 70), 0.5, np.float32)
    light[20:40, 30:50] += sign * 0.3
    out = without_bars(picture(light, cell), light, sign, WindowParameters())
    inner = np.zeros(light.shape, bool)
    inner[21:39, 31:49] = True
    outer = np.ones(light.shape, bool)
    outer[20:40, 30:50] = False
    assert np.allclose(out[inner], 0.5 + sign * 0.3)
    assert np.allclose(out[outer], 0.5)


@pytest.mark.parametrize("sign", [DARK, BRIGHT])
def test_a_bar_is_taken_out(sign: int) -> None:
    light = np.full((60, 70), 0.5, np.float32)
    light[10:50, 20:50] += sign * 0.3
    light[10:50, 34:36] = 0.5
    out = without_bars(picture(light, 0.05), light, sign, WindowParameters())
    assert np.allclose(out[12:48, 22:48], 0.5 + sign * 0.3)

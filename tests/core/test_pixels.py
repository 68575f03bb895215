from __future__ import annotations

import numpy as np
import pytest

from cityflow.core import pixels
from cityflow.core.pixels import reduced


@pytest.mark.parametrize("level", [1, 2, 3])
def test_bands_of_rows_leave_no_seam(monkeypatch: pytest.MonkeyPatch, level: int) -> None:
    array = np.random.default_rng(0).integers(0, 256, (101, 67, 3), dtype=np.uint8)
    monkeypatch.setattr(pixels, "AT_ONCE", 1000)
    step = 1 << level
    found = reduced(array, level)
    assert found.shape == (-(-101 // step), -(-67 // step), 3)
    for row, col in np.ndindex(found.shape[:2]):
        block = array[row * step : (row + 1) * step, col * step : (col + 1) * step].astype(np.float64)
        assert np.abs(found[row, col] - block.mean(axis=(0, 1))).max() <= 0.5

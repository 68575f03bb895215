from __future__ import annotations

import base64
import io

import numpy as np
from PIL import Image

from cityflow.viewer.picture import MOST_BYTES, picture


def test_a_picture_comes_back_and_stays_small() -> None:
    """Noise is the worst that a picture can hold."""
    noise = np.random.default_rng(0).integers(0, 256, (700, 900, 3), np.uint8)
    smooth = np.repeat(np.linspace(0, 255, 900).astype(np.uint8)[None, :, None], 3, axis=2).repeat(700, axis=0)
    for pixels in (noise, smooth):
        made = picture("a", "b", pixels, (("roof", (196, 88, 70)),))
        found = np.asarray(Image.open(io.BytesIO(made.jpeg)))
        assert len(made.jpeg) <= MOST_BYTES
        assert found.shape == (700, 900, 3)
        assert (made.width, made.height) == (900, 700)
        assert made.key == (("roof", "#c45846"),)
        assert made == picture("a", "b", pixels, (("roof", (196, 88, 70)),))
    assert np.abs(found.astype(int) - smooth).mean() < 2
    assert base64.b64decode(made.address.split(",", 1)[1]) == made.jpeg

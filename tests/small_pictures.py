"""Reports with small pictures: one is written at the end of each of a hundred commands, and takes half of their time; those of Delft
(`cluster/test_delft_run.py`) have pictures of the usual size."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from cityflow.reporting import model_pictures, outline_pictures, raster_pictures, unit_pages
from cityflow.viewer import side_view

SMALL_PICTURES = (
    (side_view, "WIDTH", 152), (side_view, "HEIGHT", 96), (model_pictures, "MOST_PIXELS", 240),
    (outline_pictures, "MOST_PIXELS", 240), (raster_pictures, "FRAME_PIXELS", 140), (unit_pages, "CANDIDATE_PX", 60),
)  # fmt: skip


def draw_small(patch: pytest.MonkeyPatch) -> None:
    """As long as the patch lasts."""
    for module, name, pixels in SMALL_PICTURES:
        patch.setattr(module, name, pixels)


@pytest.fixture(autouse=True, scope="module")
def small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        draw_small(patch)
        yield

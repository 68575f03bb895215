"""Reports with small pictures: one is written at the end of each of a hundred commands, and takes half of their time; those of Delft
(`cluster/test_delft_run.py`) have pictures of the usual size."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from cityflow.flow.store import Store
from cityflow.reporting import model_pictures, outline_pictures, pictures, raster_pictures, run_report, unit_pages
from cityflow.viewer import side_view

SMALL_PICTURES = (
    (side_view, "WIDTH", 152), (side_view, "HEIGHT", 96), (model_pictures, "MOST_PIXELS", 240),
    (outline_pictures, "MOST_PIXELS", 240), (raster_pictures, "FRAME_PIXELS", 140), (unit_pages, "CANDIDATE_PX", 60),
)  # fmt: skip


def draw_small(patch: pytest.MonkeyPatch) -> None:
    """As long as the patch lasts."""
    for module, name, pixels in SMALL_PICTURES:
        patch.setattr(module, name, pixels)


def draw_once(patch: pytest.MonkeyPatch) -> None:
    """Pictures of the city only in the first report of each RUN, not after each command upon it: they take a third of the command's own time."""

    def first(store: Store, *given: Any) -> pictures.RunPictures:
        return pictures.RunPictures() if store.exists("report.html") else pictures.run_pictures(store, *given)

    patch.setattr(run_report, "run_pictures", first)


@pytest.fixture(autouse=True, scope="module")
def small_pictures() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        draw_small(patch)
        yield

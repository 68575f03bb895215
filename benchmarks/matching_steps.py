"""The steps of dense matching as a benchmark's table has them, and the work that the matcher does."""

from __future__ import annotations

from typing import Any

from step_times import Step

M = "cityflow.matching"


_LEVEL = ["level 0"]
"""Of the block that is being matched."""


def _block(_lattice: Any, level: int, *_: Any) -> str:
    _LEVEL[0] = "level 0" if level == 0 else "coarse levels"
    return _LEVEL[0]


def _level(*_: Any, **__: Any) -> str:
    return _LEVEL[0]


def _searched(_reference: Any, _partner: Any, _low: int, chunks: Any, *_: Any, **__: Any) -> float:
    """Pixel-disparities of a block: chunks of sixteen."""
    return 16.0 * float(chunks.start[-1])


STEPS = (
    Step("decode", "cityflow.io.images.tiled_images:TiledImage.window"),
    Step("grey values", f"{M}.grey:GreyImage._tile"),
    Step("grey values", f"{M}.grey:_curve"),
    Step("resample", f"{M}.resample:resampled"),
    Step("census", f"{M}.census:census"),
    Step("cost, paths and the way back, {}", f"{M}.paths:best_shifts", _level, _searched),
    Step("chunks and speckles, {}", f"{M}.sgm:matched_block", _level),
    Step("put together, {}", f"{M}.lattice:PairLattice._matched", _block),
    Step("ranges", f"{M}.lattice:PairLattice._search"),
    Step("sub-pixel", f"{M}.subpixel:refined"),
    Step("parallax", f"{M}.parallax:vertical_parallax"),
    Step("which parts are needed", f"{M}.needed:NeededParts.narrow"),
    Step("depths of a pair", f"{M}.merge_depths:depths_of_pair"),
    Step("merge", f"{M}.merge_depths:merged"),
    Step("edges", f"{M}.depth_edges:at_image_edges"),
    Step("mixed pixels", f"{M}.smoothing:mixed_pixels"),
    Step("bilateral filter", f"{M}.smoothing:smoothed"),
    Step("dealt to ground tiles", f"{M}.match:_deal"),
    Step("writing", "cityflow.handover.depth_map_files:encode_depth_map"),
    Step("writing", "cityflow.flow.store:Store.write_bytes"),
)

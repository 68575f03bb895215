"""The steps of dense matching as a benchmark's table has them, and the work that the matcher does."""

from __future__ import annotations

from typing import Any

from step_times import Step

M = "cityflow.matching"


def _level(_left: Any, _right: Any, _count: int, level: int, *_: Any) -> str:
    return "level 0" if level == 0 else "coarse levels"


def _both_ways(left: Any, _right: Any, count: int, *_: Any) -> float:
    """Pixel-disparities of a block that is matched twice."""
    return 2.0 * left.shape[0] * (left.shape[1] - count) * count


STEPS = (
    Step("decode", "cityflow.io.images.tiled_images:TiledImage.window"),
    Step("grey values", f"{M}.grey:GreyImage._tile"),
    Step("grey values", f"{M}.grey:_curve"),
    Step("resample", f"{M}.resample:resampled"),
    Step("cost and aggregation, {}", f"{M}.sgm:matched_block", _level, _both_ways),
    Step("left-right check", f"{M}.sgm:_checked"),
    Step("ranges", f"{M}.lattice:PairLattice._range"),
    Step("sub-pixel", f"{M}.subpixel:refined"),
    Step("parallax", f"{M}.parallax:vertical_parallax"),
    Step("which parts are needed", f"{M}.needed:NeededParts.narrow"),
    Step("depths of a pair", f"{M}.merge:depths_of_pair"),
    Step("merge", f"{M}.merge:merged"),
    Step("edges", f"{M}.depth_edges:at_image_edges"),
    Step("mixed pixels", f"{M}.smoothing:mixed_pixels"),
    Step("bilateral filter", f"{M}.smoothing:smoothed"),
    Step("dealt to ground tiles", f"{M}.match:_deal"),
    Step("writing", "cityflow.handover.depth_map_files:encode_depth_map"),
    Step("writing", "cityflow.flow.store:Store.write_bytes"),
)

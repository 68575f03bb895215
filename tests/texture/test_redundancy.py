from __future__ import annotations

import numpy as np
import pytest

from cityflow.core.run_lengths import RunLengthMask
from cityflow.core.texture import FaceView, SeenFace
from cityflow.texture.redundancy import RedundancyParameters, kept, overlap_graph


def seen(image: int, mask: np.ndarray, gsd: float = 0.1) -> SeenFace:
    return SeenFace(FaceView(image, gsd, 30.0, 1.0), RunLengthMask.of(mask))


def strip(first: int, last: int, width: int = 100) -> np.ndarray:
    mask = np.zeros((10, width), bool)
    mask[:, first:last] = True
    return mask


def test_the_graph_counts_what_images_see_alone_and_in_common() -> None:
    graph = overlap_graph([seen(4, strip(0, 60)), seen(7, strip(40, 100), 0.2), seen(9, strip(0, 0))])
    assert graph.images == (4, 7, 9)
    assert graph.visible.tolist() == [600, 600, 0]
    assert graph.common[0, 1] == graph.common[1, 0] == 200
    assert graph.share[0, 1] == pytest.approx(1 / 3)
    assert graph.pixels[0] == pytest.approx(4 * graph.pixels[1])
    assert graph.overlaps[0, 1] == pytest.approx(4 * graph.overlaps[1, 0])
    assert graph.seen_by([0, 1]).sum() == 1000


def test_edges_and_unions_decide() -> None:
    """An image goes for one better image that sees nearly all of what it sees, and for two that do so together."""
    parameters = RedundancyParameters(least_covered=0.0)
    left, right, middle, last = strip(0, 60), strip(50, 100, 120), strip(56, 99, 120), strip(20, 90, 120)
    wide = [
        seen(0, np.pad(left, ((0, 0), (0, 20)))),
        seen(1, right),
        seen(2, middle),
        seen(3, last),
        seen(4, strip(95, 120, 120)),
    ]
    graph = overlap_graph(wide)
    assert graph.share[2, 1] == 1.0
    assert graph.share[3].max(initial=0.0, where=np.arange(5) < 2) < 0.6
    assert kept(wide, [0, 1, 2, 3, 4], parameters.model_copy(update={"tie": 0.5})) == (0, 1, 4)


def test_the_root_has_most_pixels_and_the_rest_follow_the_ranking() -> None:
    faces = [seen(0, strip(0, 20)), seen(1, strip(10, 90)), seen(2, strip(80, 100))]
    assert kept(faces, [2, 0, 1]) == (1, 2, 0)


def test_near_ties_for_root_follow_the_ranking() -> None:
    faces = [seen(0, strip(0, 100)), seen(1, strip(0, 98))]
    assert kept(faces, [1, 0])[0] == 1
    assert kept(faces, [1, 0], RedundancyParameters(tie=0.0))[0] == 0


def test_a_finer_image_of_most_of_a_face_is_rather_root_than_a_coarse_one_of_all() -> None:
    assert kept([seen(0, strip(0, 100), 0.2), seen(1, strip(0, 90), 0.1)], [1, 0]) == (1, 0)


def test_images_that_show_nothing_new_go() -> None:
    faces = [seen(k, strip(0, 100)) for k in range(120)]
    assert kept(faces, list(range(120))) == (0,)
    assert kept([seen(0, strip(0, 80)), seen(1, strip(0, 81)), seen(2, strip(60, 100))], [0, 1, 2]) == (0, 2)


def test_no_cell_is_lost_to_the_least_gain() -> None:
    """An image that adds little comes back if nobody else shows what it adds."""
    faces = [seen(0, strip(0, 96)), seen(1, strip(3, 100))]
    assert kept(faces, [0, 1], RedundancyParameters(least_gain=0.2)) == (0, 1)
    assert kept(faces, [0, 1], RedundancyParameters(least_gain=0.2, least_covered=0.9)) == (0,)


def test_when_too_many_remain_those_go_that_show_least() -> None:
    rng = np.random.default_rng(5)
    faces = [seen(k, rng.random((20, 20)) < 0.05 + 0.01 * (k % 7)) for k in range(400)]
    order = list(rng.permutation(400))
    few = kept(faces, order, RedundancyParameters(most_images=5))
    assert len(few) == 5
    assert [order.index(i) for i in few[1:]] == sorted(order.index(i) for i in few[1:])
    union = np.logical_or.reduce([faces[i].mask.mask() for i in few]).sum()
    first = np.logical_or.reduce([faces[i].mask.mask() for i in [few[0], *order[:4]]]).sum()
    assert union > first


def test_images_that_see_nothing_are_no_sources() -> None:
    assert kept([], []) == ()
    assert kept([seen(0, strip(0, 0)), seen(1, strip(0, 0))], [0, 1]) == ()
    assert kept([seen(0, strip(0, 0)), seen(1, strip(5, 6))], [0, 1]) == (1,)

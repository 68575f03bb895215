from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import box

from cityflow.core.building import Semantic
from cityflow.core.openings import FaceOpenings
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, FaceFigures, FacePlane, Patch
from cityflow.evaluation.windows import WindowCounts, compare_windows, total
from cityflow.synthetic.drawn_facades import STYLES, DrawnFacade, ImageErrors, draw_facade
from cityflow.synthetic.town_facades import WINDOW
from cityflow.windows.find import TOO_COARSE, UNSEEN, find_unit_windows, find_windows
from cityflow.windows.window_parameters import WindowParameters

CLEAR = ImageErrors(gsd_m=0.07, noise=2.0)
P = WindowParameters()


def textured(drawn: DrawnFacade, turn: float = 0.0) -> tuple[FacePlane, Patch]:
    """A drawn façade as the texture of a wall that stands somewhere and looks anywhere."""
    wide, high = drawn.size_m
    right = np.array([np.cos(turn), np.sin(turn), 0.0])
    up, origin = np.array([0, 0, 1.0]), np.array([85000.0, 447000.0, 3.0])
    st = np.array([[0, 0], [wide, 0], [wide, high], [0, high]])
    ring = origin + st[:, :1] * right + st[:, 1:] * up
    face = FacePlane(
        ("solid", 4), Semantic.WALL, (ring,), origin, right, up, np.cross(right, up), box(0, 0, wide, high)
    )
    corners = np.column_stack([st[:, 0] / drawn.cell_m, (high - st[:, 1]) / drawn.cell_m, np.ones(4)])
    index = np.where(drawn.seen, FIRST_IMAGE, INTERPOLATED).astype(np.uint16)
    figures = FaceFigures(drawn.cell_m, 45.0, 1, 1, 0.0, 0.0)
    return face, Patch(face.key, drawn.pixels, index, np.ones_like(drawn.seen), (corners,), figures)


def counted(drawn: DrawnFacade, found: FaceOpenings) -> WindowCounts:
    of = drawn.openings[:, 4] == WINDOW
    bounds = np.array([o.bounds for o in found.openings if o.kind == "window"]).reshape(-1, 4)
    return compare_windows(bounds, drawn.openings[of][:, [0, 2, 1, 3]], drawn.visible[of] > 0.8)


@pytest.mark.parametrize("style", STYLES)
def test_windows_of_every_style_are_found(style: str) -> None:
    rng = np.random.default_rng(5)
    counts = []
    for _ in range(4):
        drawn = draw_facade(style, replace(CLEAR, exposure=float(rng.uniform(0.7, 1.2))), rng)  # type: ignore[arg-type]
        counts.append(counted(drawn, find_windows(*textured(drawn), P)))
    whole = total(counts)
    assert whole.true >= 10
    assert whole.recall >= 0.85
    assert whole.precision >= 0.85


@pytest.mark.parametrize("style", ["blank", "glass"])
@pytest.mark.parametrize("shadow", [False, True])
def test_walls_without_windows_show_next_to_none(style: str, shadow: bool) -> None:
    rng = np.random.default_rng(8)
    drawn = [draw_facade(style, replace(CLEAR, trees=1, shadow=shadow), rng) for _ in range(4)]  # type: ignore[arg-type]
    found = [len(find_windows(*textured(d), P).openings) for d in drawn]
    area = sum(d.size_m[0] * d.size_m[1] for d in drawn)
    assert sum(found) <= area / 60


def test_openings_lie_in_the_plane_of_a_wall_that_looks_anywhere() -> None:
    drawn = draw_facade("plain", CLEAR, np.random.default_rng(3))
    face, patch = textured(drawn, turn=2.1)
    found = find_windows(face, patch, P)
    assert found.openings
    for o in found.openings:
        assert np.abs((o.ring - face.origin) @ face.normal).max() < 2e-4
        assert face.on_plane(o.ring[[0, 2]]).ravel() == pytest.approx(np.array(o.bounds), abs=2e-4)
        area = np.cross(o.ring[1] - o.ring[0], o.ring[3] - o.ring[0]) @ face.normal
        assert area == pytest.approx(o.area, abs=1e-3)
        assert 0.5 <= o.confidence <= 1


def test_figures_of_a_wall_follow_from_its_windows() -> None:
    drawn = draw_facade("plain", replace(CLEAR, noise=1.0), np.random.default_rng(11))
    found = find_windows(*textured(drawn), P)
    true = drawn.openings[drawn.openings[:, 4] == WINDOW]
    share = ((true[:, 1] - true[:, 0]) * (true[:, 3] - true[:, 2])).sum() / (drawn.size_m[0] * drawn.size_m[1])
    assert found.storeys == drawn.storeys
    assert found.window_to_wall == pytest.approx(share, rel=0.2)


def test_windows_are_looked_for_only_where_the_texture_is_true() -> None:
    drawn = draw_facade("plain", CLEAR, np.random.default_rng(5))
    face, patch = textured(drawn)
    left = patch.index.copy()
    left[:, : left.shape[1] // 2] = INTERPOLATED
    found = find_windows(face, replace(patch, index=left), P)
    assert found.openings
    assert min(o.bounds[0] for o in found.openings) >= drawn.size_m[0] / 2 - 0.2
    none = find_windows(face, replace(patch, index=np.full_like(left, INTERPOLATED)), P)
    assert (none.openings, none.reason, none.window_to_wall) == ((), UNSEEN, None)


def test_a_texture_that_is_too_coarse_shows_none_and_says_so() -> None:
    drawn = draw_facade("plain", replace(CLEAR, gsd_m=0.25), np.random.default_rng(3))
    found = find_windows(*textured(drawn), P)
    assert (found.openings, found.reason, found.window_to_wall) == ((), TOO_COARSE, None)


def test_openings_can_be_holes() -> None:
    """Within the wall and apart from one another, also doors that stand on its foot."""
    rng, doors = np.random.default_rng(21), 0
    for style in STYLES:
        drawn = draw_facade(style, replace(CLEAR, trees=1), rng)  # type: ignore[arg-type]
        face, patch = textured(drawn)
        openings = find_windows(face, patch, P).openings
        boxes = [box(*o.bounds) for o in openings]
        doors += sum(o.kind == "door" for o in openings)
        assert all(face.polygon.buffer(-0.01).contains(b) for b in boxes)
        assert all(a.distance(b) > 0.01 for k, a in enumerate(boxes) for b in boxes[:k])
    assert doors


def test_the_unit_joins_its_walls() -> None:
    rng = np.random.default_rng(11)
    walls = []
    for k in range(2):
        face, patch = textured(draw_facade("plain", CLEAR, rng), turn=1.3 * k)
        walls.append((replace(face, key=("solid", k)), replace(patch, key=("solid", k))))
    faces, patches = [f for f, _ in walls], {p.key: p for _, p in walls}
    unit = find_unit_windows(faces, patches, P)
    single = [find_windows(f, p, P) for f, p in walls]
    assert len(unit.openings) == sum(len(s.openings) for s in single)
    seen = [s.seen_m2 for s in single]
    ratio = sum((s.window_to_wall or 0) * m for s, m in zip(single, seen, strict=True)) / sum(seen)
    assert unit.window_to_wall_ratio == pytest.approx(ratio)
    assert unit.storeys == max(s.storeys for s in single)
    assert find_unit_windows(faces, {}, P).storeys is None


def test_the_same_picture_gives_the_same_windows() -> None:
    drawn = draw_facade("muntins", CLEAR, np.random.default_rng(2))
    one, two = (find_windows(*textured(drawn), P) for _ in range(2))
    assert [(o.bounds, o.confidence) for o in one.openings] == [(o.bounds, o.confidence) for o in two.openings]

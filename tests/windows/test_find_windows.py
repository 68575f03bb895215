from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon, box

from cityflow.core.building import Semantic
from cityflow.core.openings import FaceOpenings
from cityflow.core.texture import FIRST_IMAGE, INTERPOLATED, FaceFigures, FacePlane, Patch
from cityflow.evaluation.window_accuracy import WindowCounts, compare_windows, intersection_over_union, total
from cityflow.synthetic.town_facades import DOOR, WINDOW
from cityflow.windows.find_windows import (
    GLASS,
    PANELS,
    TOO_COARSE,
    UNSEEN,
    find_unit_windows,
    find_windows,
    unit_openings,
)
from cityflow.windows.window_parameters import WindowParameters
from scenes.drawn_facades import STYLES, DrawnFacade, draw_facade
from scenes.facade_errors import ImageErrors
from scenes.hard_facades import HARD, draw_hard_facade
from scenes.hard_walls import WINDOWLESS

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
        found = find_windows(*textured(drawn), P)
        assert found.reason == "", "never said to be of glass"
        counts.append(counted(drawn, found))
    whole = total(counts)
    assert whole.true >= 10
    assert whole.recall >= 0.85
    assert whole.precision >= 0.85


@pytest.mark.parametrize(("style", "most"), [("blank", 1), ("glass", 2)])
@pytest.mark.parametrize("shadow", [False, True])
def test_walls_without_windows_show_next_to_none(style: str, most: int, shadow: bool) -> None:
    rng = np.random.default_rng(8)
    drawn = [draw_facade(style, replace(CLEAR, trees=1, shadow=shadow), rng) for _ in range(4)]  # type: ignore[arg-type]
    found = [find_windows(*textured(d), P) for d in drawn]
    assert sum(len(f.openings) for f in found) <= most
    assert all(f.window_to_wall == 0.0 for f in found if not f.openings and not f.reason)


@pytest.mark.parametrize("style", WINDOWLESS)
def test_what_only_looks_like_windows_is_none(style: str) -> None:
    """Four façades of each kind, of 60 to 350 m² each; letters are the hardest."""
    rng = np.random.default_rng(9)
    drawn = [draw_hard_facade(style, CLEAR, rng) for _ in range(4)]
    found = [o for d in drawn for o in find_windows(*textured(d), P).openings if o.kind == "window"]
    assert len(found) <= {"signs": 12}.get(style, 2)


@pytest.mark.parametrize("style", ["cornices", "bay", "slabs", "hard shadows", "arches", "reflecting panes"])
def test_windows_are_found_among_what_misleads(style: str) -> None:
    rng = np.random.default_rng(4)
    counts = []
    for _ in range(3):
        drawn = draw_hard_facade(style, CLEAR, rng)
        found = find_windows(*textured(drawn), P)
        assert found.reason == "", "never said to be of glass"
        counts.append(counted(drawn, found))
    whole = total(counts)
    assert whole.true >= 8
    assert whole.precision >= 0.8
    assert whole.recall >= 0.8


def test_panels_from_end_to_end_are_said_to_be_panels() -> None:
    rng = np.random.default_rng(1)
    bright, joint = np.full((200, 400, 3), 190, np.uint8), 60
    bright[::20], bright[1::20], bright[:, ::25], bright[:, 1::25] = joint, joint, joint, joint
    noisy = np.clip(bright + rng.normal(0, 3, bright.shape), 0, 255).astype(np.uint8)
    drawn = DrawnFacade(noisy, np.ones((200, 400), bool), 0.06, (24.0, 12.0), np.empty((0, 5)), np.empty(0), 0)
    found = find_windows(*textured(drawn), P)
    assert not found.openings
    assert found.reason in ("", PANELS, GLASS)


def test_who_is_surer_is_right_more_often() -> None:
    rng, sure, right = np.random.default_rng(6), [], []
    noisy = ImageErrors(gsd_m=0.1, noise=6.0, blur_px=1.2, trees=2, exposure=0.7)
    for style in ("muntins", "balconies", "half-drawn blinds", "signs", "irregular", "shutters"):
        for _ in range(3):
            hard = style in HARD or style in WINDOWLESS
            drawn = draw_hard_facade(style, noisy, rng) if hard else draw_facade(style, noisy, rng)  # type: ignore[arg-type]
            windows = [o for o in find_windows(*textured(drawn), P).openings if o.kind == "window"]
            boxes = np.array([o.bounds for o in windows]).reshape(-1, 4)
            shared = intersection_over_union(boxes, drawn.openings[:, [0, 2, 1, 3]]).max(axis=1, initial=0.0)
            sure += [o.confidence for o in windows]
            right += (shared >= 0.5).tolist()
    wrong = ~np.array(right)
    assert wrong.sum() >= 3
    assert np.mean(np.array(sure)[~wrong]) > np.mean(np.array(sure)[wrong]) + 0.05


def test_doors_are_where_doors_are() -> None:
    rng, right, wrong = np.random.default_rng(5), 0, 0
    for style in ("plain", "frames", "double", "blinds") * 2:
        drawn = draw_facade(style, CLEAR, rng)
        doors = np.array([o.bounds for o in find_windows(*textured(drawn), P).openings if o.kind == "door"])
        true = drawn.openings[drawn.openings[:, 4] == DOOR][:, [0, 2, 1, 3]]
        shared = intersection_over_union(doors.reshape(-1, 4), true).max(axis=1, initial=0.0)
        right, wrong = right + int((shared > 0.5).sum()), wrong + int((shared <= 0.5).sum())
    assert right >= 2
    assert wrong <= 1


def test_a_faint_window_is_asked_for_by_its_row_and_said_to_be() -> None:
    """The fourth of five windows has a third of the contrast of the others."""
    pixels = np.full((100, 260, 3), 170, np.float64)
    for k in range(5):
        pixels[30:54, 25 + 45 * k : 41 + 45 * k] = 143 if k == 3 else 60
    pixels += np.random.default_rng(2).normal(0, 9, pixels.shape)
    drawn = DrawnFacade(
        np.clip(pixels, 0, 255).astype(np.uint8), np.ones((100, 260), bool), 0.07, (18.2, 7.0), np.empty((0, 5)), np.empty(0), 1
    )  # fmt: skip
    found = sorted(find_windows(*textured(drawn), P).openings, key=lambda o: o.bounds[0])
    assert len(found) == 5
    assert [o.support for o in found] == [4] * 5


def test_a_long_facade_is_looked_at_in_strips() -> None:
    """Windows over 95 m, also at the seams, each once."""
    left = 1.5 + 3.0 * np.arange(31)
    pixels = np.full((80, 1357, 3), 170, np.float64)
    for a in left:
        pixels[30:52, round(a / 0.07) : round((a + 1.2) / 0.07)] = 60
    pixels += np.random.default_rng(2).normal(0, 3, pixels.shape)
    drawn = DrawnFacade(
        np.clip(pixels, 0, 255).astype(np.uint8), np.ones((80, 1357), bool), 0.07, (94.99, 5.6), np.empty((0, 5)), np.empty(0), 1
    )  # fmt: skip
    found = np.sort([o.bounds[0] for o in find_windows(*textured(drawn), P).openings])
    assert found == pytest.approx(left, abs=0.15)


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


def test_figures_of_a_wall_follow_from_its_windows() -> None:
    drawn = draw_facade("plain", replace(CLEAR, noise=1.0), np.random.default_rng(5))
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
    assert unit.seen_share == pytest.approx(1.0, abs=0.03)
    assert len(unit.openings) == sum(len(s.openings) for s in single)
    seen = [s.seen_m2 for s in single]
    ratio = sum((s.window_to_wall or 0) * m for s, m in zip(single, seen, strict=True)) / sum(seen)
    assert unit.window_to_wall_ratio == pytest.approx(ratio)
    assert unit.storeys == max(s.storeys for s in single)
    assert find_unit_windows(faces, {}, P).storeys is None


def test_what_is_seen_of_a_wall_is_never_more_than_the_wall() -> None:
    drawn = draw_facade("plain", replace(CLEAR, gsd_m=0.19), np.random.default_rng(3))
    face, patch = textured(drawn)
    gable = np.array([[0.0, 0.0], [drawn.size_m[0], 0], [drawn.size_m[0], 2.0], [drawn.size_m[0] / 2, drawn.size_m[1]], [0, 2.0]])  # fmt: skip
    ring = face.world(gable)
    corners = np.column_stack([gable[:, 0] / 0.19, (drawn.size_m[1] - gable[:, 1]) / 0.19, np.ones(5)])
    face = replace(face, rings=(ring,), polygon=Polygon(gable))
    found = find_windows(face, replace(patch, corners=(corners,)), P)
    assert found.seen_m2 == pytest.approx(found.area_m2, rel=0.01)


def test_little_that_is_seen_says_nothing_of_the_unit() -> None:
    drawn = draw_facade("plain", CLEAR, np.random.default_rng(5))
    face, patch = textured(drawn)
    index = patch.index.copy()
    index[:, index.shape[1] // 6 :] = INTERPOLATED
    one = find_windows(face, replace(patch, index=index), P)
    assert (one.reason, one.window_to_wall) == ("", None)
    unit = unit_openings([face], [one])
    assert unit.window_to_wall_ratio is None
    assert unit.seen_share == pytest.approx(1 / 6, abs=0.02)
    whole = find_windows(face, patch, P)
    others = [replace(face, key=("solid", k)) for k in range(1, 6)]
    assert unit_openings([face], [whole]).window_to_wall_ratio == pytest.approx(whole.window_to_wall)
    assert unit_openings([face, *others], [whole]).window_to_wall_ratio is None


def test_the_same_picture_gives_the_same_windows() -> None:
    drawn = draw_facade("muntins", CLEAR, np.random.default_rng(2))
    one, two = (find_windows(*textured(drawn), P) for _ in range(2))
    assert [(o.bounds, o.confidence) for o in one.openings] == [(o.bounds, o.confidence) for o in two.openings]


def nth(style: str, seed: tuple[int, int], n: int) -> DrawnFacade:
    """The n-th façade that the benchmark draws of a style."""
    rng = np.random.default_rng(seed)
    for _ in range(n + 1):
        errors = ImageErrors.at_random(rng)
        drawn = draw_hard_facade(style, errors, rng) if style in HARD else draw_facade(style, errors, rng)  # type: ignore[arg-type]
    return drawn


def test_rows_do_not_ask_for_wings_of_shutters() -> None:
    """Panes as bright as their wall between dark wings, which stand in rows as windows do."""
    drawn = nth("shutters", (93, 3), 6)
    counts = counted(drawn, find_windows(*textured(drawn), P))
    assert counts.true == 33
    assert counts.recall >= 0.9
    assert counts.precision >= 0.9


def test_three_windows_are_no_window_with_its_shutters() -> None:
    drawn = nth("shops", (93, 19), 5)
    counts = counted(drawn, find_windows(*textured(drawn), P))
    assert counts.true == 22
    assert counts.recall >= 0.9
    assert counts.precision >= 0.9


@pytest.mark.parametrize(("style", "least"), [("glass", 5), ("mirror", 8)])
def test_facades_of_glass_say_so_and_no_ratio(style: str, least: int) -> None:
    rng = np.random.default_rng(13)
    drawn = [
        draw_hard_facade(style, CLEAR, rng) if style in WINDOWLESS else draw_facade(style, CLEAR, rng)  # type: ignore[arg-type]
        for _ in range(10)
    ]
    found = [find_windows(*textured(d), P) for d in drawn]
    refused = [f for f in found if f.reason]
    assert len(refused) >= least
    assert all(f.window_to_wall is None and not f.openings for f in refused)


def test_shops_are_never_said_to_be_of_glass() -> None:
    rng = np.random.default_rng(14)
    for _ in range(4):
        assert find_windows(*textured(draw_hard_facade("shops", CLEAR, rng)), P).reason == ""


def test_many_windows_that_are_nearly_sure_speak_against_glass() -> None:
    """Wings of shutters in line from foot to eaves, and windows of 0.8 to 0.9 between them."""
    drawn = nth("shutters", (71, 3), 4)
    counts = counted(drawn, find_windows(*textured(drawn), P))
    assert counts.true == 25
    assert counts.recall >= 0.9

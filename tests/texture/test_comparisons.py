from __future__ import annotations

import numpy as np
import pytest

from cityflow.texture.comparisons import FaceSamples, UnitCells, comparisons, spanning_trees

EXPOSURES = {0: (1.0, 0.0), 1: (0.25, 2.0), 2: (1.25, -8.0), 3: (0.9, 6.0), 4: (1.1, 0.0)}


def face(
    seed: int, images: dict[int, slice], cells: int = 500, mean: float = 120.0, outliers: float = 0.1
) -> FaceSamples:
    """A face with colours of its own, as images of unlike exposure show it, with noise, cars and glass."""
    rng = np.random.default_rng(seed)
    truth = np.clip(rng.normal([mean, 0.9 * mean, 0.8 * mean], 25, (cells, 3)), 20, 170)
    colours = np.full((len(images), cells, 3), np.nan, np.float32)
    for k, (image, seen) in enumerate(images.items()):
        gain, offset = EXPOSURES[image]
        values = truth[seen] * gain + offset + rng.normal(0, 2, truth[seen].shape)
        wrong = rng.random(len(values)) < outliers
        values[wrong] = rng.uniform(0, 255, (wrong.sum(), 3))
        colours[k, seen] = values
    pixels = np.array([float((~np.isnan(c[:, 0])).sum()) for c in colours])
    return FaceSamples(tuple(images), colours, pixels)


def test_cells_of_all_faces_stand_beside_each_other() -> None:
    one, two = face(1, {2: slice(0, 100), 0: slice(50, 500)}), face(2, {1: slice(0, 300), 2: slice(0, 500)}, cells=600)
    cells = UnitCells.of([one, two])
    assert cells.images == (0, 1, 2)
    assert cells.colours.shape == (3, 1100, 3)
    assert cells.seen.sum(axis=1).tolist() == [450, 300, 600]
    assert cells.pixels.tolist() == [450.0, 300.0, 600.0]
    assert np.array_equal(cells.colours[2, :100], one.colours[0, :100])
    assert np.array_equal(cells.colours[2, 500:1000], two.colours[1, :500])
    assert UnitCells.of([]).colours.shape == (0, 0, 3)


def test_grey_images_are_known() -> None:
    some = face(3, {0: slice(0, 400), 1: slice(0, 300)})
    some.colours[1] = some.colours[1].mean(axis=1, keepdims=True)
    assert UnitCells.of([some]).grey.tolist() == [False, True]


def test_too_few_cells_are_no_comparison() -> None:
    assert comparisons(UnitCells.of([face(7, {0: slice(0, 105), 1: slice(100, 300)})])) == []


def test_a_comparison_says_what_a_colour_would_be_in_the_other_image() -> None:
    (one,) = comparisons(UnitCells.of([face(8, {1: slice(0, 400), 2: slice(100, 500)})]))
    assert (one.first, one.second, one.cells) == (1, 2, 300)
    assert one.model.gain == pytest.approx([0.25 / 1.25] * 3, rel=0.08)


def test_trees_take_the_shortest_edges() -> None:
    whole = slice(0, 500)
    faces = [face(9, dict.fromkeys(range(4), whole), outliers=0.0), face(10, {0: whole, 3: whole})]
    edges = comparisons(UnitCells.of(faces))
    trees = spanning_trees([0, 1, 2, 3, 8], edges)
    assert len(trees) == 2
    used = {tuple(sorted((a, b))) for a, near in trees[0].items() for b, _ in near}
    assert len(used) == 3
    shortest = min(edges, key=lambda e: e.length)
    assert (shortest.first, shortest.second) in used

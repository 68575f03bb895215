from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from cityflow.core.arrays import Float32Array
from cityflow.texture.source_image import LinearModel
from cityflow.texture.unit_radiometry import FaceSamples, RadiometryParameters, balance

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


def corrected(models: dict[int, LinearModel], image: int) -> Float32Array:
    gain, offset = EXPOSURES[image]
    grey = np.full((1, 3), 100.0 * gain + offset, np.float32)
    return np.asarray(models[image].applied(grey)[0])


def test_images_are_made_like_the_one_with_most_pixels() -> None:
    whole = slice(0, 500)
    models = balance([face(1, {0: whole, 1: slice(0, 250), 2: slice(200, 400), 3: slice(350, 500)})])
    for image in (0, 1, 2, 3):
        assert corrected(models, image) == pytest.approx([100.0] * 3, abs=4.0)
    assert np.array_equal(models[0].gain, [1, 1, 1])


def test_models_are_handed_on_from_face_to_face() -> None:
    """No face shows 0 and 3 both; 1 and 2 join them, over faces of unlike colour."""
    half = slice(0, 250)
    faces = [
        face(1, {0: slice(0, 500), 1: half}),
        face(2, {1: half, 2: slice(100, 400)}, mean=60.0),
        face(3, {2: half, 3: half}, mean=140.0),
    ]
    models = balance(faces)
    same = np.array([corrected(models, image) for image in (0, 1, 2, 3)])
    assert np.ptp(same, axis=0).max() < 9.0
    assert same.mean() == pytest.approx(110.0, abs=20.0)


def test_an_odd_root_is_made_like_the_others() -> None:
    """Of five images one is four times too dark, and it has most pixels."""
    part = slice(0, 400)
    models = balance([face(4, {1: slice(0, 500), 0: part, 2: part, 3: part, 4: part})])
    exposed = [corrected(models, image).mean() for image in EXPOSURES]
    assert np.ptp(exposed) < 6.0
    assert np.mean(exposed) > 80.0


def test_images_that_nothing_joins_stay_as_they_are() -> None:
    models = balance([face(5, {0: slice(0, 250), 1: slice(250, 500)}), face(6, {4: slice(0, 500)})])
    for image in (0, 1, 4):
        assert np.array_equal(models[image].gain, [1, 1, 1])
        assert np.array_equal(models[image].offset, [0, 0, 0])


def test_colours_are_not_made_like_grey() -> None:
    colour = face(8, {0: slice(0, 400), 2: slice(0, 300), 4: slice(0, 500)}, outliers=0.0)
    colour.colours[2] = colour.colours[2].mean(axis=1, keepdims=True)
    models = balance([colour])
    assert np.array_equal(models[0].gain, [1, 1, 1])
    assert corrected(models, 2) == pytest.approx([100.0] * 3, abs=6.0)
    grey = models[4].applied(colour.colours[2])
    # as coloured as a grey image can be: the mean of each band
    assert np.nanmedian(grey, axis=0) == pytest.approx(np.nanmedian(colour.colours[0], axis=0), abs=6.0)


def test_the_order_of_faces_and_images_does_not_matter() -> None:
    whole, half = slice(0, 500), slice(100, 350)
    one = [face(1, {0: whole, 1: half, 2: half}), face(2, {2: whole, 3: half})]
    other = [FaceSamples(f.images[::-1], f.colours[::-1].copy(), f.pixels[::-1].copy()) for f in one[::-1]]
    a, b = balance(one), balance(other)
    assert sorted(a) == sorted(b)
    for image in a:
        assert a[image].gain == pytest.approx(b[image].gain, rel=1e-9)


def test_a_hundred_images_are_balanced_quickly() -> None:
    rng = np.random.default_rng(0)
    truth = rng.normal(110, 20, (800, 3))
    colours = (truth[None] + rng.normal(0, 3, (100, 800, 3))).astype(np.float32)
    samples = FaceSamples(tuple(range(100)), colours, np.full(100, 800.0))
    start = time.process_time()
    assert len(balance([samples])) == 100
    assert time.process_time() - start < 8.0


def test_a_bad_edge_of_the_tree_is_mended() -> None:
    """Only images 3 and 4 see a shop window, in which each mirrors something else; it is the shortest edge between the halves."""
    rng = np.random.default_rng(3)
    truth = rng.normal(110, 25, (600, 3)).clip(30, 180)
    colours = (truth[None] + rng.normal(0, 7, (8, 600, 3))).astype(np.float32)
    window = slice(300, 600)
    colours[:, window] = np.nan
    colours[3, window] = truth[window] + rng.normal(0, 1, (300, 3))
    colours[4, window] = truth[window] * 1.25 + rng.normal(0, 1, (300, 3))
    colours[:4, :130], colours[4:, 170:300] = np.nan, np.nan
    samples = FaceSamples(tuple(range(8)), colours, np.full(8, 600.0))
    bias = {}
    for sweeps in (0, 3, 6):
        models = balance([samples], RadiometryParameters(sweeps=sweeps))
        grey = [models[k].applied(np.full((1, 3), 110.0, np.float32)).mean() for k in (0, 1, 2, 5, 6, 7)]
        bias[sweeps] = abs(np.mean(grey[3:]) - np.mean(grey[:3]))
    assert bias[0] > 15.0
    # three are the default
    assert max(bias[3], bias[6]) < 0.5 * bias[0]


def test_a_follower_is_made_like_the_others_and_changes_none_of_them() -> None:
    whole = slice(0, 500)
    photographs = face(8, {0: whole, 1: whole, 2: whole})
    plain = balance([photographs])
    flat = photographs.colours[:1].mean(axis=1, keepdims=True) * 0.4 + photographs.colours[:1] * 0.6 + 20.0
    smooth = replace(
        photographs, images=(*photographs.images, 3), colours=np.concatenate([photographs.colours, flat]),
        pixels=np.append(photographs.pixels, 10 * photographs.pixels.max()),
    )  # fmt: skip
    led = balance([smooth], followers={3})
    assert all(np.array_equal(led[k].gain, plain[k].gain) for k in plain)
    assert all(np.array_equal(led[k].offset, plain[k].offset) for k in plain)
    shown, wanted = led[3].applied(flat[0]), plain[0].applied(photographs.colours[0])
    assert np.nanmean(np.abs(shown - wanted)) < 0.5 * np.nanmean(np.abs(flat[0] - wanted))
    assert set(balance([smooth], followers={0, 1, 2, 3})) == {0, 1, 2, 3}

"""Windows of drawn façades of many styles against the truth, how sure they are against how often they are right, and the weights of that.

python benchmarks/windows_facades.py --seeds 1 2 3 [--each 12] [--styles NAME …] [--rough] [--gsd METRES] [--picture FILE]
python benchmarks/windows_facades.py --fit FIRST LAST                                           # weights of the confidence, from other seeds
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.openings import FaceOpenings
from cityflow.evaluation.window_accuracy import IOU, MOSTLY, WindowCounts, intersection_over_union, total
from cityflow.synthetic.town_facades import WINDOW
from cityflow.windows.candidates import channels_of
from cityflow.windows.confidence import NAMES, features
from cityflow.windows.facade_picture import picture_of
from cityflow.windows.find_windows import find_windows
from cityflow.windows.window_parameters import WindowParameters
from cityflow.windows.window_search import searched
from scenes.drawn_facades import STYLES, DrawnFacade, draw_facade
from scenes.facade_errors import ImageErrors
from scenes.hard_facades import HARD, draw_hard_facade
from scenes.hard_walls import WINDOWLESS
from windows_town import WHOLE, as_texture, figures_of, judged_facade, sheet, shown, windows_of

EVERY = (*STYLES, "blank", "glass", *HARD, *WINDOWLESS)
DECILES = np.linspace(0.5, 1.0, 6)


def drawn(style: str, errors: ImageErrors, rng: np.random.Generator) -> DrawnFacade:
    hard = style in HARD or style in WINDOWLESS
    return draw_hard_facade(style, errors, rng) if hard else draw_facade(style, errors, rng)  # type: ignore[arg-type]


def errors_of(rng: np.random.Generator, rough: bool, gsd_m: float | None) -> ImageErrors:
    errors = ImageErrors.rough(rng) if rough else ImageErrors.at_random(rng)
    return errors if gsd_m is None else replace(errors, gsd_m=gsd_m)


def table(asked: argparse.Namespace) -> None:
    everything: list[WindowCounts] = []
    pictures, trust, seconds, storeys = [], [], [], []
    for style in asked.styles or EVERY:
        counts, area = [], 0.0
        for seed in asked.seeds:
            rng = np.random.default_rng([seed, EVERY.index(style)])
            for _ in range(asked.each):
                facade = drawn(style, errors_of(rng, asked.rough, asked.gsd), rng)
                face, patch = as_texture(facade)
                begun = time.process_time()
                found = find_windows(face, patch, WindowParameters())
                seconds.append(time.process_time() - begun)
                counts.append(judged_facade(facade, found))
                trust.append(trusted(facade, found))
                area += facade.size_m[0] * facade.size_m[1]
                if found.storeys and facade.storeys > 0 and facade.visible.min(initial=1.0) >= WHOLE:
                    storeys.append(found.storeys == facade.storeys)
                pictures.append(shown(patch, found, facade.cell_m, (0.0, facade.size_m[1])))
        whole = total(counts)
        wrong = round(100 * (whole.found - whole.right) / area, 2)
        print(
            json.dumps({"style": style, **figures_of(whole), "wrong a 100 m2": wrong, "facades": len(counts)}),
            flush=True,
        )
        everything += counts
    figures = {"storeys right": round(float(np.mean(storeys)), 3) if storeys else None, "said": len(storeys)}
    figures |= {"seconds a façade, median": round(float(np.median(seconds)), 3)}
    print(json.dumps({"style": "all", **figures_of(total(everything)), **figures}))
    calibration(np.concatenate(trust))
    sheet(pictures, asked.picture)


def trusted(facade: DrawnFacade, found: FaceOpenings) -> FloatArray:
    """(N, 2) confidence of each window, and whether it is right; those that lie upon a window that is hidden in part are left out."""
    of = facade.openings[:, 4] == WINDOW
    true, boxes = facade.openings[of][:, [0, 2, 1, 3]], windows_of(found)
    sure = np.array([o.confidence for o in found.openings if o.kind == "window"])
    right = intersection_over_union(boxes, true).max(axis=1, initial=0.0) >= IOU
    hidden = true[facade.visible[of] < WHOLE]
    low, high = np.maximum(boxes[:, None, :2], hidden[None, :, :2]), np.minimum(boxes[:, None, 2:], hidden[None, :, 2:])
    shared = np.clip(high - low, 0, None).prod(axis=2) / np.maximum((boxes[:, 2:] - boxes[:, :2]).prod(axis=1), 1e-9)[:, None]  # fmt: skip
    keep = right | (shared.max(axis=1, initial=0.0) <= MOSTLY)
    return np.column_stack([sure[keep], right[keep]]) if len(sure) else np.empty((0, 2))


def calibration(trust: FloatArray) -> None:
    """Share that is right for each tenth of confidence, and the Brier score."""
    for low, high in pairwise(DECILES.tolist()):
        of = (trust[:, 0] >= low) & ((trust[:, 0] < high) | (high == 1.0))
        row: dict[str, object] = {"confidence": f"{low:.1f} to {high:.1f}", "windows": int(of.sum())}
        if of.any():
            mean, right = (round(float(v), 3) for v in trust[of].mean(axis=0))
            row |= {"mean": mean, "right": right}
        print(json.dumps(row))
    print(json.dumps({"Brier": round(float(np.mean((trust[:, 0] - trust[:, 1]) ** 2)), 4)}))


def fit(first: int, last: int) -> None:
    """Logistic regression of whether a box is a window or a door, with a ridge; what overlaps a little is left out."""
    parameters = WindowParameters(least_confidence=0.12)
    x: list[FloatArray] = []
    y: list[FloatArray] = []
    for seed in range(first, last):
        for style in (*STYLES, *EVERY):
            rng = np.random.default_rng([seed, len(x)])
            for k in range(2):
                facade = drawn(style, errors_of(rng, k == 1, None), rng)
                picture = picture_of(*as_texture(facade), parameters)
                channels = channels_of(picture, parameters)
                found, support, completed = searched(picture, channels, parameters)
                if len(found):
                    bounds = np.array([picture.bounds(b) for b in found.boxes])
                    shared = intersection_over_union(bounds, facade.openings[:, [0, 2, 1, 3]])
                    x.append(features(found, support, completed, picture, channels))
                    y.append(shared.max(axis=1, initial=0.0))
    a, iou = np.concatenate(x), np.concatenate(y)
    clear = (iou > 0.5) | (iou < 0.4)
    weights = logistic(a[clear], (iou[clear] > 0.5).astype(float))
    print(dict(zip(NAMES, weights.round(2).tolist(), strict=True)))
    print(weights.round(2).tolist())


def logistic(a: FloatArray, y: FloatArray) -> FloatArray:
    weights, ridge = np.zeros(a.shape[1]), np.diag([0.01, *[2.0] * (a.shape[1] - 1)])
    for _ in range(40):
        p = 1 / (1 + np.exp(-a @ weights))
        weights = weights + np.linalg.solve((a * (p * (1 - p))[:, None]).T @ a + ridge, a.T @ (y - p) - ridge @ weights)
    return np.asarray(weights)


def main(words: Sequence[str] | None = None) -> None:
    cv2.setNumThreads(1)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="*", default=[])
    parser.add_argument("--each", type=int, default=12)
    parser.add_argument("--styles", nargs="*", choices=EVERY)
    parser.add_argument("--rough", action="store_true")
    parser.add_argument("--gsd", type=float)
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--fit", type=int, nargs=2)
    asked = parser.parse_args(words)
    if asked.seeds:
        table(asked)
    if asked.fit:
        fit(*asked.fit)


if __name__ == "__main__":
    main()

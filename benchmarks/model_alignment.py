"""Photographs whose poses are off by pixels, moved back by the edges of the models that they show.

    python benchmarks/model_alignment.py --survey SURVEY --run RUN [--geometry truth run] [--units 12] [--seed 1] [--share 0.3] [--textures]

SURVEY is what `cityflow synth` left, RUN a run over it with models. After everything was reconstructed, some photographs are turned by 2 to 4 pixels in any
direction, and rolled by up to a pixel at their corners. Of each photograph over each unit it is asked how far it lies beside the truth there, before
and after, in pixels (median over the samples of the models' edges that it shows). --textures also makes the textures, without and with alignment.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cityflow.adjustment.block import rotation_of
from cityflow.core.camera import OrientedImage
from cityflow.texture.alignment.edge_shift import edge_shift
from cityflow.texture.alignment.model_edges import edge_samples
from cityflow.texture.unit import TextureParameters
from cityflow.texture.visibility.scene import Scene
from texture_town import looks, shares
from texture_visibility import chosen
from texture_world import World, showing, surroundings, textured, worlds

LEAST_PX, MOST_PX, ROLL_PX = 2.0, 4.0, 1.0


def turned(image: OrientedImage, rng: np.random.Generator) -> OrientedImage:
    focal = image.camera.fx
    size, direction = rng.uniform(LEAST_PX, MOST_PX), rng.uniform(0, 2 * np.pi)
    roll = rng.uniform(-ROLL_PX, ROLL_PX) / (np.hypot(image.camera.width, image.camera.height) / 2)
    vector = np.array([size * np.sin(direction) / focal, size * np.cos(direction) / focal, roll])
    return replace(image, rotation=rotation_of(vector[None])[0] @ image.rotation)


def spoiled(world: World, share: float, seed: int) -> tuple[World, set[str]]:
    rng = np.random.default_rng(seed)
    off = {i.image.name for i in world.images if rng.random() < share}
    images = [replace(i, image=turned(i.image, rng)) if i.image.name in off else i for i in world.images]
    return replace(world, images=images), off


@dataclass(frozen=True)
class Measured:
    """One photograph over one unit: (2,) what it truly lies off, (2,) what it is moved by, significant or not, and (2, 2) covariance."""

    name: str
    truth: np.ndarray
    shift: np.ndarray
    covariance: np.ndarray
    significant: bool


def measured(world: World, number: int, p: TextureParameters) -> list[Measured]:
    house = world.houses[number]
    around = surroundings(world, number, p)
    scene = Scene.of(around.heights, around.grid, around.own, around.others, p.visibility)
    samples = edge_samples([*around.own, *around.others])
    found = []
    for image in showing(house, world.images, p.most_images):
        one = edge_shift(image, samples, scene, p.align_px)
        if one is None:
            continue
        corners = np.concatenate([s.vertices for s in house.all])
        off = world.poses[image.image.name].project(corners)[0] - image.image.project(corners)[0]
        found.append(Measured(image.image.name, np.median(off, axis=0), one.shift, one.covariance, one.is_significant))
    return found


def rms(values: Sequence[np.ndarray]) -> float:
    return round(float(np.sqrt(np.mean(np.sum(np.square(values), axis=1)))), 2) if len(values) else float("nan")


def told(rows: Sequence[Measured], off: set[str]) -> dict[str, object]:
    result: dict[str, object] = {}
    for what, of in (("off", [r for r in rows if r.name in off]), ("sound", [r for r in rows if r.name not in off])):
        moved = [r for r in of if r.significant]
        normed = [float(r.truth @ np.linalg.solve(r.covariance, r.truth)) for r in moved]
        result[what] = {
            "photographs over units": len(of), "moved": len(moved), "before, px": rms([r.truth for r in of]),
            "after, px": rms([r.truth - r.shift * r.significant for r in of]),
            "of those moved: after, px": rms([r.truth - r.shift for r in moved]),
            "worse by more than a pixel": sum(bool(np.linalg.norm(r.truth - r.shift) > np.linalg.norm(r.truth) + 1) for r in moved),
            "all, if moved always": rms([r.truth - r.shift for r in of]),
            "size of the truth in standard deviations": round(float(np.median(np.sqrt(normed))), 1) if normed else None,
        }  # fmt: skip
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--survey", type=Path, required=True)
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--catalog", type=Path)
    parser.add_argument("--geometry", nargs="+", default=["truth", "run"], choices=["truth", "run"])
    parser.add_argument("--units", type=int, default=12)
    parser.add_argument(
        "--inset", type=float, default=0.0, help="units at least so far inside the surveyed area, metres"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, default=0.3)
    parser.add_argument("--textures", action="store_true")
    asked = parser.parse_args()
    p = TextureParameters()
    for sound in worlds(asked):
        world, off = spoiled(sound, asked.share, asked.seed)
        numbers = chosen(world.houses, world.town, world.area, asked.units, asked.inset)
        which = "true" if world.true_hulls else "reconstructed"
        print(f"{which} models, {len(numbers)} units, {len(off)} of {len(world.images)} photographs off", flush=True)
        begun = time.process_time()
        rows = [r for n in numbers for r in measured(world, n, p)]
        print(json.dumps(told(rows, off), ensure_ascii=False, indent=1))
        print(f"{1e3 * (time.process_time() - begun) / max(len(rows), 1):.1f} ms for a photograph over a unit", flush=True)  # fmt: skip
        if asked.textures:
            cases = [("off", world, 0.0), ("off, aligned", world, p.align_px)]
            cases += [("sound poses", sound, 0.0), ("sound poses, aligned", sound, p.align_px)]
            for label, of, reach in cases:
                begun = time.process_time()
                done = [textured(of, n, p.model_copy(update={"align_px": reach})) for n in numbers]
                print(label, f"{time.process_time() - begun:.0f} s", json.dumps(shares(of, done), ensure_ascii=False), flush=True)  # fmt: skip
                looks(of, done, None, label)


if __name__ == "__main__":
    main()

"""Textures of a synthetic town against the truth: how much has one, whether it shows what it lies on, how it looks from cameras that took no picture.

    python benchmarks/texture_town.py --survey SURVEY --run RUN [--geometry truth run] [--units 12] [--picture FOLDER]
    python benchmarks/texture_town.py --survey SURVEY --run RUN --exposures              # every image by a factor of 0.25 to 4 off
    python benchmarks/texture_town.py --survey SURVEY --run RUN --stage                  # time and memory of 73 faces with 100 images

SURVEY is what `cityflow synth` left, RUN a run over it; its images are read as tasks read them, with the poses of --catalog
where the run has others. What an image shows is told by its true pose. Geometry `truth`: the true hulls and the true surface,
`run`: those of the run.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from cityflow.core.building import Semantic
from cityflow.core.texture import FIRST_IMAGE, FacePlane
from cityflow.evaluation.texel_shifts import texel_shifts
from cityflow.evaluation.texture_accuracy import patchwork, source_share, texels_of, textured_share
from cityflow.texture.unit import TextureParameters
from texture_views import compared, drawn, held_out, page_picture, picture, scene_of, true_view
from texture_visibility import chosen
from texture_world import NEAR_M, Done, Judge, World, colours_off, misexposed, part_name, textured, worlds

SETS = ("raw", "rectified")
FACADES = (Semantic.ROOF, Semantic.WALL)
LEAST_M2, LARGE_M2 = 0.2, 8.0


def shares(world: World, done: Sequence[Done]) -> dict[str, object]:
    """Square metres, all units together, of roofs and walls."""
    total: dict[str, float] = defaultdict(float)
    wrong: dict[str, float] = defaultdict(float)
    for unit in done:
        judge, images = Judge(world, unit), range(len(unit.images))
        patches = {name: unit.patches(name) for name in SETS}
        for key, face in unit.faces.items():
            kind = face.semantic.value
            if face.polygon.area < LEAST_M2:
                continue
            found = textured_share(face, patches["rectified"].get(key), images, judge.sees(face), 150)
            total[f"visible {kind}"] += found.visible
            total[f"textured {kind}"] += found.textured
            for name in SETS:
                if key in patches[name]:
                    texels = texels_of(face, patches[name][key])
                    near = source_share(texels, judge.own(face, NEAR_M))
                    house = source_share(texels, judge.own(face, None))
                    total[f"area {name} {kind}"] += near.area
                    total[f"near {name} {kind}"] += near.right
                    total[f"house {name} {kind}"] += house.right
            _what_else(judge, face, texels_of(face, patches["raw"][key]), wrong) if key in patches["raw"] else None
    return {
        **_ratios(total),
        "shown instead, m²": {k: round(v, 1) for k, v in sorted(wrong.items(), key=lambda kv: -kv[1])[:6]},
    }


def _what_else(judge: Judge, face: FacePlane, texels, wrong: dict[str, float]) -> None:  # type: ignore[no-untyped-def]
    for value in np.unique(texels.index[texels.index >= FIRST_IMAGE]).tolist():
        of = texels.index == value
        bad = ~judge.own(face, None)(value - FIRST_IMAGE, texels.xyz[of])
        for part in judge.parts(value - FIRST_IMAGE, texels.xyz[of][bad]).tolist():
            wrong[part_name(part)] += float(texels.area[0])


def _ratios(total: Mapping[str, float]) -> dict[str, object]:
    def of(top: str, bottom: str, kinds: Sequence[Semantic] = FACADES) -> float:
        return round(sum(total[f"{top} {k.value}"] for k in kinds) / max(sum(total[f"{bottom} {k.value}"] for k in kinds), 1e-9), 4)  # fmt: skip

    return {
        "textured of visible": of("textured", "visible"),
        "roofs": of("textured", "visible", FACADES[:1]), "walls": of("textured", "visible", FACADES[1:]),
        "visible m²": round(sum(total[f"visible {k.value}"] for k in FACADES)),
        **{f"own house, {n}": of(f"house {n}", f"area {n}") for n in SETS},
        **{f"own plane within {NEAR_M} m, {n}": of(f"near {n}", f"area {n}") for n in SETS},
        "own house, outer ceilings": of("house raw", "area raw", (Semantic.OUTER_CEILING,)),
    }  # fmt: skip


def looks(world: World, done: Sequence[Done], folder: Path | None, label: str) -> list[dict[str, object]]:
    rows = []
    units = sorted({u.house.index for u in done})
    scenes = {name: scene_of(world, done, name) for name in SETS}
    for name, image in held_out(world).items():
        truth = true_view(world, image)
        if not np.isin(truth.unit, units).any():
            print(name, "shows none of the units", flush=True)
            continue
        for kind in SETS:
            view = drawn(image, scenes[kind])
            found = compared(truth, view, units)
            rows.append({"view": name, "set": kind, "SSIM": round(found[0].ssim, 3), "ΔE median": round(found[0].delta_e, 2),
                         "ΔE 90 %": round(found[0].delta_e_90, 1), "pixels": found[0].pixels, "gain": np.round(found[0].gain, 3).tolist()})  # fmt: skip
            if folder is not None:
                picture(folder / f"{label}_{name}_{kind}.png", truth, view, found)
        print(json.dumps(rows[-2], ensure_ascii=False), json.dumps(rows[-1], ensure_ascii=False), flush=True)
    for kind in SETS:
        of = [r for r in rows if r["set"] == kind]
        weights = [r["pixels"] for r in of]
        mean = {k: round(float(np.average([r[k] for r in of], weights=weights)), 3) for k in ("SSIM", "ΔE median")}
        rows.append({"view": "all", "set": kind, **mean})
        print(json.dumps(rows[-1], ensure_ascii=False), flush=True)
    return rows


def perspective(world: World, done: Sequence[Done]) -> dict[str, object]:
    """How far texels of the raw set are drawn from where they belong in the held-out views, with the division per pixel and without; pixels."""
    shifts: dict[bool, list[float]] = {True: [], False: []}
    for unit in done:
        patches = unit.patches("raw")
        large = sorted((k for k in patches if unit.faces[k].polygon.area > LARGE_M2), key=lambda k: -unit.faces[k].polygon.area)[:4]  # fmt: skip
        for image in held_out(world).values():
            for key in large:
                face = unit.faces[key]
                if (image.centre - face.origin) @ face.normal <= 0:
                    continue
                for divide in shifts:
                    off = texel_shifts(face, patches[key], image, divide=divide)
                    shifts[divide] += [float(off.max())] if len(off) else []
    return {name: {"median of faces": round(float(np.median(shifts[d])), 3), "worst": round(max(shifts[d]), 3)}
            for name, d in (("divided", True), ("not divided", False))} | {"faces x views": len(shifts[True])}  # fmt: skip


def exposures(world: World, numbers: Sequence[int], p: TextureParameters, seed: int) -> dict[str, object]:
    """Units textured from images that are exposed alike, and from the same with errors: how far the second are patchwork beside the first."""
    off = World(**{**vars(world), "images": misexposed(world.images, seed)})
    seams, jumps, spreads, differences = [], [], [], []
    for number in numbers:
        one, two = textured(world, number, p).patches("rectified"), textured(off, number, p).patches("rectified")
        common = [k for k in one if k in two and one[k].pixels.shape == two[k].pixels.shape]
        inside = {k: (one[k].index >= FIRST_IMAGE) & (one[k].index == two[k].index) for k in common}
        a = np.concatenate([two[k].pixels[inside[k]] for k in common]).astype(float)
        b = np.concatenate([one[k].pixels[inside[k]] for k in common]).astype(float)
        fits = [np.polyfit(a[:, band], b[:, band], 1) for band in range(3)]
        gain, offset = np.array(fits).T
        parts = [
            (
                colours_off(two[k], one[k], gain, offset).astype(np.float64),
                np.where(inside[k], one[k].index, 0).astype(np.uint16),
            )
            for k in common
        ]
        found = patchwork(parts)
        seams.append(found.seams)
        jumps.append(found.jump)
        spreads.append(found.spread)
        differences.append(float(np.median(np.abs(a * gain + offset - b))))
        print(number, found, round(differences[-1], 2), np.round(gain, 2), flush=True)
    return {"units": len(numbers), "jump at seams, values": round(float(np.average(jumps, weights=np.array(seams) + 1)), 2),
            "parts off by, values": round(float(np.median(spreads)), 2), "worst house": round(max(spreads), 2),
            "median difference": round(float(np.median(differences)), 2)}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--survey", type=Path, required=True)
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument(
        "--catalog",
        type=Path,
        help="of the run, where it has other poses than the survey's: what images show is judged by their true poses",
    )
    parser.add_argument("--geometry", nargs="+", default=["truth", "run"], choices=("truth", "run"))
    parser.add_argument("--units", type=int, default=12)
    parser.add_argument(
        "--inset",
        type=float,
        default=5.0,
        help="how far inside the surveyed area units have to stand, metres; negative: outside",
    )
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--exposures", action="store_true")
    parser.add_argument("--stage", action="store_true")
    parser.add_argument("--least", type=int, default=100, help="of --stage: candidates a face must have on average")
    parser.add_argument("--skip-views", action="store_true")
    parser.add_argument("--set", default="{}", help="TextureParameters as JSON")
    asked = parser.parse_args()
    p = TextureParameters.model_validate(json.loads(asked.set))
    if asked.stage:
        from texture_stage import stage

        print(json.dumps(stage(asked, p), ensure_ascii=False))
        return
    if asked.picture:
        asked.picture.mkdir(parents=True, exist_ok=True)
    for world in worlds(asked):
        label = "truth" if world.true_hulls else "run"
        numbers = chosen(world.houses, world.town, world.area, asked.units, asked.inset)
        if asked.exposures:
            print(label, json.dumps(exposures(world, numbers, p, 5), ensure_ascii=False), flush=True)
            continue
        began = time.process_time()
        done = [textured(world, k, p) for k in numbers]
        seconds = time.process_time() - began
        figures = {"candidates, most": max(d.made.figures["candidates"] for d in done), "kept, most": max(d.made.figures["kept"] for d in done),
                   "interpolated": round(float(np.mean([d.made.figures["interpolated_share"] for d in done])), 4)}  # fmt: skip
        print(label, len(done), "units", round(seconds, 1), "s", json.dumps(figures), flush=True)
        print(json.dumps(shares(world, done), ensure_ascii=False), flush=True)
        print(json.dumps({"perspective": perspective(world, done)}, ensure_ascii=False), flush=True)
        if asked.picture:
            page_picture(asked.picture / f"{label}_page.png", done)
        if not asked.skip_views:
            looks(world, done, asked.picture, label)


if __name__ == "__main__":
    main()

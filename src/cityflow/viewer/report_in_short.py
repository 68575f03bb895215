"""The head of the report: progress, quality, problems and next step, a sentence each."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cityflow.core.building import Status
from cityflow.viewer.environment import cm
from cityflow.viewer.survey_in_short import what_was_surveyed

GOOD_MEANS = "Good: at least 95 % of the roof is expected within 20 cm of the truth, judged by points that were held back from the fit. "
COMPLETE, HALF, TOLD = 0.98, 0.5, 0.005
"""Shares of roofs and façades from which textures are complete, or have gaps; a filled share below the last one is not told."""


@dataclass(frozen=True, slots=True)
class Answer:
    """A question of the reader, the answer, and the section of the page that says more (may be empty)."""

    question: str
    answer: str
    section: str = ""


def verdict(summary: Mapping[str, Any]) -> str:
    """How many buildings are good, in one sentence; of an unfinished run, what is still to come."""
    total, waiting, verdicts = summary["units"] - summary["refused"], summary.get("waiting", 0), summary["verdicts"]
    if summary["units"] == 0 and not waiting:
        return _of_none(summary)
    rest = [
        f"{n:,} {text}"
        for n, text in (
            (verdicts["look"], "should be looked at"), (verdicts["poor"], "are poor"), (verdicts["unjudged"], "not judged"),
            (waiting, "not worked on yet"), (summary["refused"], "refused"),
        ) if n
    ]  # fmt: skip
    good, whole = verdicts["good"], total + waiting
    if good == whole and good:
        first = f"All {good:,} buildings are good" if good > 1 else "The one building is good"
    else:
        first = f"{good:,} of {whole:,} buildings {'is' if good == 1 else 'are'} good"
    return ", ".join([first, *(text.replace("1 are", "1 is") if text == "1 are poor" else text for text in rest)]) + "."


def _of_none(summary: Mapping[str, Any]) -> str:
    if summary.get("exported"):
        return "No building was found in the surveyed area."
    tasks = summary.get("tasks", 0)
    if tasks:
        return f"No building has been worked on yet: {tasks:,} {'task' if tasks == 1 else 'tasks'} before that {'is' if tasks == 1 else 'are'} done."
    return "No building has been worked on yet."


def in_short(figures: Mapping[str, Any], run: str, unit_stage: str) -> list[Answer]:
    """Answers in the order in which they are asked; nothing where nothing has run."""
    summary = figures["summary"]
    if not summary["units"] and not summary.get("waiting"):
        return []
    surveyed = what_was_surveyed(figures["images"])
    return [
        *([Answer("What was surveyed?", surveyed, "images")] if surveyed else []),
        Answer("How good?", _how_good(figures), "quality"),
        *(
            [Answer("How good are the textures?", textured, "textures")]
            if (textured := _textures(figures["textures"]))
            else []
        ),
        Answer("Where are problems?", _problems(figures, unit_stage), "todo"),
        Answer("What to do?", _to_do(figures, run), "todo"),
    ]


def _how_good(figures: Mapping[str, Any]) -> str:
    summary, checks = figures["summary"], figures["checkpoints"]
    if summary["nmad_median"] is None:
        return "No model has been compared with measured points yet."
    text, expected = GOOD_MEANS if summary["verdicts"]["good"] else "", summary["good_expected"]
    if expected > summary["verdicts"]["good"]:
        whole = summary["units"] - summary["refused"]
        text += (
            f"Probabilities add up to about {expected:,} good ones of {whole:,}; the verdict asks each for a high one. "
        )
    text += f"Measured points scatter by {cm(summary['nmad_median'])} about the roof of a typical building"
    if summary["nmad_95"] is not None and summary["done"] > 1:
        text += f", by less than {cm(summary['nmad_95'])} at 95 % of them"
    known = [c for c in checks if c["rmse"] is not None]
    return f"{text}." + (
        f" Points of known position: {known[0]['product'].replace('_', ' ')} off by {cm(known[0]['rmse'])}."
        if known
        else ""
    )


def _textures(textures: Mapping[str, Any] | None) -> str:
    """A verdict on the textures, and what it goes by; empty where none are made."""
    if textures is None or not textures["asked"]:
        return ""
    shares = {s["kind"]: s["textured"] for s in textures["shares"] if s["kind"] != "undersides"}
    least = min(shares.values(), default=0.0)
    if textures["gsd_m"] is None or not shares:
        return "There are none: no image shows a roof or a façade well enough."
    first = "Complete" if least >= COMPLETE else "With gaps" if least >= HALF else "Much is missing"
    seen = _listed([f"{share:.0%} of the {kind}" for kind, share in shares.items()]).replace("%", " %")
    parts = [f"{first}: pictures on {seen}, with pixels of {cm(textures['gsd_m'])} in the median"]
    if textures["interpolated"] >= TOLD:
        parts.append(f"{100 * textures['interpolated']:.0f} % of that is seen by no image and filled in from around")
    if n := textures["moved_images"]:
        parts.append(
            f"{n:,} {'photograph' if n == 1 else 'photographs'} lay beside the models and {'was' if n == 1 else 'were'} moved"
        )
    return f"{'; '.join(parts)}. Whether something stands before a wall is not checked."


def _problems(figures: Mapping[str, Any], unit_stage: str) -> str:
    summary, looks = figures["summary"], len(figures["review_list"])
    words = (("failed", "failed"), ("refused", "refused"), ("degraded", "simpler than requested"))
    judged = [
        f"{n:,} {word}" for key, word in (("poor", "poor"), ("look", "to look at")) if (n := summary["verdicts"][key])
    ]
    counts = judged + [f"{summary[status]:,} {word}" for status, word in words if summary[status]]
    others = [g for g in figures["problems"] if g["stage"] != unit_stage]
    tasks, kinds = sum(g["count"] for g in others), len(figures["problems"])
    parts = []
    if counts:
        parts.append(f"Buildings: {_listed(counts)}")
    if others:
        stages = _listed(sorted({g["stage"] for g in others}))
        parts.append(f"{tasks:,} {'task' if tasks == 1 else 'tasks'} of {stages} did not end as requested")
    if kinds > 1:
        parts.append(f"{kinds:,} kinds of reasons")
    if not parts:
        return (
            "None: nothing failed, and every building is good."
            if summary["verdicts"]["good"]
            else "None: nothing failed."
        )
    return f"{'; '.join(parts)}.{' The map shows where.' if counts or looks else ''}"


def _to_do(figures: Mapping[str, Any], run: str) -> str:
    summary, groups = figures["summary"], figures["problems"]
    failed, refused = ([g for g in groups if g["status"] == s] for s in (Status.FAILED, Status.REFUSED))
    if summary["unfinished"]:
        return f"Let the run end: cityflow run WORKFLOW --out {shlex.quote(run)} continues where it stopped."
    if failed:
        return "Read why tasks failed, fix or set what the reasons name, and run them again with the commands below."
    if refused:
        return "Fix the refused outlines in their source and run the workflow again; the rest can be used."
    if figures["review_list"]:
        others = "; the others can be used as they are" if summary["verdicts"]["good"] else ""
        return f"Look at the buildings that are not good, the worst first{others}."
    if summary["verdicts"]["unjudged"]:
        return "Run the workflow again: these buildings were made by a version without verdicts."
    return "Nothing: the products can be used as they are."


def _listed(texts: Sequence[str]) -> str:
    """As a person lists things.

    >>> _listed(["a", "b", "c"]), _listed(["a"])
    ('a, b and c', 'a')
    """
    return f"{', '.join(texts[:-1])} and {texts[-1]}" if len(texts) > 1 else "".join(texts)

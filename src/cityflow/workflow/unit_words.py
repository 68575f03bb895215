"""Text forms of a building's attributes on a terminal, in the order of the view's panel (`view/source/attributes.js`)."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from cityflow.core.verdicts import PROBABILITY_KEY, REASON_KEY, VERDICT_KEY

Form = Callable[[Any], str]


def _metres(v: float) -> str:
    return f"{v:.2f} m"


def _squares(v: float) -> str:
    return f"{v:,.1f} m²"


def _cubes(v: float) -> str:
    return f"{v:,.1f} m³"


def _cents(v: float) -> str:
    return f"{100 * v:.1f} cm"


def _share(v: float) -> str:
    return f"{100 * v:.1f} %"


def _count(v: float) -> str:
    return f"{v:,}"


def _density(v: float) -> str:
    return f"{v:.1f} per m²"


def words(name: object) -> str:
    """
    >>> words("orientation_histogram")
    'orientation histogram'
    """
    return str(name).replace("_", " ")


GROUPS: tuple[tuple[str, tuple[tuple[str, str, Form], ...]], ...] = (
    ("Quality", (
        ("method", "Method", words), ("lod", "Level of detail", str), ("planes", "Roof planes", _count), ("roof_faces", "Roof faces", _count),
        ("roof_points", "Points on the roof", _count), ("points_per_m2", "Density", _density),
        ("share_explained", "Within 20 cm of the model", _share), ("share_covered", "With a roof face above or below", _share),
        ("bias", "Mean height above the model", _cents), ("nmad", "NMAD (scatter without outliers)", _cents), ("rmse", "RMSE (missed parts count)", _cents),
        ("le95", "95 % are within", _cents), ("claimed_rmse_m", "Expected RMSE of the model", _cents),
        ("held_back_points", "Held back from the fit", _count), ("held_back_off_share", "of them more than 20 cm off", _share),
        ("roof_off_share", "Roof more than 20 cm off by points", _share), ("roof_unseen_share", "Roof without points nearby", _share),
        ("points_facade", "Not on the roof: façades", _count), ("points_above_roof", "Not on the roof: above it", _count),
        ("points_below_roof", "Not on the roof: below it", _count), ("points_near_ground", "Not on the roof: near the ground", _count),
    )),
    ("Size", (
        ("ridge_height_m", "Ridge, above the height datum", _metres), ("eave_height_m", "Lowest eave", _metres), ("ground_height_m", "Floor", _metres),
        ("roof_height_p95_m", "95 % of the roof is below", _metres), ("roof_height_p70_m", "70 % is below", _metres),
        ("roof_height_p50_m", "Half is below", _metres), ("roof_height_p05_m", "5 % is below", _metres),
        ("footprint_area_m2", "Footprint", _squares), ("roof_area_m2", "Roof", _squares), ("wall_area_m2", "Walls", _squares),
        ("outer_wall_area_m2", "Outer walls", _squares), ("shared_wall_area_m2", "Walls shared with neighbours", _squares),
        ("volume_m3", "Volume", _cubes), ("overhang_mean_m", "Overhang of the eaves, mean", _metres), ("overhang_max_m", "largest", _metres),
    )),
    ("Shape", (("roof_type", "Roof", words), ("outline_remark", "Outline", str))),
    ("Façades", (
        ("storeys", "Storeys, by the source", str), ("storeys_by_windows", "Storeys, by rows of windows", str), ("windows", "Windows", _count),
        ("doors", "Doors", _count), ("window_to_wall_ratio", "Window-to-wall ratio", _share), ("windows_seen_share", "Walls searched for windows", _share),
        ("windows_confidence", "Windows, mean confidence", _share), ("windows_missing", "No windows because", str),
        ("window_to_wall_missing", "No window-to-wall ratio because", str), ("textured_share", "Faces with a photograph", _share),
        ("texture_interpolated", "of these, interpolated", _share), ("texture_gsd_m", "Size of a pixel", _cents),
    )),
    ("Survey", (("source", "Survey", str), ("source_date", "Flown", str))),
)  # fmt: skip
UNITS = {"m": "m", "m2": "m²", "m3": "m³", "px": "px", "deg": "degrees", "mb": "MB", "s": "s"}
TOLD_ELSEWHERE = frozenset(
    {VERDICT_KEY, REASON_KEY, PROBABILITY_KEY, "kept", "scores", "notes", "units", "id", "status", "reason"}
)


def lines_of_building(attributes: Mapping[str, Any]) -> Iterator[str]:
    """Lines of what is known of a building, in groups; what has no words of its own comes last, as its source says it."""
    known = TOLD_ELSEWHERE | {key for _, rows in GROUPS for key, _, _ in rows}
    for title, rows in GROUPS:
        yield from _group(
            title,
            [(name, _formed(attributes[key], form)) for key, name, form in rows if _is_known(attributes.get(key))],
        )
    own = [
        (words(key), plain(value)) for key, value in sorted(attributes.items()) if key not in known and _is_known(value)
    ]
    yield from _group("Attributes of the outline's source", own)


def lines_of_task(result: Mapping[str, Any]) -> Iterator[str]:
    """Lines of what a task of a tile, a file or a façade found: its figures by name, in words."""
    for key, value in sorted(result.items()):
        if key not in TOLD_ELSEWHERE and key != "digest" and _is_known(value) and value not in ({}, []):
            name, unit = with_unit(key)
            yield f"{name}: {plain(value)}{unit}"


def with_unit(key: str) -> tuple[str, str]:
    """
    >>> with_unit("area_m2"), with_unit("parallax_90_px"), with_unit("faces")
    (('area', ' m²'), ('parallax 90', ' px'), ('faces', ''))
    """
    stem, _, last = key.rpartition("_")
    return (words(stem), f" {UNITS[last]}") if stem and last in UNITS else (words(key), "")


def plain(value: Any) -> str:
    """
    >>> plain({"no image sees it": 4, "too_coarse": 1}), plain(0.97134), plain(True)
    ('no image sees it 4, too coarse 1', '0.9713', 'yes')
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        flat = all(not isinstance(v, Mapping | list) for v in value.values())
        return (
            ", ".join(f"{words(k)} {plain(v)}" for k, v in value.items())
            if flat
            else json.dumps(value, ensure_ascii=False)
        )
    if isinstance(value, float):
        return f"{round(value, 4):g}"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, list) else str(value)


def _group(title: str, rows: list[tuple[str, str]]) -> Iterator[str]:
    if rows:
        yield f"{title}:"
        width = max(len(name) for name, _ in rows)
        yield from (f"  {name:<{width}}  {value}" for name, value in rows)


def _formed(value: Any, form: Form) -> str:
    return form(value) if form in (str, words) or isinstance(value, int | float) else str(value)


def _is_known(value: Any) -> bool:
    return value is not None and value != ""

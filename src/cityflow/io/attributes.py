"""Text forms of attributes and ids: numbers without arithmetic noise, text and names that XML accepts."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from cityflow.core.building import Building, Scalar

SIGNIFICANT_DIGITS = 10
"""Enough for 0.1 mm in a national grid and for 1 mm in degrees; measured values are rounded where they are measured."""

STATUS_KEY, REASON_KEY, GROUND_KEY, PLANES_KEY, OVERHANGS_KEY = (
    "cityflow_status",
    "cityflow_reason",
    "cityflow_ground_height",
    "cityflow_planes",
    "cityflow_overhangs",
)
"""Names of what the project itself says of a unit; prefixed, since sources have a `status` of their own."""

_NOT_IN_NAMES = re.compile(r"_(?=x)|[^A-Za-z0-9_.-]")
_NOT_IN_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def with_source(source: Mapping[str, Scalar], own: Mapping[str, Scalar]) -> dict[str, Scalar]:
    """All attributes of the source and our own; one of the source's that bears our name becomes ``source_…``.

    >>> with_source({"lod": "3", "street": "Oude Delft"}, {"lod": "2.2"})
    {'source_lod': '3', 'street': 'Oude Delft', 'lod': '2.2'}
    """
    return {**{f"source_{k}" if k in own else k: v for k, v in source.items()}, **own}


def scalar(value: object) -> Scalar:
    """A JSON scalar: floats to 10 significant digits, NaN and infinities as None, numpy scalars as Python's.

    >>> scalar(0.1 + 0.2), scalar(float("nan")), scalar(52.01163487)
    (0.3, None, 52.01163487)
    """
    item = getattr(value, "item", None)
    if item is not None and not isinstance(value, str):
        value = item()
    if value is None or isinstance(value, (bool, int)):
        return value
    if isinstance(value, float):
        return _tidy(value) if math.isfinite(value) else None
    return xml_text(str(value))


def _tidy(value: float) -> float:
    shorter = float(f"{value:.{SIGNIFICANT_DIGITS}g}")
    # the largest doubles, which some sources write for null, would round to infinity
    return shorter if math.isfinite(shorter) else value


def scalars(attributes: Mapping[str, object]) -> dict[str, Scalar]:
    """All attributes as JSON scalars, in their order."""
    return {xml_text(str(name)): scalar(value) for name, value in attributes.items()}


def described(building: Building) -> dict[str, Scalar]:
    """A building's attributes with status, reason and ground height, as every product carries them."""
    own: dict[str, Scalar] = {
        STATUS_KEY: building.status.value,
        REASON_KEY: xml_text(building.reason),
        GROUND_KEY: scalar(round(building.ground_height, 4)),
    }
    return {
        **{k: v for k, v in scalars(building.attributes).items() if k not in (*own, PLANES_KEY, OVERHANGS_KEY)},
        **own,
    }


def xml_text(text: str) -> str:
    """The text with every character that XML 1.0 forbids (controls, lone surrogates) replaced by U+FFFD."""
    return _NOT_IN_XML.sub("\ufffd", text)


def ncname(prefix: str, identifier: str) -> str:
    """An XML NCName for any id, different for different ids: other characters become ``_xHEX_``.

    `prefix` starts with a letter, since ids often start with a digit.

    >>> ncname("b", "0503 <é>")
    'b-0503_x20__x3C__xE9__x3E_'
    """
    return f"{prefix}-" + _NOT_IN_NAMES.sub(lambda found: f"_x{ord(found.group()):X}_", identifier)

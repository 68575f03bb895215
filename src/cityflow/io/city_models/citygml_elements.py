"""Elements of GML and generic attributes that several parts of CityGML use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from cityflow.core.arrays import FloatArray
from cityflow.core.building import Scalar
from cityflow.io.attributes import xml_text
from cityflow.io.city_models.citygml_appearance import ring_name

LARGEST_INT = 2**31 - 1
"""Databases keep generic integers in 32 bits; longer ones, mostly ids, are written as text."""


def polygon_xml(name: str, rings: Sequence[str], textured: bool = False) -> str:
    """A polygon; rings have names only where texture coordinates refer to them."""
    names = [f' gml:id="{ring_name(name, n)}"' if textured else "" for n in range(len(rings))]
    exterior, *interiors = (
        f"<gml:LinearRing{ring_id}><gml:posList>{ring}</gml:posList></gml:LinearRing>"
        for ring_id, ring in zip(names, rings, strict=True)
    )
    holes = "".join(f"<gml:interior>{ring}</gml:interior>" for ring in interiors)
    return f'<gml:Polygon gml:id="{name}"><gml:exterior>{exterior}</gml:exterior>{holes}</gml:Polygon>'


def members_xml(polygons: Iterable[str]) -> str:
    """Surface members, one for each polygon."""
    return "".join(f"<gml:surfaceMember>{polygon}</gml:surfaceMember>" for polygon in polygons)


def generic_xml(attributes: Mapping[str, Scalar]) -> str:
    """Generic attributes; those without a value are left out."""
    return "".join(_generic_attribute(name, value) for name, value in attributes.items() if value is not None)


def _generic_attribute(name: str, value: Scalar) -> str:
    if isinstance(value, bool):
        kind, text = "string", "true" if value else "false"
    elif isinstance(value, int):
        kind, text = "int" if abs(value) <= LARGEST_INT else "string", str(value)
    elif isinstance(value, float):
        kind, text = "double", repr(value)
    else:
        kind, text = "string", text_xml(str(value))
    element = f"gen:{kind}Attribute"
    return f"<{element} name={quoteattr(name)}><gen:value>{text}</gen:value></{element}>\n"


def positions(points: FloatArray) -> str:
    """The corners of a ring, the first one again at its end."""
    return " ".join(f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in (np.concatenate([points, points[:1]]) + 0.0).tolist())


def text_xml(text: str) -> str:
    """Text as XML may hold it."""
    return escape(xml_text(text))

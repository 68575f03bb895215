"""Properties of an XMP packet as text, without a library: attributes and simple elements of its descriptions.

Pillow's own reader needs a package (defusedxml) for what is refused here beforehand: declarations of entities.
"""

from __future__ import annotations

import re
from xml.etree import ElementTree

NAMESPACES = {
    "http://www.dji.com/drone-dji/1.0/": "drone-dji", "http://pix4d.com/camera/1.0": "Camera", "http://pix4d.com/camera/1.0/": "Camera",
    "http://ns.adobe.com/exif/1.0/": "exif", "http://ns.adobe.com/exif/1.0/aux/": "aux", "http://ns.adobe.com/tiff/1.0/": "tiff",
    "http://www.autelrobotics.com/drone-autel/1.0/": "drone-autel", "http://cipa.jp/exif/1.0/": "exifEX",
}  # fmt: skip
"""Prefixes by which makers are known; a file may use others for the same names."""
RDF = "{http://www.w3.org/1999/02/22-rdf-syntax-ns#}"
MOST_BYTES = 1_000_000
"""A JPEG segment has 64 kB; TIFFs of some makers carry more."""


def xmp_tags(packet: bytes) -> dict[str, str]:
    """``prefix:name`` → text of every property; lists are joined by commas. Nothing where the packet is damaged, huge, or declares entities.

    >>> xmp_tags(b'<x><rdf:Description xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:c="http://pix4d.com/camera/1.0" c:Yaw="3"/></x>')
    {'Camera:Yaw': '3'}
    """
    text = packet.strip(b"\0 \r\n\t")
    if len(text) > MOST_BYTES or b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        return {}
    end = text.rfind(b">")
    try:
        root = ElementTree.fromstring(text[: end + 1])
    except (ElementTree.ParseError, LookupError, ValueError):
        return {}
    found: dict[str, str] = {}
    for node in root.iter(f"{RDF}Description"):
        for key, value in node.attrib.items():
            if not key.startswith(RDF):
                found.setdefault(_name(key), value.strip())
        for child in node:
            values = [item.text for item in child.iter(f"{RDF}li")] or [child.text]
            joined = ",".join(v.strip() for v in values if v and v.strip())
            if joined:
                found.setdefault(_name(child.tag), joined)
    return found


def _name(tag: str) -> str:
    space, _, name = tag[1:].partition("}") if tag.startswith("{") else ("", "", tag)
    known = NAMESPACES.get(space) or next((p for p in ("drone-dji", "drone-autel") if p in space), "")
    last = re.sub(r"[^A-Za-z0-9-]", "", space.rstrip("/").rsplit("/", 1)[-1])
    return f"{known or last}:{name}" if space else name

"""Markers of Metashape (Export Markers, XML): reference coordinates with accuracies, and pinned projections in images.

Projections count from the corner of the first pixel. A marker whose reference is switched off is a check point.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from cityflow.core.control_points import ControlPoints, Mark, Role
from cityflow.errors import CatalogError
from cityflow.io.control_points.collected import Collected, Sigmas
from cityflow.io.control_points.references import wkt_of
from cityflow.io.given_files import MODEL_MB, check_plain
from cityflow.io.orientation.model_text import numbers

AGAIN = "export the markers again, as Metashape XML"


def read_metashape_markers(path: str | Path) -> ControlPoints:
    """The markers of the first chunk that has any.

    Raises
    ------
    CatalogError
        Where the file is no such file, or a value is none.
    """
    check_plain(path, MODEL_MB)
    try:
        root = ElementTree.parse(path).getroot()
    except (OSError, ElementTree.ParseError, LookupError, ValueError) as error:
        raise CatalogError(f"the file cannot be read ({error})", where=str(path), remedy=AGAIN) from error
    chunk = next((c for c in root.iter("chunk") if c.find("markers") is not None), None)
    if chunk is None:
        raise CatalogError("the file has no chunk with markers", where=str(path), remedy=AGAIN)
    text = (chunk.findtext("reference") or "").strip()
    local = not text or text.upper().startswith(("LOCAL_CS", "ENGCRS"))
    collected = Collected(str(path))
    try:
        names = _placed(chunk, collected)
        _marked(chunk, collected, names)
    except ValueError as error:
        raise CatalogError(str(error), where=str(path), remedy=AGAIN) from error
    return collected.set(None if local else wkt_of(text, str(path)))


def _placed(chunk: ElementTree.Element, collected: Collected) -> dict[str, str]:
    """Names of markers by id; coordinates of those that have some."""
    setting = chunk.find("settings/property[@name='accuracy_markers']")
    common = numbers([setting.get("value", "")], 1, "accuracy_markers")[0] if setting is not None else None
    names: dict[str, str] = {}
    for node in chunk.findall("markers/marker"):
        name = names[node.get("id", "")] = node.get("label") or f"marker {node.get('id', '')}"
        reference = node.find("reference")
        if reference is None or reference.get("x") is None:
            continue
        xyz = numbers([reference.get(a, "") for a in "xyz"], 3, f"marker {name}")
        enabled = reference.get("enabled", "true").lower() not in ("false", "0")
        collected.place(name, xyz, 0, _sigmas(reference, name, common), Role.CONTROL if enabled else Role.CHECK)
    return names


def _sigmas(reference: ElementTree.Element, name: str, common: float | None) -> Sigmas | None:
    own = [reference.get(a) for a in ("sx", "sy", "sz")]
    if None in own:
        return (common,) * 3 if common else None
    x, y, z = numbers([str(v) for v in own], 3, f"the accuracy of marker {name}")
    return x, y, z


def _marked(chunk: ElementTree.Element, collected: Collected, names: dict[str, str]) -> None:
    images = {c.get("id", ""): c.get("label", "") for c in chunk.findall("cameras//camera")}
    for node in chunk.iter("marker"):
        for location in node.findall("location"):
            if location.get("pinned", "true").lower() in ("false", "0"):
                continue  # Metashape's own guess
            name, image = names.get(node.get("marker_id", "")), images.get(location.get("camera_id", ""))
            if name is None or image is None:
                raise ValueError(
                    f"a projection names marker {node.get('marker_id')} and camera {location.get('camera_id')}, one of which is not there"
                )
            col, row = numbers([location.get(a, "") for a in "xy"], 2, f"the projection of {name} in {image}")
            collected.mark(name, Mark(image, col, row), 0)

"""Entry page for the cities of several runs."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined

from cityflow.viewer.server import Served
from cityflow.viewer.view_page import DATA, FOLDER

CITY = f"{DATA}/city.json"
COVERS = ("From the south", "Models", "True ortho", "Surface (DSM)")
"""Titles of the pictures that show a city best, the best first."""


def cities_page(runs: Sequence[Served]) -> bytes:
    """A card for each run: a picture, how much of it is done, and the ways to its view and report."""
    loader = PackageLoader("cityflow.viewer", "web")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("cities.html.j2").render(cities=[_card(r) for r in runs]).encode()


def _card(served: Served) -> dict[str, Any]:
    city: dict[str, Any] = json.loads(served.read(CITY) or b"{}")
    place = quote(served.name)
    cover = _cover(city.get("pictures", ()))
    return {
        "title": city.get("title") or served.name, "verdict": city.get("verdict", "The page of this run cannot be read."),
        "textured": any(city.get("texture_pixels", {}).values()), "crs": city.get("crs", ""), "run": served.run,
        "view": f"{place}/{FOLDER}/index.html", "report": f"{place}/report.html",
        "cover": f"{place}/{FOLDER}/{cover}" if cover else "",
    }  # fmt: skip


def _cover(pictures: Iterable[dict[str, str]]) -> str:
    found = {p["title"]: p["path"] for p in pictures}
    return next((found[title] for title in COVERS if title in found), "")

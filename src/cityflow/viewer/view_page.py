"""The page that shows a run in a browser: fixed files, title, and pictures of the report for browsers without WebGL."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from hashlib import sha256
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from cityflow.viewer.picture import Picture

FOLDER = "view"
DATA = f"{FOLDER}/data"
PAGE = f"{FOLDER}/index.html"
STATIC = ("view.js", "licences.txt")
"""Shipped with the package; `view.js` is built from the sources in view/ (docs/view.md)."""
STYLE = "view.css"
"""Stands in the page itself: it is painted as soon as it has come."""


def page_files(title: str, attribution: str, pictures: Sequence[Picture]) -> Iterator[tuple[str, bytes]]:
    """Path in RUN and contents of the page, of what it is made of, and of the pictures; the page comes last."""
    for name in STATIC:
        yield f"{FOLDER}/{name}", static(name)
    shown = []
    for number, picture in enumerate(pictures):
        path = picture_path(number)
        yield f"{FOLDER}/{path}", picture.jpeg
        shown.append({"path": path, "title": picture.title, "caption": picture.caption,
                      "width": picture.width, "height": picture.height})  # fmt: skip
    style = Markup(static(STYLE).decode())
    page = (
        _environment()
        .get_template("index.html.j2")
        .render(title=title, attribution=attribution, pictures=shown, style=style)
    )
    yield PAGE, page.encode()


def picture_path(number: int) -> str:
    """Of one of the report's pictures, seen from the page."""
    return f"pictures/{number}.jpg"


@cache
def static(name: str) -> bytes:
    """A file of the page that is the same for every run."""
    return (files("cityflow.viewer") / "web" / name).read_bytes()


@cache
def page_version() -> str:
    """Changes with every change of the page's fixed files: a page of before does not go with a program of now."""
    web = files("cityflow.viewer") / "web"
    names = (*STATIC, STYLE, "index.html.j2")
    return sha256(b"".join((web / name).read_bytes() for name in names)).hexdigest()


@cache
def _environment() -> Environment:
    loader = PackageLoader("cityflow.viewer", "web")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)

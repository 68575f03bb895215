"""Pages of the documentation's site that are no files of docs/: those of the project, and the reference, made from the code. Hooks of MkDocs.

`mkdocs build --strict` calls `on_files` and `on_page_markdown`; mkdocs.yml names this file.
"""

from __future__ import annotations

import ast
import posixpath
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import typer

ROOT = Path(__file__).parents[1]
PROJECT = {
    "README.md": "index.md", "docs/README.md": "pages.md", "ARCHITECTURE.md": "project/architecture.md", "CONTRIBUTING.md": "project/contributing.md",
    "CHANGELOG.md": "project/changelog.md", "SECURITY.md": "project/security.md",
}  # fmt: skip
"""Files of the project → their pages."""
LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")
ERRORS = ("CatalogError", "WorkflowError", "RunError", "CityflowError", "RegistrationError", "RefusedUnit")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages that are no files of docs/."""
    from mkdocs.structure.files import File

    made = {page: (ROOT / name).read_text(encoding="utf-8") for name, page in PROJECT.items()}
    for page, text in {**made, **{name: write() for name, write in REFERENCE.items()}}.items():
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:  # noqa: ARG001 - names that MkDocs gives
    """Turn links between files of the project into links between pages."""
    return with_moved_links(markdown, page.file.src_uri)


def with_moved_links(text: str, page: str) -> str:
    """A page's text whose links lead to pages of the site; of a link to any other file of the project only the words stay.

    >>> with_moved_links("[how](docs/view.md#top), [it](deploy/tls.sh)", "index.md")
    '[how](view.md#top), it'
    """
    source = {made: name for name, made in PROJECT.items()}.get(page, f"docs/{page}")

    def moved(found: re.Match[str]) -> str:
        image, words, target = found.groups()
        path, mark, anchor = target.partition("#")
        if not path or "://" in target or target.startswith("mailto:"):
            return found[0]
        place = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
        if place not in PROJECT and not place.startswith("docs/"):
            return words
        to = PROJECT.get(place, place.removeprefix("docs/"))
        return f"{image}[{words}]({posixpath.relpath(to, posixpath.dirname(page) or '.')}{mark}{anchor})"

    return LINK.sub(moved, text)


def commands() -> str:
    """Every command with its arguments and options, as `--help` has them."""
    from cityflow.cli import app

    parts = [
        "# Commands",
        "As `cityflow COMMAND --help` prints them. What all have in common: [The command line](../commands.md).",
    ]
    group: Any = typer.main.get_command(app)
    for name, command in _all_commands("cityflow", group):
        arguments = [p for p in command.params if p.param_type_name == "argument"]
        options = [p for p in command.params if p.param_type_name == "option" and p.name != "help"]
        usage = " ".join([name, *map(_argument, arguments), *(["[OPTIONS]"] if options else [])])
        parts += [f"## {name}", command.help or "", f"```\n{usage}\n```"]
        rows = [f"| `{_argument(a)}` | {_cell(a.help or '')} | |" for a in arguments]
        rows += [f"| {_names(o)} | {_cell(o.help or '')} | {_default(o)} |" for o in options]
        if rows:
            parts.append("\n".join(["| | | default |", "|---|---|---|", *rows]))
    return "\n\n".join(parts) + "\n"


def _all_commands(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    """Those that do something; a group has further ones below it."""
    below: Mapping[str, Any] = getattr(command, "commands", {})
    if not below:
        yield name, command
    for word, inner in below.items():
        yield from _all_commands(f"{name} {word}", inner)


def _argument(argument: Any) -> str:
    name = str(argument.metavar or argument.name.upper())
    many = "..." if argument.nargs != 1 else ""
    return f"{name}{many}" if argument.required else f"[{name}{many}]"


def _names(option: Any) -> str:
    words = [*option.opts, *option.secondary_opts]
    return ", ".join(f"`{word}`" for word in sorted(words, key=lambda w: (w.startswith("--"), words.index(w))))


def _default(option: Any) -> str:
    value = option.default
    plain = isinstance(value, str | int | float | Path) and not isinstance(value, bool)
    return f"`{value}`" if plain and str(value) else ""


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|").replace("<", "&lt;")


def keys() -> str:
    """Every key of a workflow, by stage."""
    from cityflow.runs.known_keys import CITY, known_keys

    parts = [
        "# Workflow keys",
        "All that a workflow file or `--set` may set; `cityflow parameters` prints the most useful ones.",
    ]
    known, stage = known_keys(CITY), ""
    for name, key in known.items():
        if name.partition(".")[0] != stage:
            stage = name.partition(".")[0]
            parts.append(f"\n## {stage}\n\n| key | meaning | default | allowed |\n|---|---|---|---|")
        default = f"`{_cell(key.default)}`" if key.default else ""
        parts.append(f"| `{name}` | {_cell(key.meaning)} | {default} | {_cell(key.may_be)} |")
    return "\n\n".join(parts[:2]) + "\n" + "\n".join(parts[2:]) + "\n"


def products() -> str:
    """Formats of the model, and layers of the surface."""
    from cityflow.io.export_formats.formats import TITLES, folder_of
    from cityflow.io.rasters.surface_zarr import CLASSES, image_layers

    lines = [
        "# Products", "", "What is in them, and who reads them: [formats](../formats.md).", "",
        "## Formats of the model", "", "| `export.formats` | | folder |", "|---|---|---|",
        *(f"| `{name}` | {title} | `{folder_of(name)}` |" for name, title in TITLES.items()), "",
        "## Layers of surface.zarr", "", "| layer | meaning | unit | type |", "|---|---|---|---|",
    ]  # fmt: skip
    lines += [
        f"| `{name}` | {layer.meaning} | {layer.units} | {layer.dtype} |"
        for name, layer in image_layers(3, "uint8").items()
    ]
    classes = ", ".join(f"{number} {name.replace('_', ' ')}" for number, name in CLASSES.items())
    lines += ["", f"`sigma`, `ortho` and `ortho_seen` are of surfaces from images. Values of `class`: {classes}."]
    return "\n".join(lines) + "\n"


def messages() -> str:
    """Errors that a user can fix, with what to do; `…` stands for what differs."""
    found = sorted({row for path in sorted((ROOT / "src").rglob("*.py")) for row in _messages(path)})
    lines = [
        "# Messages", "", "Errors that a user can fix are printed as WHERE: PROBLEM → REMEDY; `…` stands for names and values.", "",
        "| problem | remedy |", "|---|---|", *(f"| {_cell(problem)} | {_cell(remedy)} |" for problem, remedy in found),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _messages(path: Path) -> Iterator[tuple[str, str]]:
    """Problem and remedy of each error that is raised with a text."""
    text = path.read_text(encoding="utf-8")
    if not any(f"{name}(" in text for name in ERRORS):
        return
    for function in (n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef)):
        known = {
            target.id: words
            for n in ast.walk(function) if isinstance(n, ast.Assign) and (words := _words(n.value, {}))
            for target in n.targets if isinstance(target, ast.Name)
        }  # fmt: skip
        for call in (n for n in ast.walk(function) if isinstance(n, ast.Call)):
            if isinstance(call.func, ast.Name) and call.func.id in ERRORS and call.args:
                remedy = next((k.value for k in call.keywords if k.arg == "remedy"), None)
                if problem := _words(call.args[0], known):
                    yield problem, "" if remedy is None else _words(remedy, known)


def _words(node: ast.expr, known: Mapping[str, str]) -> str:
    """The text of an expression, as far as it is written there.

    >>> _words(ast.parse("f'no image {name!r} in {x}'", mode="eval").body, {})
    'no image … in …'
    """
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.Name):
        return known.get(node.id, "")
    if isinstance(node, ast.JoinedStr):
        return "".join(_words(part, {}) if isinstance(part, ast.Constant) else "…" for part in node.values)
    return ""


REFERENCE: Mapping[str, Callable[[], str]] = {
    "reference/commands.md": commands, "reference/keys.md": keys, "reference/products.md": products, "reference/messages.md": messages,
}  # fmt: skip
"""Page → what writes it."""

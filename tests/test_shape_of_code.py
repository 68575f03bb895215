"""Functions and modules stay small."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

SRC = Path(__file__).parents[1] / "src" / "cityflow"
MOST_ARGUMENTS, MOST_LINES = 8, 300

SHARED_NAMES = {
    "cityjson.py", "citygml.py", "obj.py", "tiles3d.py",
    "evaluate.py", "orient.py", "rasters.py",
    "fuse.py", "match.py", "split.py",
    "images.py",
    "texture.py",
}  # fmt: skip
"""Files of one name in several folders: an export format and its file; a command and what it does; a stage and its algorithm; a stage for images in
two folders of stages; a value and what makes it."""


def _modules() -> Iterator[tuple[str, str]]:
    for path in sorted(SRC.rglob("*.py")):
        yield path.relative_to(SRC).as_posix(), path.read_text()


@cache
def _functions(text: str) -> tuple[ast.FunctionDef | ast.AsyncFunctionDef, ...]:
    return tuple(n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef))


def _arguments(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Without self and cls."""
    a = function.args
    every = [*a.posonlyargs, *a.args, *a.kwonlyargs, *filter(None, (a.vararg, a.kwarg))]
    return len([x for x in every if x.arg not in ("self", "cls")])


def _with_many_arguments(name: str, text: str) -> set[str]:
    return {f"{name}:{f.name}" for f in _functions(text) if _arguments(f) > MOST_ARGUMENTS}


def _mixed_tuples(name: str, text: str) -> set[str]:
    found = set()
    for function in _functions(text):
        for argument in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs):
            kind = argument.annotation
            if (
                isinstance(kind, ast.Subscript)
                and ast.unparse(kind.value) == "tuple"
                and isinstance(kind.slice, ast.Tuple)
            ):
                types = {ast.unparse(e) for e in kind.slice.elts}
                if len(types) > 1 and "..." not in types:
                    found.add(f"{name}:{function.name}.{argument.arg}")
    return found


def test_no_argument_is_a_tuple_of_several_types() -> None:
    found = set().union(*(_mixed_tuples(name, text) for name, text in _modules()))
    assert not found, "give these a NamedTuple, or several arguments"


def test_no_function_has_more_than_eight_arguments() -> None:
    """Commands have one for each option."""
    found = set().union(*(_with_many_arguments(name, text) for name, text in _modules() if not name.startswith("cli/")))
    assert not found, "give these a NamedTuple or a dataclass"


def test_no_module_is_longer_than_300_lines() -> None:
    found = {name for name, text in _modules() if text.count("\n") > MOST_LINES}
    assert not found, "part these by what they answer"


def test_no_stage_reads_parameters_without_their_model() -> None:
    """And no arguments: `parameters_as` and `arguments_as` check what they are given."""
    found = {name for name, text in _modules() if re.search(r"task\.(parameters|arguments)(\[|\.get)", text)}
    assert not found


def test_tasks_of_stages_are_made_by_their_kinds() -> None:
    """So that version, function and arguments are stated once, where the stage is; synthetic surveys have no stages."""
    stages = {
        name: text for name, text in _modules() if name.startswith("stages/") and not name.startswith("stages/synth/")
    }
    assert sum("TaskKind(" in text for text in stages.values()) >= 15
    assert not {name for name, text in stages.items() if re.search(r"\bTask\(", text)}


def _in_several_folders(names: Iterable[str]) -> set[str]:
    counts = Counter(Path(n).name for n in names if not n.endswith("__init__.py"))
    return {name for name, count in counts.items() if count > 1}


def test_files_of_one_name_are_those_that_nobody_mixes_up() -> None:
    found = _in_several_folders(name for name, _ in _modules())
    assert not found - SHARED_NAMES, "name these by what they answer"
    assert not SHARED_NAMES - found, "these stand in one folder now: take them off the list"


def test_names_are_counted() -> None:
    assert _in_several_folders(["a/b.py", "c/b.py", "a/__init__.py", "c/__init__.py", "c/d.py"]) == {"b.py"}


def test_arguments_are_counted() -> None:
    nine = "class A:\n    def f(self, a, b, /, c, d, *e, f, g, h, **i): ...\n    def g(self, a, b, c, d, e, f, g, h): ...\n"
    assert _with_many_arguments("a.py", nine) == {"a.py:f"}

"""Which groups of tests were skipped because a tool is not on the machine: said at the end of a test run, so that nobody takes them for passed."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tool:
    """Something that some tests need beside Python's packages.

    Attributes
    ----------
    pattern : of the reasons of tests that are skipped without it
    unchecked : what nobody has looked at then
    remedy : how it gets onto the machine
    """

    name: str
    pattern: str
    unchecked: str
    remedy: str


TOOLS = (
    Tool("Chromium", r"no Chromium", "the page of the view in a browser", "apt-get install chromium"),
    Tool("node and npm", r"no node and npm", "that the view's bundle is what its sources make", "apt-get install nodejs npm"),
    Tool("the packages of view/package-lock.json", r"npm cannot fetch", "that the view's bundle is what its sources make", "npm ci, in view/, once online"),
    Tool("libcitygml's program", r"libcitygml-bin", "that libcitygml reads CityGML", "apt-get install libcitygml-bin"),
    Tool("libcitygml's library", r"libcitygml-dev", "what libcitygml shows of textures", "apt-get install g++ libcitygml-dev"),
    Tool("openssl", r"no openssl", "a scheduler with TLS", "apt-get install openssl"),
    Tool("glTF's validator", r"gltf-validator", "3D Tiles by the official validator", "npm install -g gltf-validator, with NODE_PATH"),
)  # fmt: skip


def missing_tools(reasons: Iterable[str]) -> Iterator[str]:
    """A line for each tool that is missing, from the reasons of all skipped tests."""
    count = Counter(tool for reason in reasons for tool in TOOLS if re.search(tool.pattern, reason))
    for tool in TOOLS:
        if count[tool]:
            tests = "1 test" if count[tool] == 1 else f"{count[tool]} tests"
            yield f"{tool.name}: {tests} skipped; not checked: {tool.unchecked} ({tool.remedy})"

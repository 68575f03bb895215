"""`make test` looks for tests with a cluster in some folders only: collecting all the others takes longer than to run many a test."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_make_test_names_every_folder_with_tests_that_have_a_cluster() -> None:
    found = {
        path.relative_to(ROOT).parts[1]
        for path in (ROOT / "tests").rglob("*.py")
        if re.search(r"mark\.cluster", path.read_text(encoding="utf-8"))
    }
    (line,) = [x for x in (ROOT / "Makefile").read_text(encoding="utf-8").splitlines() if "-m cluster" in x]
    assert set(re.findall(r" tests/(\S+)", line)) == found

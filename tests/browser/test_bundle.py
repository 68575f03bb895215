"""The committed bundle is what its sources make, and names whose code is in it."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

VIEW = Path(__file__).parents[2] / "view"
WEB = Path(__file__).parents[2] / "src/cityflow/viewer/web"


def test_the_licences_of_all_that_is_bundled_are_shipped() -> None:
    wanted = json.loads((VIEW / "package.json").read_text())["dependencies"]
    text = (WEB / "licences.txt").read_text("utf-8")
    for name, version in wanted.items():
        assert f"{name} {version} (" in text
    assert "Permission is hereby granted" in text, "of three"
    assert "Apache License" in text, "of 3d-tiles-renderer"


def test_versions_are_locked_without_naming_a_registry() -> None:
    lock = json.loads((VIEW / "package-lock.json").read_text())
    packages = {name: said for name, said in lock["packages"].items() if name}
    assert all("integrity" in said for said in packages.values())
    assert not any("resolved" in said for said in packages.values())


def test_building_again_gives_the_committed_bundle() -> None:
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm is None or node is None:
        pytest.skip("no node and npm here (Debian: apt-get install nodejs npm)")
    if not (VIEW / "node_modules/esbuild").is_dir():
        installed = subprocess.run(
            [npm, "ci", "--no-audit", "--no-fund"], cwd=VIEW, capture_output=True, text=True, timeout=180
        )
        if installed.returncode:
            pytest.skip(f"npm cannot fetch what the lock file names: {installed.stderr.strip()[-200:]}")
    done = subprocess.run([node, "build.mjs", "--check"], cwd=VIEW, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr

"""How soon a run begins: its driver and the process of every worker load these modules first."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

SLOW = ("pandas", "geopandas", "pyogrio", "scipy.stats", "scipy.interpolate", "open3d", "matplotlib")
"""Together they take longer to load than all that a run needs; who reads a vector file or draws a picture loads what it wants."""


def test_a_run_loads_no_library_that_it_may_not_need() -> None:
    """And the child of a worker, which runs the stages, nothing of the scheduler's."""
    code = (
        "import sys, pkgutil, importlib, cityflow.stages as s\n"
        "for m in pkgutil.iter_modules(s.__path__):\n    importlib.import_module('cityflow.stages.' + m.name)\n"
        "print([m for m in ('cityflow.stages.surface', 'distributed', 'dask') if m in sys.modules])\n"
        f"import cityflow.workflow.run; print([m for m in {SLOW!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["['cityflow.stages.surface']", "[]"]


def test_what_cannot_be_is_said_before_anything_heavy_is_loaded(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "run.json").write_text("{}")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "run.json").write_text(json.dumps({"catalog": str(tmp_path / "nowhere")}))
    run, root = str(tmp_path / "run"), Path(__file__).parents[2]
    flight = root / "workflows" / "demo_flight.yaml"
    away = ["--scheduler", "tcp://127.0.0.1:9"]
    city = [
        str(root / "workflows/lidar_city.yaml"),
        "--catalog",
        str(root / "catalogs/delft"),
        "--out",
        str(tmp_path / "new"),
    ]
    expected = {
        "nothing chosen": ["rerun", run],
        "no scheduler to submit it to": ["rerun", run, "--failed", "--submit"],
        "no such format": ["join", run, "--out", str(tmp_path / "a.zip")],
        "no such folder": ["raster", run, "--out", str(tmp_path / "b" / "a.tif")],
        "cannot write here": ["join", run, "--out", "/proc/a.gpkg"],
        "no scheduler answers": ["submit", *city, *away],
        "it has no port": ["run", *city, "--scheduler", "tcp://host"],
        "names no catalog": ["run", str(flight), "--out", str(tmp_path / "new")],
        "nowhere: no such catalog": ["plan", str(flight), "--out", str(tmp_path / "other")],
        "use workflows/lidar_city.yaml": ["plan", str(flight), "--catalog", str(root / "catalogs/delft")],
        "surface of LiDAR files, and the catalog has oriented images": [
            "run",
            city[0],
            "--catalog",
            str(root / "catalogs/boruszyn"),
        ],
    }
    code = (
        "import sys, json\nfrom cityflow.cli import main\n"
        "for words in json.loads(sys.argv[1]):\n"
        "    sys.argv = ['cityflow', *words]\n"
        "    try:\n        main()\n    except SystemExit:\n        pass\n"
        "print([m for m in ('numpy', 'distributed', 'shapely') if m in sys.modules])"
    )
    given = [sys.executable, "-c", code, json.dumps(list(expected.values()))]
    done = subprocess.run(given, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    lines = done.stderr.strip().splitlines()
    assert len(lines) == len(expected)
    for line, problem in zip(lines, expected, strict=True):
        assert problem in line
        assert "→" in line

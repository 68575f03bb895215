"""A new stage touches its own file and one line of the pipeline: the recipe of CONTRIBUTING.md, done."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import cityflow
from cityflow.pipeline.pipeline import line_of_stages, table_of_stages
from cluster.small_city import make_city, scene

ROOT = Path(__file__).parents[2]
HOUSES = 4

COUNT = '''"""Stage ``count``: how many corners the outline of a building has."""

from cityflow.flow.stage import Cost, Place, Stage
from cityflow.flow.task_kind import TaskKind
from cityflow.handover.outline_lines import OutlineAt

NAME = "count"


def task(survey, unit):
    return KIND.task(unit.id, unit.at, inputs={"outline": unit.digest}, limits=survey.limits(NAME))


def run(workspace, task):
    polygon = task.arguments_as(OutlineAt).read(workspace.store).polygon
    return workspace.outcome(result={"corners": len(polygon.exterior.coords) - 1})


KIND = TaskKind(NAME, 1, run, OutlineAt)

STAGE = Stage(
    name=NAME,
    unit="building",
    place=Place.UNIT,
    text="outline → number of its corners",
    kinds=(KIND,),
    task=lambda city, name: task(city.survey, city.units[name]),
    starts=lambda city, ended: city.chosen[ended[1]] if city.names_units(ended) else (),
    count=lambda city: city.count_units(),
    cost=Cost(0.1, 100.0, 0.0),
)
'''

AS_CHANGED = """
import json, sys, types
from pathlib import Path

folder, catalog, workflow, run = sys.argv[1:]
import cityflow.pipeline, cityflow.stages

cityflow.stages.__path__.append(folder)
source = (Path(cityflow.pipeline.__file__).parent / "pipeline.py").read_text()
# the one line, with the import that ruff would sort into the others
changed = source.replace("    units.STAGE,\\n", "    units.STAGE,\\n    count.STAGE,\\n")
changed = changed.replace("    export,\\n", "    export,\\n    count,\\n", 1)
module = types.ModuleType("cityflow.pipeline.pipeline")
sys.modules[module.__name__] = cityflow.pipeline.pipeline = module
exec(changed, module.__dict__)

from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.pipeline.city_part import CityPart
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.pipeline.pipeline import in_flow_order
from cityflow.workflow.chosen_part import Selection, part_of
from cityflow.workflow.expected import costs_of
from cityflow.workflow.plan import plan_of
from cityflow.runs.settings import load_workflow
from in_process import outcome_of, record_of, run_all
from workflow.test_chosen_part import Kept

parameters = load_workflow(Path(workflow), ["execution.count.time_s=7"]).city
first = plan_of(CitySource(read_catalog(catalog), parameters), None)
source = CitySource(read_catalog(catalog), parameters)
records = run_all(source, Store.open(run))
building = sorted(unit for stage, unit in records if stage == "reconstruct")[0]
fresh = lambda: CitySource(read_catalog(catalog), parameters)
chosen = part_of(fresh().city, Kept(records), Selection(units=(building,)))
part = CityPart(fresh(), chosen, Kept(records))
waiting, again = list(part.initial()), []
while waiting:
    task = waiting.pop()
    node = task.stage, task.unit
    again.append(node)
    if node in chosen.nodes:
        records[node] = record_of(task, outcome_of(Store.open(run), task))
    waiting.extend(part.after(task, records[node]))
print(json.dumps({
    "corners": {unit: r.result["corners"] for (stage, unit), r in records.items() if stage == "count"},
    "order": in_flow_order(s for s, _ in records), "planned": [first["count"].total, costs_of(None)["count"].seconds],
    "building": building, "again": sorted(again), "chosen": sorted(chosen.nodes), "left": len(part.walk.left),
    "expected": source.expected_units()["count"], "limit_s": source.survey.limits("count").time_s,
}))
"""


def test_a_stage_that_counts_is_a_file_and_a_line(tmp_path: Path) -> None:
    (tmp_path / "stages").mkdir()
    (tmp_path / "stages" / "count.py").write_text(COUNT)
    outlines = dict(list(scene().outlines.items())[:HOUSES])
    city = make_city(tmp_path / "town", list(outlines.items()))
    city.change_workflow(reconstruct={"methods": ["extruded"]}, export={"formats": ["obj"]})
    arguments = [str(tmp_path / "stages"), str(city.catalog), str(city.workflow), str(tmp_path / "run")]
    path = [str(Path(cityflow.__file__).parents[1]), str(ROOT / "tests")]
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:0] = {path!r}\n{AS_CHANGED}", *arguments],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert found["corners"].keys() == outlines.keys()
    assert all(n >= 3 for n in found["corners"].values())
    assert found["order"] == ["ingest", "surface", "outline", "count", "reconstruct", "export"]
    assert found["planned"][1] == 0.1
    assert found["expected"] == len(outlines)
    assert found["limit_s"] == 7
    own = [["count", found["building"]], ["reconstruct", found["building"]]]
    assert found["chosen"] == own
    assert [node for node in found["again"] if node[0] != "export"] == own
    assert not found["left"]


def test_the_import_rules_hold_for_a_new_stage_as_they_are(tmp_path: Path) -> None:
    """One that uses another stage breaks the rule for stages, and no other rule needs a word on it."""
    source = Path(cityflow.__file__).parent
    shutil.copytree(
        source,
        tmp_path / "cityflow",
        ignore=lambda folder, names: [n for n in names if not _holds_code(Path(folder, n))],
    )
    (tmp_path / "cityflow" / "stages" / "count.py").write_text(COUNT + "\nfrom cityflow.stages import split\n")
    command = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(sys.argv[1], no_cache=True, no_logo=True))"
    done = subprocess.run(
        [sys.executable, "-c", command, str(ROOT / "pyproject.toml")],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert "No stage knows another BROKEN" in done.stdout, done.stdout
    assert "3 kept, 1 broken" in done.stdout
    assert "cityflow.stages.count -> cityflow.stages.split" in done.stdout


def _holds_code(path: Path) -> bool:
    return path.suffix == ".py" or (path.is_dir() and path.name != "__pycache__")


def test_architecture_shows_the_stages_as_they_are() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text()
    assert f"\n{line_of_stages()}\n" in text, "ARCHITECTURE.md, section 1: put line_of_stages() there"
    assert table_of_stages() in text, (
        "ARCHITECTURE.md, section 1: put table_of_stages() of cityflow.pipeline.pipeline there"
    )

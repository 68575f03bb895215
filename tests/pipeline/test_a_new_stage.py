"""A new stage touches its own file and one line of the pipeline: the recipe of CONTRIBUTING.md, done."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import cityflow
from cityflow.pipeline.pipeline import table_of_stages
from cluster.small_city import make_city, scene

ROOT = Path(__file__).parents[2]
HOUSES = 4

COUNT = '''"""Stage ``count``: how many corners the outline of a building has."""

from cityflow.flow.stage import Cost, Stage
from cityflow.flow.task import Task
from cityflow.flow.typed import as_json
from cityflow.handover.outline_lines import OutlineAt

NAME = "count"


def task(survey, unit):
    given = as_json(unit.at)
    return Task(NAME, unit.id, "cityflow.stages.count:run", 1, inputs={"outline": unit.digest}, arguments=given, limits=survey.limits(NAME))


def run(workspace, task):
    polygon = task.arguments_as(OutlineAt).read(workspace.store).polygon
    return workspace.outcome(result={"corners": len(polygon.exterior.coords) - 1})


STAGE = Stage(
    name=NAME,
    unit="building",
    text="outline → number of its corners",
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
changed = source.replace("    split.STAGE,\\n", "    split.STAGE,\\n    count.STAGE,\\n")
changed = changed.replace("    export,\\n", "    export,\\n    count,\\n", 1)
module = types.ModuleType("cityflow.pipeline.pipeline")
sys.modules[module.__name__] = cityflow.pipeline.pipeline = module
exec(changed, module.__dict__)

from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.pipeline.city_source import CitySource
from cityflow.pipeline.workflow_parameters import CityParameters
from cityflow.pipeline.pipeline import in_flow_order
from cityflow.workflow.expected import costs_of
from cityflow.workflow.plan import plan_of
from cityflow.runs.settings import load_workflow
from in_process import run_all

parameters = load_workflow(Path(workflow), ["execution.count.time_s=7"]).city
first = plan_of(CitySource(read_catalog(catalog), parameters), None)
source = CitySource(read_catalog(catalog), parameters)
records = run_all(source, Store.open(run))
print(json.dumps({
    "corners": {unit: r.result["corners"] for (stage, unit), r in records.items() if stage == "count"},
    "order": in_flow_order(s for s, _ in records), "planned": [first["count"].total, costs_of(None)["count"].seconds],
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


def test_architecture_shows_the_stages_as_they_are() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text()
    assert table_of_stages() in text, (
        "ARCHITECTURE.md, section 1: put table_of_stages() of cityflow.pipeline.pipeline there"
    )

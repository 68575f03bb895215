"""From command-line options to workflow, catalog, area and RUN."""

from __future__ import annotations

import hashlib
import json
import pickle
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cityflow.core.edits import Edits
from cityflow.errors import WorkflowError
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.io.catalog.stac import read_catalog
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.io.crs import suspicion
from cityflow.io.tables.edits_gpkg import read_edits
from cityflow.pipeline.city_source import CitySource
from cityflow.runs.catalog_fits import refuse_unfit
from cityflow.runs.edits_file import edits_href, with_own_edits
from cityflow.runs.first_look import DESCRIPTION, RUNS
from cityflow.runs.known_keys import known_keys
from cityflow.runs.look_at_survey import resolved, unnamed
from cityflow.runs.overrides import read_overrides
from cityflow.runs.plan_program import plan_program
from cityflow.runs.poses_note import SettledPoses
from cityflow.runs.settings import Workflow, load_workflow
from cityflow.runs.settled_poses import catalog_in_use, is_refinable, settled_poses
from cityflow.survey.area import Area, parse_area
from cityflow.survey.kept_plans import RunPlans


@dataclass(frozen=True, slots=True)
class Prepared:
    """What a run needs to know before it starts.

    Attributes
    ----------
    catalog : with the poses that the run uses
    notes : for whoever gave the command
    given : the catalog as it is, where its poses have been looked for in the RUN (`with_settled_poses`)
    poses : what the RUN knows of them; None where nothing is known, or nobody asks
    """

    workflow: Workflow
    catalog: Catalog
    area: Area
    store: Store
    notes: tuple[str, ...] = ()
    given: Catalog | None = None
    poses: SettledPoses | None = None

    @property
    def poses_are_unknown(self) -> bool:
        """Whether a run looks at the given poses before anything else, and nothing is known of them yet."""
        return self.poses is None and is_refinable(self.workflow.city, self.given or self.catalog)

    def as_given(self) -> Prepared:
        """With the poses of the catalog."""
        return replace(self, catalog=self.given or self.catalog)

    def with_settled_poses(self) -> Prepared:
        """With the poses that the RUN says, where it says some of this catalog and these parameters; else with those of the catalog."""
        given = self.given or self.catalog
        found = settled_poses(self.workflow.city, given, self.store)
        return replace(self, catalog=catalog_in_use(given, found), given=given, poses=found)

    @property
    def overrides(self) -> Mapping[tuple[str, str], Mapping[str, Any]]:
        return read_overrides(self.store)

    def source(self, ledger: Ledger | None = None) -> CitySource:
        """The tasks of the run; `ledger`: its records, for whoever asks what is done."""
        plans = RunPlans(self.store, DESCRIPTION, plan_program())
        city = with_own_edits(self.workflow.city, self.store)
        return CitySource(self.catalog, city, self.area, self.overrides, plans, ledger)

    def edits(self) -> Edits:
        """What a person has drawn, as `Survey.edits`, without a survey. Raises CatalogError where it cannot be read."""
        href = edits_href(self.workflow.city, self.store)
        return read_edits(href, self.catalog.reference) if href else Edits()

    def given_digest(self, edits: Edits) -> str:
        """Of all that the catalog says, and the edits of the run: the same for the same ones read by the same program."""
        return hashlib.sha256(pickle.dumps((self.catalog, edits), protocol=5)).hexdigest()

    @contextmanager
    def ledger(self) -> Iterator[Ledger | None]:
        """The ledger of the RUN, or None where nothing ran there yet (nothing is created)."""
        if not self.store.exists("run.json"):
            yield None
            return
        with Ledger.open(self.store) as ledger:
            yield ledger


def prepared(
    workflow_path: Path, catalog: str, out: str, settings: Sequence[str], aoi: str, *, allow_outside: bool = False
) -> Prepared:
    """Read workflow and catalog; nothing is written. Where neither the command nor the workflow names a catalog, it is that of the RUN, and so is the area.

    Raises
    ------
    WorkflowError, CatalogError, RunError
    """
    known_keys()  # kept for the next command's look
    workflow = _with_edits(load_workflow(workflow_path, settings), workflow_path)
    store = Store.open(out or f"{RUNS}/{workflow.name}")
    known = {} if catalog or workflow.catalog else _description(store)
    named = catalog or known.get("catalog", "") or resolved(workflow.catalog, workflow_path)
    if not named:
        raise unnamed(workflow_path)
    found = read_catalog(named, allow_outside=allow_outside)
    refuse_unfit(workflow.city, found)
    area = Area.of_wkt(known["area"]) if known.get("area") and not aoi else parse_area(aoi, found.reference)
    notes = found.notes
    if known:
        limited = " and its area" if known.get("area") and not aoi else ""
        notes += (f"Catalog{limited} as in the RUN: {found.href}",)
    if workflow.city.orient.refine == "always" and not is_refinable(workflow.city, found):
        notes += (
            "orient.refine=always has no effect: poses are adjusted where the surface is made of three images at least",
        )
    if doubt := suspicion(found.reference, found.bounds):
        notes += (f"Warning: {doubt}; cityflow catalog check {shlex.quote(found.href)} says more",)
    return Prepared(workflow, found, area, store, notes).with_settled_poses()


def _description(store: Store) -> dict[str, Any]:
    """What the RUN says of itself; nothing where there is none."""
    if not store.exists(DESCRIPTION):
        return {}
    tree = json.loads(store.read_bytes(DESCRIPTION))
    return tree if isinstance(tree, dict) else {}


def _with_edits(workflow: Workflow, path: Path) -> Workflow:
    """The file of edits by a path that holds wherever a later rerun is started from.

    Raises
    ------
    WorkflowError
        It is neither in the folder one stands in nor beside the workflow file.
    """
    named = workflow.city.edits.path
    if not named or "://" in named:
        return workflow
    places = list(dict.fromkeys((Path(named).absolute(), (path.parent / named).absolute())))
    here = next((p for p in places if p.is_file()), None)
    if here is None:
        raise WorkflowError(
            f"edits.path = '{named}' is no file: looked for {' and '.join(map(str, places))}",
            where=str(path),
            remedy="a relative path refers to the current folder, else to the folder of the workflow file; fix it, or leave edits.path empty",
        )
    tree = workflow.model_dump(mode="json")
    tree["city"]["edits"]["path"] = str(here)
    return Workflow.model_validate(tree)

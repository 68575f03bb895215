"""A RUN of somebody else names a function: nothing imports it unless the user says so."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.runs.overrides import read_overrides, write_overrides
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import open_run
from cityflow.runs.settings import checked
from cityflow.survey.area import EVERYWHERE
from cityflow.workflow.serve import is_inside, reader
from cityflow.workflow.trust import refuse_untrusted
from cluster.small_city import make_city

FOREIGN = "somebody.elses:method"


def run_of(store: Store, *methods: str) -> Prepared:
    tree = {"name": "a", **({"reconstruct": {"methods": list(methods)}} if methods else {})}
    return Prepared(checked(tree, where="a.yaml"), Catalog.__new__(Catalog), EVERYWHERE, store)


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store.open(tmp_path / "run")


def test_functions_that_the_run_names_are_refused(store: Store) -> None:
    with pytest.raises(RunError, match=f"names a custom function, {FOREIGN}.*--trust"):
        refuse_untrusted(run_of(store, "extruded", FOREIGN), [], of_the_run=True)


def test_functions_that_the_user_names_are_not(store: Store) -> None:
    refuse_untrusted(run_of(store, FOREIGN), [], of_the_run=False)
    refuse_untrusted(run_of(store, FOREIGN), [f"reconstruct.methods=[extruded, '{FOREIGN}']"], of_the_run=True)
    refuse_untrusted(run_of(store), [], of_the_run=True)


@pytest.mark.parametrize("of_the_run", [True, False])
def test_functions_in_overrides_are_refused_whoever_names_the_workflow(store: Store, of_the_run: bool) -> None:
    write_overrides(store, {("reconstruct", "7"): {"methods": [FOREIGN]}})
    with pytest.raises(RunError, match=FOREIGN):
        refuse_untrusted(run_of(store), ["surface.cell_m=1"], of_the_run=of_the_run)


def test_overrides_that_are_removed_first_are_no_matter(store: Store) -> None:
    write_overrides(store, {("reconstruct", "7"): {"methods": [FOREIGN]}})
    refuse_untrusted(run_of(store), [], of_the_run=True, cleared={("reconstruct", "7")})
    with pytest.raises(RunError, match=FOREIGN):
        refuse_untrusted(run_of(store), [], of_the_run=True, cleared={("reconstruct", "8")})


@pytest.mark.parametrize("data", [b"{", b"[]", b"[" * 100_000])
def test_overrides_that_are_none_are_named(store: Store, data: bytes) -> None:
    store.write_bytes("overrides/reconstruct/7.json", data)
    with pytest.raises(RunError, match=r"overrides/reconstruct/7\.json"):
        read_overrides(store)


def test_the_server_follows_no_link_out_of_the_run(tmp_path: Path) -> None:
    (tmp_path / "secret.json").write_text("secret")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder/secret.json").write_text("secret")
    view = tmp_path / "run/view"
    view.mkdir(parents=True)
    (view / "own.json").write_text("own")
    (view / "link.json").symlink_to(tmp_path / "secret.json")
    (view / "within.json").symlink_to(view / "own.json")
    (tmp_path / "run/products").symlink_to(tmp_path / "folder")
    (tmp_path / "a link to the run").symlink_to(tmp_path / "run")
    for root in (tmp_path / "run", tmp_path / "a link to the run"):
        read = reader(Store.open(root))
        assert read("view/own.json") == read("view/within.json") == b"own"
        assert read("view/link.json") is None
        assert read("products/secret.json") is None
    assert not is_inside(str(tmp_path / "run"), "../run2/x")


@pytest.mark.parametrize("area", ["", "POLYGON ((0 0, 1", 7, "nothing"])
def test_a_run_whose_area_is_none_is_named(tmp_path: Path, area: object) -> None:
    """Found by benchmarks/fuzz_inputs.py."""
    city = make_city(tmp_path / "town")
    tree = {"workflow": {"name": "a"}, "catalog": str(city.catalog), "area": area}
    (tmp_path / "run.json").write_text(json.dumps(tree))
    with pytest.raises(RunError, match=r"run\.json is damaged"):
        open_run(str(tmp_path))

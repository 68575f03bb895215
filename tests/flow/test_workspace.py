from __future__ import annotations

from hashlib import sha256
from pathlib import Path

from cityflow.core.unit_status import Status
from cityflow.flow.store import Store
from cityflow.flow.workspace import Workspace
from flow.toy_stages import toy


def test_outputs_lie_under_the_digest_and_are_collected(store: Store, tmp_path: Path) -> None:
    task = toy("unit/1")
    workspace = Workspace(store, task)
    (tmp_path / "file").write_bytes(b"from a file")
    workspace.write("roof.bin", b"roof")
    workspace.write_file("mesh.obj", tmp_path / "file")
    workspace.publish("products/a.txt", b"product")
    workspace.publish_file("products/b.txt", tmp_path / "file")
    store.write_bytes("surface.zarr/dsm/c/0/0", b"compressed")
    workspace.note("surface.zarr/dsm/c/0/0", "f" * 64)
    folder = f"work/toy/unit%2F1/{task.digest[:16]}"
    outcome = workspace.outcome(Status.DEGRADED, "reason", {"n": 1})
    assert dict(outcome.outputs) == {
        f"{folder}/mesh.obj": sha256(b"from a file").hexdigest(),
        f"{folder}/roof.bin": sha256(b"roof").hexdigest(),
        "products/a.txt": sha256(b"product").hexdigest(),
        "products/b.txt": sha256(b"from a file").hexdigest(),
        "surface.zarr/dsm/c/0/0": "f" * 64,
    }
    assert list(outcome.outputs) == sorted(outcome.outputs)
    assert {path: store.size(path) for path in outcome.outputs} == outcome.sizes
    assert outcome.sums == {"surface.zarr/dsm/c/0/0": sha256(b"compressed").hexdigest()}
    assert (outcome.status, outcome.reason, outcome.result) == (Status.DEGRADED, "reason", {"n": 1})
    assert workspace.read(workspace.path("roof.bin")) == b"roof"


def test_other_inputs_write_elsewhere(store: Store) -> None:
    one = Workspace(store, toy("u", inputs={"a": "1"}))
    other = Workspace(store, toy("u", inputs={"a": "2"}))
    same = Workspace(store, toy("u", inputs={"a": "1"}, arguments={"where": "moved"}))
    assert one.path("x") != other.path("x")
    assert one.path("x") == same.path("x")

from __future__ import annotations

import hashlib
import os
import pickle
import subprocess
import sys
import uuid
from pathlib import Path

import numpy as np
import pytest

from cityflow.errors import RunError
from cityflow.flow.store import Store


@pytest.fixture(params=["local", "memory", "s3"])
def any_store(request: pytest.FixtureRequest, tmp_path: Path) -> Store:
    if request.param == "local":
        return Store.open(tmp_path / "a folder" / "run")
    if request.param == "memory":
        return Store.open(f"memory://{uuid.uuid4().hex}")
    return Store.open(request.getfixturevalue("s3_url") + "/some/run/")


def test_what_is_written_is_read_found_and_removed(any_store: Store) -> None:
    names = ["b/2.txt", "a/1.txt", "a/deep/er/0.bin", "ab/3.txt"]
    for name in names:
        any_store.write_bytes(name, name.encode())
    assert any_store.find("") == sorted(names)
    assert any_store.find("a") == ["a/1.txt", "a/deep/er/0.bin"], "a prefix is a folder, not a beginning of names"
    assert any_store.folders("") == ["a", "ab", "b"]
    assert any_store.read_bytes("a/deep/er/0.bin") == b"a/deep/er/0.bin"
    assert list(any_store.read_many(names)) == [(name, name.encode()) for name in names]
    any_store.remove("a")
    assert any_store.find("") == ["ab/3.txt", "b/2.txt"]
    assert not any_store.exists("a/1.txt")
    any_store.remove("never/was")
    assert any_store.find("never") == []
    assert any_store.folders("never") == []


def test_overwriting_replaces_and_a_second_store_sees_it(any_store: Store) -> None:
    other = pickle.loads(pickle.dumps(any_store))
    any_store.write_bytes("x", b"long contents")
    assert other.read_bytes("x") == b"long contents"
    any_store.write_bytes("x", b"short")
    any_store.write_bytes("y", b"")
    assert other.read_bytes("x") == b"short"
    assert other.find("") == ["x", "y"]


def test_names_with_percent_and_colon_survive(any_store: Store) -> None:
    name = "records/a%3Ab/NL.IMBAG%3A05 é/0001.json"
    any_store.write_bytes(name, b"1")
    assert any_store.find("records") == [name]
    assert list(any_store.read_many([name])) == [(name, b"1")]


def test_a_missing_file_is_file_not_found(any_store: Store) -> None:
    with pytest.raises(FileNotFoundError):
        any_store.read_bytes("nothing/here")
    with pytest.raises(FileNotFoundError), any_store.local_copy("nothing/here"):
        pass


def test_files_go_in_and_out_with_their_digest(any_store: Store, tmp_path: Path) -> None:
    data = os.urandom(3_000_000)
    (tmp_path / "big.laz").write_bytes(data)
    assert any_store.put_file(tmp_path / "big.laz", "pieces/big.laz") == hashlib.sha256(data).hexdigest()
    with any_store.local_copy("pieces/big.laz") as path:
        assert path.suffix == ".laz"
        assert path.read_bytes() == data
    assert path.exists() == any_store.is_local, "a download ends with its block"


@pytest.mark.parametrize("any_store", ["local", "s3"], indirect=True)
def test_zarr_and_xarray_take_the_store(any_store: Store) -> None:
    import xarray as xr
    import zarr

    values = np.arange(200.0).reshape(10, 20)
    array = zarr.create_array(any_store.zarr_store("surface.zarr/dsm"), shape=(10, 20), chunks=(5, 5), dtype="f8")
    array[:] = values
    assert any_store.exists("surface.zarr/dsm/c/1/3")
    again = zarr.open_array(any_store.zarr_store("surface.zarr/dsm"), mode="r")
    np.testing.assert_array_equal(again[5:, 10:], values[5:, 10:])
    xr.Dataset({"dtm": (("y", "x"), values)}).to_zarr(any_store.zarr_store("x.zarr"), zarr_format=3)
    with xr.open_zarr(any_store.zarr_store("x.zarr")) as dataset:
        np.testing.assert_array_equal(dataset.dtm.values, values)


def test_a_writable_store_is_left_as_it_was(any_store: Store, tmp_path: Path) -> None:
    any_store.check_writable()
    assert any_store.find("") == []
    if any_store.is_local:
        assert list(tmp_path.iterdir()) == [], "folders that the check made are gone"


def test_local_readers_never_see_half_a_file(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.write_bytes("product", b"old")

    def dies(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", dies)
    with pytest.raises(KeyboardInterrupt):
        store.write_bytes("product", b"new")
    assert store.read_bytes("product") == b"old"
    assert os.listdir(store.root) == ["product"], "no leftovers"


def test_new_files_have_ordinary_permissions(store: Store) -> None:
    store.write_bytes("a", b"")
    plain = Path(store.root) / "plain"
    plain.write_bytes(b"")
    assert (Path(store.root) / "a").stat().st_mode == plain.stat().st_mode


@pytest.mark.parametrize("root", ["/proc/1/run", "/dev/null/run"])
def test_an_unwritable_folder_is_refused_with_a_remedy(root: str) -> None:
    with pytest.raises(RunError, match="cannot write") as caught:
        Store.open(root).check_writable()
    assert caught.value.where == root
    assert "--out" in caught.value.remedy


def test_an_unwritable_bucket_is_refused(s3_url: str) -> None:
    with pytest.raises(RunError, match="cannot write"):
        Store.open(f"{s3_url}-does-not-exist/run").check_writable()


def test_an_unknown_protocol_is_named() -> None:
    with pytest.raises(RunError, match="unknown protocol"):
        Store.open("nonsense://x")


def test_a_missing_package_is_named_with_its_extra() -> None:
    script = "import sys; sys.modules['s3fs'] = None; from cityflow.flow.store import Store; Store.open('s3://b/run')"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False)
    assert 'RunError: s3: s3:// needs a package that is not installed → pip install "cityflow[s3]"' in done.stderr


@pytest.mark.parametrize("path", ["/etc/passwd", "../x", "a/../../x"])
def test_paths_outside_the_run_are_refused(store: Store, path: str) -> None:
    with pytest.raises(ValueError, match="relative"):
        store.read_bytes(path)


def test_a_store_never_removes_itself(store: Store) -> None:
    with pytest.raises(ValueError, match="own root"):
        store.remove("")


def test_urls_and_paths_name_the_same_folder(tmp_path: Path) -> None:
    assert Store.open(f"file://{tmp_path}/r") == Store.open(tmp_path / "r") == Store.open(f"{tmp_path}/x/../r/")

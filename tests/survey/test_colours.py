"""Images as sources of colour: what is known of them is kept until a record of one comes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from cityflow.core.building import Status
from cityflow.flow.damage import DamagedFileError
from cityflow.flow.store import Store
from cityflow.flow.task import Record, digest_of
from cityflow.handover.colour_images import ColourRows, ImageText
from cityflow.survey.colours import TileImages
from cityflow.survey.results import Results


@dataclass(eq=False)
class Survey:
    """What `TileImages` asks of one."""

    results: Results = field(default_factory=Results)

    @property
    def images(self) -> Survey:
        return self

    def shown(self, name: str) -> ImageText:
        return ImageText("{}", f"view of {name}", f'"{name}":"view of {name}"')


def ingested(name: str, digest: str, status: Status = Status.DONE) -> Record:
    outputs = {f"work/ingest/{name}/{digest}/image.tif": digest} if status is Status.DONE else {}
    return Record("ingest", name, 1, "", 1, status, "", outputs, {"digest": digest}, {}, {})


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store.open(tmp_path)


def test_what_could_not_be_read_is_told_and_a_new_record_counts_at_once() -> None:
    survey: Any = Survey()
    survey.results.learn(ingested("a", "1"))
    survey.results.learn(ingested("b", "2", Status.FAILED))
    images = TileImages(survey, ["a", "b"], ["a", "b"])
    found = images.colours(["a", "b"])
    assert (found.rows.rows, found.unread) == ((0,), ("b",))
    assert found.digest == digest_of({"a": "1", "b": "unread"})
    assert found.views_digest == digest_of({"a": "view of a"})
    assert images.colours(["a", "b"]) == found
    survey.results.learn(ingested("b", "3"))
    later = images.colours(["a", "b"])
    assert (later.rows.rows, later.unread) == ((0, 1), ())
    assert later.digest == digest_of({"a": "1", "b": "3"})
    assert images.colours(["a"]).digest == digest_of({"a": "1"})


def test_tasks_over_a_tile_share_a_table_of_its_images(store: Store) -> None:
    """Those that could not be read have no row; a file that is not as its row says is damaged, however the task came to know of it."""
    survey: Any = Survey()
    texts = {"a": "A", "b": "B", "c": "C"}
    for name, text in texts.items():
        store.write_bytes(f"work/ingest/{name}/1/image.tif", text.encode())
        written = {f"work/ingest/{name}/1/image.tif": len(text)}
        survey.results.learn(replace(ingested(name, "1", Status.FAILED if name == "b" else Status.DONE), sizes=written))
    images = TileImages(survey, ["a", "b", "c", "d"], ["a", "b", "c"])
    rows = images.colours(["c"]).rows
    assert images.colours(["a", "b", "c"]).rows == ColourRows(rows.views, rows.files, (0, 1))
    for path, text in images.colours(["c"]).shared.items():
        store.write_bytes(path, text.encode())
    found, expecting = rows.inputs(reader := store.expecting({}))
    assert found.pixels == {"c": "work/ingest/c/1/image.tif"}
    with expecting.local_copy(found.pixels["c"]) as file:
        assert file.read_bytes() == b"C"
    store.write_bytes(found.pixels["c"], b"longer")
    with pytest.raises(DamagedFileError), expecting.local_copy(found.pixels["c"]):
        pass
    assert reader.expected is not None
    assert list(reader.expected.found) == [found.pixels["c"]]
    survey.results.learn(replace(ingested("b", "2"), sizes={"work/ingest/b/2/image.tif": 1}))
    assert images.colours(["b"]).rows.rows == (1,)


def test_models_around_are_one_digest() -> None:
    results = Results()
    hull = Record(
        "reconstruct", "u", 1, "", 1, Status.DONE, "", {"work/reconstruct/u/1/hull.city.jsonl": "1"}, {}, {}, {}
    )
    results.learn(hull)
    paths, digest = results.hulls(["u", "v"])
    assert paths == {"u": "work/reconstruct/u/1/hull.city.jsonl"}
    results.learn(replace(hull, unit="v", status=Status.FAILED, reason="why", outputs={}))
    failed = results.hulls(["u", "v"])
    assert (failed[0], failed[1] == digest) == (paths, False)
    results.learn(replace(hull, outputs={"work/reconstruct/u/1/hull.city.jsonl": "2"}))
    assert results.hulls(["u", "v"])[1] not in (digest, failed[1])
    assert results.hulls(["u"])[1] != results.hulls(["v"])[1]

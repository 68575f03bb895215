"""Images as sources of colour: what is known of them is kept until a record of one comes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cityflow.core.building import Status
from cityflow.flow.task import Record, digest_of
from cityflow.handover.colour_images import ImageText
from cityflow.survey.colours import colours_of
from cityflow.survey.results import Results


@dataclass(eq=False)
class Survey:
    """What `colours_of` asks of one."""

    results: Results = field(default_factory=Results)

    @property
    def images(self) -> Survey:
        return self

    def shown(self, name: str) -> ImageText:
        return ImageText("", f"view of {name}", f'"{name}":"view of {name}"')


def ingested(name: str, digest: str, status: Status = Status.DONE) -> Record:
    outputs = {f"work/ingest/{name}/{digest}/image.tif": digest} if status is Status.DONE else {}
    return Record("ingest", name, 1, "", 1, status, "", outputs, {"digest": digest}, {}, {})


def test_what_could_not_be_read_is_told_and_a_new_record_counts_at_once() -> None:
    survey: Any = Survey()
    survey.results.learn(ingested("a", "1"))
    survey.results.learn(ingested("b", "2", Status.FAILED))
    found = colours_of(survey, ["a", "b"])
    assert (found.pixels, found.unread) == ({"a": "work/ingest/a/1/image.tif"}, ("b",))
    assert found.digest == digest_of({"a": "1", "b": "unread"})
    assert found.views_digest == digest_of({"a": "view of a"})
    assert colours_of(survey, ["a", "b"]) == found
    survey.results.learn(ingested("b", "3"))
    later = colours_of(survey, ["a", "b"])
    assert (list(later.pixels), later.unread) == (["a", "b"], ())
    assert later.digest == digest_of({"a": "1", "b": "3"})
    assert colours_of(survey, ["a"]).digest == digest_of({"a": "1"})

"""``cityflow desk``: a run in the browser, with its review list, edits, notes and reruns beside the view."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import cached_property
from http import HTTPStatus
from pathlib import Path
from typing import Any

import shapely

from cityflow.core.json_values import finite
from cityflow.errors import CityflowError, RunError
from cityflow.flow.driver_note import read_note
from cityflow.flow.exclusive import is_held
from cityflow.flow.ledger import Ledger
from cityflow.flow.store import Store
from cityflow.io.tables.edits_gpkg import LAYERS, ROOFS
from cityflow.io.tables.edits_written import Edit, EditsFile
from cityflow.reconstruction.choose import MODULES
from cityflow.reporting.desk_list import DeskList
from cityflow.reporting.view_kept import json_bytes
from cityflow.runs.desk_notes import KINDS, LONGEST_NOTE, NOTE, Line, add_line, noted
from cityflow.runs.edits_file import edits_href
from cityflow.runs.prepare import Prepared
from cityflow.runs.run_folder import open_run
from cityflow.survey.survey import Survey
from cityflow.viewer.desk_server import Answer, Refusal
from cityflow.workflow.desk_compare import Others
from cityflow.workflow.desk_listeners import Listeners
from cityflow.workflow.desk_models import NewModels
from cityflow.workflow.desk_pictures import Pictures
from cityflow.workflow.desk_places import Places, rings_of, shape_of
from cityflow.workflow.desk_rerun import Job, Jobs, Stand
from cityflow.workflow.desk_warm import Warm
from cityflow.workflow.desk_watch import Watch, tiles_of, told_of

MOST_UNITS = 2000

Json = Any


@dataclass
class RunDesk:
    """The desk of one RUN; see `viewer.desk_server.Desk`.

    Attributes
    ----------
    who : whoever started it
    options : of every `cityflow rerun`
    refresh : brings the files of the view up to date
    other : address of a run that this one is compared with; empty: none
    """

    url: str
    who: str
    options: Sequence[str]
    refresh: Callable[[], None]
    is_open: bool = False
    other: str = ""
    token: str = field(default_factory=lambda: secrets.token_urlsafe(24))
    pending: dict[str, Edit] = field(default_factory=dict)
    """Edits, and those that were taken back, which no rerun has carried out."""

    def __post_init__(self) -> None:
        self.run: Prepared = open_run(self.url)
        self.store: Store = self.run.store
        self.list = DeskList(self.store)
        self.others = Others(lambda: self.run, self.list, self.other)
        self.listeners = Listeners()
        self._lock = threading.RLock()
        self._carried: dict[str, Edit] = {}
        self.warm = Warm(self.url, self.options)
        models = NewModels(lambda: self.run, lambda: self._survey, self.list, lambda m: self.listeners.tell("models", m))  # fmt: skip
        self.jobs = Jobs(
            self.store, self.warm.begin, lambda job: self.listeners.tell("job", job.as_json()), self._ended, self._shown, models.ended
        )  # fmt: skip
        self.watch = Watch(
            self.store, self._asked_tiles(), lambda news: self.listeners.tell("watch", news), self._driver_ended, lambda: bool(self.listeners.queues)
        )  # fmt: skip

    def start(self) -> None:
        self.warm.is_open = True
        self.jobs.start()
        self.watch.start()

    def close(self) -> None:
        self.watch.close()
        self.jobs.close()
        self.warm.close()

    def events(self) -> Iterator[tuple[str, Json] | None]:
        if not self._refused() and not is_held(self.store):
            self.warm.prepare_soon()
        return self.listeners.listen()

    def read(self, name: str, query: Mapping[str, str]) -> Answer | None:
        if name == "photograph.jpg":
            return Answer(self._pictures(query).jpeg(query.get("image", "")), "jpg")
        answers: Mapping[str, Callable[[Mapping[str, str]], Json]] = {
            "state": self._state, "review": lambda _: self.list.rows(), "outline": self._outline, "standing": self._standing,
            "photographs": lambda q: self._pictures(q).names(), "photograph": lambda q: self._pictures(q).about(q.get("image", "")),
            **self.others.answers(),
        }  # fmt: skip
        return Answer(json_bytes(finite(answers[name](query)))) if name in answers else None

    def change(self, name: str, body: Mapping[str, Json]) -> Json | None:
        changes: Mapping[str, Callable[[Mapping[str, Json]], Json]] = {
            "edit": self._edit, "undo": self._undo, "note": self._note, "rerun": self._rerun, "withdraw": self._withdraw,
        }  # fmt: skip
        if name not in changes:
            return None
        try:
            return changes[name](body)
        except (KeyError, TypeError, ValueError, IndexError, shapely.errors.ShapelyError) as error:
            raise Refusal(
                HTTPStatus.BAD_REQUEST, f"the request cannot be read ({type(error).__name__}: {error})"
            ) from error

    def _state(self, _: Mapping[str, str]) -> Json:
        notes = {
            unit: {"notes": [asdict(n) for n in of.notes], "seen": of.seen and asdict(of.seen)}
            for unit, of in noted(self.store).items()
        }
        return {
            "who": self.who, "roofs": list(ROOFS), "methods": list(MODULES), "notes": notes, "edits": self._edits(),
            "pending": len(self.pending), "jobs": [job.as_json() for job in self.jobs.jobs], "refused": self._refused(),
        }  # fmt: skip

    def _edits(self) -> Json:
        if self._refused():
            return []
        return [
            {"edit": e.name, "layer": e.layer, "value": e.value, "who": e.who, "when": e.when, "is_pending": e.name in self.pending,
             "rings": rings_of(e.shape)}
            for e in self._file().edits()
        ]  # fmt: skip

    def _outline(self, query: Mapping[str, str]) -> Json:
        row, polygon = self._polygon(query)
        return {"unit": row["id"], "rings": rings_of(polygon)}

    def _polygon(self, query: Mapping[str, str]) -> tuple[dict[str, Json], shapely.Polygon]:
        """Row and outline of the building that a request names."""
        unit = query.get("unit", "")
        row = self.list.row(unit)
        if row is None:
            raise RunError(f"no building {unit!r}", where=self.store.root, remedy="choose one of the list")
        with self._places() as places:
            return row, places.polygon(unit, row["tile"])

    def _pictures(self, query: Mapping[str, str]) -> Pictures:
        row, polygon = self._polygon(query)
        return Pictures(self.run, self._survey, row["id"], row["tile"], polygon)

    @cached_property
    def _survey(self) -> Survey:
        return self.run.source().survey

    def _standing(self, _: Mapping[str, str]) -> Json:
        return {"driver": told_of(self.store, read_note(self.store)), "tiles": tiles_of(self.store, self.watch.asked)}

    def _edit(self, body: Mapping[str, Json]) -> Json:
        layer = str(body["layer"])
        if layer not in LAYERS:
            raise Refusal(HTTPStatus.BAD_REQUEST, f"edits know no layer {layer!r}")
        shape = shape_of(layer, body["rings"])
        edit = Edit(
            secrets.token_hex(8), layer, shape, str(body.get("value", "")), self._name_of(body), round(time.time(), 3)
        )
        replaces = str(body.get("replaces", ""))
        with self._lock:
            former = next((e for e in self._file().edits() if e.name == replaces), None) if replaces else None
            written = self._file().add(edit, replaces)
            self.pending[written.name] = written
            if former is not None:
                self.pending[f"{former.name} before"] = former
        self.warm.prepare()
        return self._changed({"edit": written.name})

    def _undo(self, body: Mapping[str, Json]) -> Json:
        name = str(body["edit"])
        with self._lock:
            removed = self._file().remove(name)
            if self.pending.pop(name, None) is None:
                self.pending[f"{name} undone"] = removed
        return self._changed({"edit": name})

    def _note(self, body: Mapping[str, Json]) -> Json:
        unit, kind, text = str(body["unit"]), str(body["kind"]), str(body.get("text", "")).strip()[:LONGEST_NOTE]
        row = self.list.row(unit)
        if kind not in KINDS or row is None or (kind == NOTE and not text):
            raise Refusal(HTTPStatus.BAD_REQUEST, "a note is of a building, and says something")
        self._refuse_remote()
        add_line(self.store, Line(unit, kind, self._name_of(body), round(time.time(), 3), row["model"], text))
        return self._changed({"unit": unit})

    def _rerun(self, body: Mapping[str, Json]) -> Json:
        """Make buildings again, by one method alone where it is named, and carry out all edits that wait."""
        chosen, method = [str(u) for u in body.get("units", [])], str(body.get("method", ""))
        known = {row["id"] for row in self.list.rows()}
        if len(chosen) > MOST_UNITS or not known.issuperset(chosen):
            raise Refusal(HTTPStatus.BAD_REQUEST, f"at most {MOST_UNITS:,} buildings of this run")
        if method and method not in MODULES:
            raise Refusal(HTTPStatus.BAD_REQUEST, f"no method {method!r}; known: {', '.join(MODULES)}")
        settings = (
            [f"--set=reconstruct.methods={method}"] if method else ["--clear-overrides"] if body.get("clear") else []
        )
        with self._lock:
            edits, names = list(self.pending.values()), frozenset(self.pending)
            with self._places() as places:
                commands = places.commands(edits, chosen, settings)
            if not commands:
                raise Refusal(HTTPStatus.CONFLICT, "nothing to run again: no building is chosen, and no edit waits")
            what = ", ".join(p for p in (_counted(len(edits), "edit"), _counted(len(chosen), "building"), method) if p)
            self._carried |= self.pending
            self.pending.clear()
        return self.jobs.ask(what, self._name_of(body), commands, chosen, names).as_json()

    def _withdraw(self, body: Mapping[str, Json]) -> Json:
        job = self.jobs.withdraw(int(body["job"]))
        if job is None:
            raise Refusal(HTTPStatus.CONFLICT, "it has begun, or has ended")
        return job.as_json()

    def _ended(self, job: Job) -> None:
        """After a job the view shows what it made; edits of one that failed wait again."""
        with self._lock:
            carried = {n: e for n in job.edits if (e := self._carried.pop(n, None)) is not None}
            if job.stand is not Stand.DONE:
                self.pending = {**carried, **self.pending}
        if job.stand is not Stand.WITHDRAWN:
            self._refreshed()
            self.warm.prepare()

    def _driver_ended(self) -> None:
        """The view of what another driver has made is written here; a rerun from here writes it itself."""
        if not self.jobs.is_at_work:
            self._refreshed()

    def _shown(self) -> None:
        self.warm.prepare()  # while the report is written
        self.others.forget()
        self.listeners.tell("changed", {})

    def _refreshed(self) -> None:
        try:
            self.run = open_run(self.url)
            self.others.forget()
            self.refresh()
        except Exception as error:  # noqa: BLE001 - whatever it is, the desk goes on, and people are told
            self.listeners.tell("trouble", {"text": f"The view is as before ({type(error).__name__}: {error})"})
        self.listeners.tell("changed", {})

    def _changed(self, value: Json) -> Json:
        self.listeners.tell("state", {})
        return value

    def _file(self) -> EditsFile:
        self._refuse_remote()
        href = edits_href(self.run.workflow.city, self.store) or self.store.url("edits.gpkg")
        return EditsFile(Path(href), self.run.catalog.reference)

    def _refused(self) -> str:
        """Why nothing can be written; empty where it can."""
        if not self.store.is_local or "://" in self.run.workflow.city.edits.path:
            return "edits and notes need a RUN, and a file of edits, in a local folder"
        return ""

    def _refuse_remote(self) -> None:
        if why := self._refused():
            raise RunError(
                why, where=self.store.root, remedy="copy the RUN, or write the edits in QGIS (docs/edits.md)"
            )

    def _name_of(self, body: Mapping[str, Json]) -> str:
        return str(body.get("who") or self.who)[:80]

    def _asked_tiles(self) -> frozenset[str]:
        try:
            return frozenset(self.run.source().city.tiles)
        except (CityflowError, OSError):
            return frozenset()  # what has records is shown

    @contextmanager
    def _places(self) -> Iterator[Places]:
        with Ledger.open(self.store) as ledger:
            yield Places(self.run, ledger)


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}" if number else ""

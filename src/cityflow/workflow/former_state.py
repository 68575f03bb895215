"""What an update keeps of a RUN, so that it can be compared afterwards, however often either of them is interrupted.

``updates/N/former/TILE.ndjson`` holds the buildings, and ``updates/N/update.json``, written after them and before the RUN changes, says what is updated
from which catalog to which, and how it ended. The next update goes on with the same former state, unless this one is done, or its failures are healed.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from enum import StrEnum

from cityflow.core.credentials import without_credentials
from cityflow.errors import RunError
from cityflow.flow.store import Store
from cityflow.flow.task import digest_of
from cityflow.handover.epoch_rows import EpochRow, decode_epoch, encode_epoch
from cityflow.io.catalog.stac_assets import Catalog
from cityflow.reporting.change_report import UPDATES, FormerState
from cityflow.reporting.epoch import epoch_rows, unlisted_tiles
from cityflow.runs.current import CurrentRecords
from cityflow.runs.prepare import Prepared


class State(StrEnum):
    """How far an update has come."""

    BEGUN = "begun"
    FAILED = "ended with failures"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class Update:
    """One update of a RUN.

    Attributes
    ----------
    number : counts from 1
    former, catalog : addresses of the catalogs before and after;  former_data, data : digests of what they name
    former_title, former_date : of the survey before
    former_unlisted : ground tiles whose buildings were not known before, since tasks had failed
    state : FAILED and DONE: all has run, and the comparison is written
    """

    number: int
    former: str
    former_data: str
    catalog: str
    data: str
    former_title: str
    former_date: str
    former_unlisted: tuple[str, ...] = ()
    state: State = State.BEGUN

    @property
    def folder(self) -> str:
        """Where all of it lies."""
        return f"{UPDATES}/{self.number}"


def last_update(store: Store) -> Update | None:
    """The newest one; None where there was none yet.

    Raises
    ------
    RunError
        Its note is damaged.
    """
    numbers = update_numbers(store)
    return read_update(store, numbers[-1]) if numbers else None


def update_numbers(store: Store) -> list[int]:
    """Of all updates of a RUN, the first one first."""
    return sorted(int(n) for n in store.folders(UPDATES) if n.isdecimal() and store.exists(_note(int(n))))


def read_update(store: Store, number: int) -> Update:
    """One of them. Raises RunError where its note is damaged."""
    path = _note(number)
    try:
        tree = json.loads(store.read_bytes(path))
        if "done" in tree:  # as version 1 wrote it
            tree["state"] = State.DONE if tree.pop("done") else State.BEGUN
        unlisted, state = tuple(tree.pop("former_unlisted", ())), State(tree.pop("state"))
        return Update(**tree, former_unlisted=unlisted, state=state)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        remedy = "remove its folder: the next update compares with what is there now"
        raise RunError(f"{path} is damaged: {error}", where=store.root, remedy=remedy) from error


def begin_update(run: Prepared, records: CurrentRecords, new: Prepared, *, is_whole: bool) -> Update:
    """Keep the former state of `run` for an update to `new`.

    An unfinished update goes on with the state that it has kept, and one to the same data is done again. One that ended with failures
    is finished as soon as these are healed.

    Parameters
    ----------
    is_whole : no file, tile or export of the RUN has failed
    """
    store, last = run.store, last_update(run.store)
    catalog, digest, now = without_credentials(new.catalog.href), data_of(new.catalog), data_of(run.catalog)
    over = last is not None and (last.state is State.DONE or (last.state is State.FAILED and is_whole))
    begun = last is not None and not over and not now == last.former_data != last.data
    if last is not None and (begun or (over and last.data == digest)):
        return note_update(store, replace(last, catalog=catalog, data=digest, state=State.BEGUN))
    number = 1 if last is None else last.number + over
    former = without_credentials(run.catalog.href)
    unlisted = tuple(sorted(unlisted_tiles(run, records)))
    date = run.source().survey.date
    update = Update(number, former, now, catalog, digest, run.catalog.title, date, unlisted)
    store.remove(update.folder)  # an earlier one that died before the RUN changed
    for tile, rows in epoch_rows(run, records):
        store.write_bytes(f"{former_folder(update)}/{tile}.ndjson", encode_epoch(rows))
    return note_update(store, update)


def data_of(catalog: Catalog) -> str:
    """Digest of the contents of all files that a catalog names: it may be made again in its place."""
    outlines = [catalog.outlines.checksum] if catalog.outlines is not None else []
    surveyed = [a.checksum for a in catalog.lidar] + [a.checksum for a in catalog.images]
    rasters = [a.checksum for a in catalog.rasters.values()]
    return digest_of(sorted([*surveyed, *rasters, *outlines]))


def note_update(store: Store, update: Update) -> Update:
    """Write its note."""
    store.write_bytes(_note(update.number), (json.dumps(asdict(update), indent=1, ensure_ascii=False) + "\n").encode(), durable=True)  # fmt: skip
    return update


def former_state(store: Store, update: Update) -> FormerState:
    """The buildings before."""

    def rows() -> Iterator[EpochRow]:
        for _, data in store.read_many(store.find(former_folder(update))):
            yield from decode_epoch(data)

    return FormerState(rows, frozenset(update.former_unlisted))


def former_folder(update: Update) -> str:
    """Where the buildings before lie, a file for each ground tile."""
    return f"{update.folder}/former"


def _note(number: int) -> str:
    return f"{UPDATES}/{number}/update.json"

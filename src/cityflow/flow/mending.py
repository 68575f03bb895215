"""Damaged segments are taken apart: what can be read lies in files of its own again, what cannot runs again."""

from __future__ import annotations

from collections.abc import Sequence

from cityflow.flow.record_segments import FOLDER as SEGMENTS
from cityflow.flow.record_segments import LINES, checksum, lines_path, rebuilt, write_table
from cityflow.flow.records import FOLDER, STARTED, record_path
from cityflow.flow.segment_index import Joined
from cityflow.flow.store import Store


def mended(store: Store, joined: Joined) -> tuple[list[str], list[str]]:
    """Mend all segments that are not sound; killed midway, it is done again.

    Returns
    -------
    what was found and done, a line for each that was damaged, and the segments that are no more
    """
    told, gone = [], []
    for name in sorted({*joined.problems, *joined.unfinished}):
        files = [path for path in store.find(SEGMENTS) if path.startswith(f"{SEGMENTS}/{name}.")]
        tables = [path for path in files if not path.endswith(LINES)]
        problem = joined.problems.get(name)
        if _is_whole(store, name):
            _write_table_anew(store, name, tables)
            done = "its table is rebuilt from its records"
        else:
            kept = _take_apart(store, joined, name)
            store.remove_files([*tables, lines_path(name)])
            gone.append(name)
            done = f"{kept:,} records of it are files of their own again; the tasks of the others run again"
        if problem:
            told.append(f"{problem}: {done}")
    return told, gone


def _is_whole(store: Store, name: str) -> bool:
    try:
        return checksum(store.read_bytes(lines_path(name))) == name
    except FileNotFoundError:
        return False


def _write_table_anew(store: Store, name: str, tables: Sequence[str]) -> None:
    fresh = write_table(store, rebuilt(name, store.read_bytes(lines_path(name))))
    store.remove_files([path for path in tables if path != fresh])


def _take_apart(store: Store, joined: Joined, name: str) -> int:
    """Write the records that can be read, and marks where one cannot; how many records there were."""
    count = 0
    for record, text in joined.readable(name):
        path = record_path(record.stage, record.unit, record.attempt)
        if not store.exists(path):
            store.write_bytes(path, text)
        count += 1
    for (stage, folder), attempt in joined.lost_attempts.items():
        store.write_bytes(f"{FOLDER}/{stage}/{folder}/{attempt:04d}{STARTED}", b"")
    return count

"""Whether all that finished tasks have left is there: workers read the records of segments, and ask for the sizes of files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from distributed import Client

from cityflow.flow.ledger import Ledger
from cityflow.flow.outputs import Outputs
from cityflow.flow.record_segments import Piece, unpacked
from cityflow.flow.records import decode
from cityflow.flow.segment_files import SegmentFiles
from cityflow.flow.some_units import SomeUnits
from cityflow.flow.spread import Spread
from cityflow.flow.store import Store


def all_left_there(ledger: Ledger, tasks: Mapping[str, SomeUnits], client: Client) -> bool:
    """Whether the newest records of units by stage can be read, and their outputs have the sizes that they say.

    On an object store the folders are listed, which one process does for all.
    """
    loose, pieces = ledger.pieces(tasks)
    outputs = Outputs(ledger.store)
    records = ((row, ledger.latest(row.stage, row.unit)) for row in loose)
    if not all(
        record is not None and record.attempt == row.attempt and outputs.all_there(record) for row, record in records
    ):
        return False
    if not ledger.store.is_local:
        return all(_left_there(outputs, ledger.store, piece) for piece in pieces)
    answers = Spread.over(client).map(partial(left_there, ledger.store), pieces)
    return all(answer is True for _, answer in answers)


def left_there(store: Store, piece: Piece) -> bool:
    """The same of the records of one segment, on a worker."""
    return _left_there(Outputs(store), store, piece)


def _left_there(outputs: Outputs, store: Store, piece: Piece) -> bool:
    files = SegmentFiles(store)
    try:
        texts = [unpacked(files.piece(piece.name, f.offset, f.length), f) for f in piece.frames]
        return all(outputs.all_there(decode(texts[k][at : at + size])) for k, at, size in piece.places.tolist())
    except (ValueError, OSError):
        return False

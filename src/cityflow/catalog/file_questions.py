"""Reads files for a catalog: each in a task of its own, what was read of a file before not again."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from cityflow.catalog.kept_answers import KeptAnswers
from cityflow.errors import CatalogError, CityflowError
from cityflow.flow.spread import Answer, Spread
from cityflow.flow.typed import as_json, from_json

J = TypeVar("J")
R = TypeVar("R")
LONG_BYTES, LONG_FILES = 2e9, 500
"""From here on reading takes longer than a local cluster takes to start (3 s): at 500 MB a second, and at 5 ms a file."""
NAMED = 3


@dataclass(frozen=True, slots=True)
class Question(Generic[J, R]):
    """What is asked of every file.

    Attributes
    ----------
    name : what the jobs are, in the plural
    ask : of a job; runs on a worker
    key : of a job: differs where the answer may differ; empty where the answer is not kept
    pack, unpack : of an answer that is kept
    """

    name: str
    ask: Callable[[J], R]
    key: Callable[[J], str] = lambda _: ""
    pack: Callable[[R], bytes] = lambda _: b""
    unpack: Callable[[bytes], R] | None = None


def in_silence(what: str, done: int, total: int) -> None:
    """Tells nobody."""


@dataclass(frozen=True, slots=True)
class Reading:
    """Where files are read, what is kept of it, and who is told how far it is."""

    spread: Spread = field(default_factory=Spread)
    kept: KeptAnswers = field(default_factory=KeptAnswers)
    told: Callable[[str, int, int], None] = in_silence

    def answers(self, question: Question[J, R], jobs: Iterable[J], count: int, size: float = 0.0) -> list[Answer[R]]:
        """Answers in the order of the jobs; errors are answers, too.

        Parameters
        ----------
        jobs : made one by one, as they are needed
        count : their number;  size : bytes that they read
        """
        found: dict[int, Answer[R]] = {}
        asked: list[tuple[int, str]] = []
        is_long = size > LONG_BYTES or count > LONG_FILES
        for k, answer in self.spread.map(question.ask, self._unknown(question, jobs, found, asked), is_long=is_long):
            number, key = asked[k]
            found[number] = answer
            if key and not isinstance(answer, CityflowError | OSError):
                self.kept.put(key, question.pack(answer))
            self.told(question.name, len(found), count)
        self.kept.commit()
        return [found[k] for k in range(count)]

    def _unknown(
        self, question: Question[J, R], jobs: Iterable[J], found: dict[int, Answer[R]], asked: list[tuple[int, str]]
    ) -> Iterator[J]:
        """Jobs whose answer is not kept; those that are go to `found`."""
        for number, job in enumerate(jobs):
            key = question.key(job)
            known = self.kept.get(key) if key else None
            if known is not None and question.unpack is not None:
                found[number] = question.unpack(known)
                continue
            asked.append((number, key))
            yield job


def packed_as(kind: type[R]) -> tuple[Callable[[R], bytes], Callable[[bytes], R]]:
    """Pack and unpack dataclasses as JSON."""

    def pack(value: R) -> bytes:
        return json.dumps(as_json(value)).encode()

    def unpack(data: bytes) -> R:
        return from_json(kind, json.loads(data), "what was read before")

    return pack, unpack


def refuse_unreadable(answers: Sequence[Answer[R]], paths: Sequence[str]) -> list[R]:
    """The answers, where none is an error.

    Raises
    ------
    CatalogError
        One error for all files that cannot be read.
    """
    good, bad = [], []
    for answer, path in zip(answers, paths, strict=True):
        if isinstance(answer, CityflowError | OSError):
            bad.append(told_of(answer, path))
        else:
            good.append(answer)
    if not bad:
        return good
    if len(bad) == 1:
        raise bad[0]
    more = "; ".join(f"{error.where}: {error.problem}" for error in bad[1:NAMED])
    rest = f"; and {len(bad) - NAMED} more" if len(bad) > NAMED else ""
    problem = f"{bad[0].problem}; {more}{rest} ({len(bad)} of {len(paths)} files cannot be read)"
    raise CatalogError(problem, where=bad[0].where, remedy=bad[0].remedy)


def told_of(answer: object, path: str) -> CityflowError:
    """An answer that is an error, with the file that it is about."""
    if isinstance(answer, CityflowError):
        return answer if answer.where else CatalogError(answer.problem, where=path, remedy=answer.remedy)
    remedy = "check its permissions or address"
    return CatalogError(f"the file cannot be read ({answer})", where=path, remedy=remedy)

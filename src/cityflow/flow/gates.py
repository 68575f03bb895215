"""Gates: a key becomes free when all events that it waits for have happened."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable, Iterable
from typing import Generic, Protocol, TypeVar

K = TypeVar("K", bound=Hashable)
E = TypeVar("E", bound=Hashable)
E_contra = TypeVar("E_contra", bound=Hashable, contravariant=True)


class Happened(Protocol[E_contra]):
    """Events of the past."""

    def add(self, event: E_contra, /) -> None: ...

    def __contains__(self, event: E_contra, /) -> bool: ...


class Gates(Generic[K, E]):
    """Keys behind gates that events open, each key once; `happened` holds the events of the past.

    >>> gates: Gates[str, str] = Gates(set())
    >>> gates.wait("roof", ["walls", "beams"])
    False
    >>> gates.fire("walls"), gates.fire("beams")
    ([], ['roof'])
    >>> gates.wait("chimney", ["walls"])
    True
    """

    def __init__(self, happened: Happened[E]) -> None:
        self._happened = happened
        self._missing: dict[K, int] = {}
        self._behind: dict[E, list[K]] = defaultdict(list)

    def wait(self, key: K, events: Iterable[E]) -> bool:
        """True where nothing is left to wait for; otherwise `fire` hands the key out later."""
        left = [e for e in dict.fromkeys(events) if e not in self._happened]
        if left:
            self.wait_for(key, left)
        return not left

    def wait_for(self, key: K, left: Collection[E]) -> None:
        """The same for events, each named once, none of which has happened."""
        for event in left:
            self._behind[event].append(key)
        self._missing[key] = len(left)

    def fire(self, event: E) -> list[K]:
        """An event has happened: the keys that it sets free, in the order in which they began to wait."""
        self._happened.add(event)
        free = []
        for key in self._behind.pop(event, []):
            self._missing[key] -= 1
            if not self._missing[key]:
                del self._missing[key]
                free.append(key)
        return free

    def is_waiting(self, key: K) -> bool:
        return key in self._missing

    def __len__(self) -> int:
        """How many keys wait."""
        return len(self._missing)

    def waiting(self) -> tuple[K, ...]:
        return tuple(self._missing)

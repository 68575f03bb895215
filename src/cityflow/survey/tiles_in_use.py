"""Tiles whose units somebody may still ask for: a city has millions of units, and few tiles are in work at a time."""

from __future__ import annotations

from collections.abc import Iterable


class TilesInUse:
    """Tiles, each until all that may ask for its units have ended.

    >>> used = TilesInUse()
    >>> used.begin("1_2", ["1_2", "1_3"])
    >>> used.end("1_2"), used.end("1_3")
    ([], ['1_2'])
    """

    def __init__(self) -> None:
        self._left: dict[str, set[str]] = {}
        self._asked: dict[str, list[str]] = {}
        self._ended: set[str] = set()

    def begin(self, tile: str, asking: Iterable[str]) -> None:
        """The units of a tile are known; `asking`: tiles whose tasks may ask for them."""
        left = self._left.setdefault(tile, set())
        for each in asking:
            if each not in left and each not in self._ended:
                left.add(each)
                self._asked.setdefault(each, []).append(tile)

    def end(self, tile: str) -> list[str]:
        """A tile asks no more: those that nobody asks for since."""
        self._ended.add(tile)
        free = []
        for each in self._asked.pop(tile, ()):
            left = self._left.get(each, set())
            left.discard(tile)
            if not left and self._left.pop(each, None) is not None:
                free.append(each)
        return free

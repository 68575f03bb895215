"""Some units of a stage: named, or all but those named, whichever is shorter."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import cached_property


@dataclass(frozen=True)
class SomeUnits:
    """Units of one stage, of those that have a record.

    Attributes
    ----------
    names : sorted;  all_but : these are left out, all others are meant
    """

    names: tuple[str, ...] = ()
    all_but: bool = False

    @classmethod
    def only(cls, units: Iterable[str]) -> SomeUnits:
        return cls(tuple(sorted(units)))

    @classmethod
    def of(cls, units: Collection[str], known: Collection[str]) -> SomeUnits:
        """The shorter form; `known`: all that have a record, these among them.

        >>> SomeUnits.of(["a", "b", "d"], ["a", "b", "c", "d"])
        SomeUnits(names=('c',), all_but=True)
        """
        if 2 * len(units) <= len(known):
            return cls.only(units)
        meant = frozenset(units)
        return cls(tuple(sorted(u for u in known if u not in meant)), all_but=True)

    def __contains__(self, unit: object) -> bool:
        return (unit in self._named) != self.all_but

    def among(self, known: Iterable[str]) -> list[str]:
        """Those of the units that have a record which are meant."""
        return [unit for unit in known if unit in self]

    def changed(self, more: Collection[str] = (), less: Collection[str] = ()) -> SomeUnits:
        """With some more units, and without others.

        >>> SomeUnits(("c",), all_but=True).changed(["c", "d"], ["a"])
        SomeUnits(names=('a',), all_but=True)
        """
        gone, come = (more, less) if self.all_but else (less, more)
        return SomeUnits(tuple(sorted((self._named - frozenset(gone)) | frozenset(come))), self.all_but)

    @cached_property
    def _named(self) -> frozenset[str]:
        return frozenset(self.names)


ALL = SomeUnits(all_but=True)

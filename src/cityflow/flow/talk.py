"""Verbosity of a command."""

from __future__ import annotations

from enum import StrEnum

from cityflow.errors import RunError


class Talk(StrEnum):
    """Nothing but what went wrong; how far it is; every task that ends."""

    QUIET = "quiet"
    NORMAL = "normal"
    VERBOSE = "verbose"

    @classmethod
    def of(cls, is_quiet: bool, is_verbose: bool) -> Talk:
        """From the options of a command; both at once are a mistake."""
        if is_quiet and is_verbose:
            raise RunError(
                "--quiet and --verbose exclude each other", where="--quiet --verbose", remedy="leave one of them out"
            )
        return cls.QUIET if is_quiet else cls.VERBOSE if is_verbose else cls.NORMAL

"""What a command or a driver makes of an error: one line on stderr and the exit code."""

from __future__ import annotations

import sys
from collections.abc import Callable

from cityflow.core.credentials import without_credentials
from cityflow.errors import CityflowError
from cityflow.flow.unwritable import unwritable


def exit_code(command: Callable[[], object]) -> int:
    """Call it; errors that a user can fix become one line and 1, a full disk too; Ctrl-C becomes 130."""
    try:
        command()
    except CityflowError as error:
        return _printed(without_credentials(str(error)), 1)
    except OSError as error:
        refusal = unwritable(error)
        if refusal is None:
            raise
        return _printed(str(refusal), 1)
    except KeyboardInterrupt as error:
        return _printed(str(error) or "interrupted; a later run continues here", 130)
    return 0


def _printed(text: str, code: int) -> int:
    print(f"cityflow: {text}", file=sys.stderr)  # noqa: T201
    return code

"""Makes local stores read-only while the file that `READ_ONLY_WHILE` names is there, in every Python process that has this folder in PYTHONPATH."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from typing import Any


def refusing(write: Callable[..., Any]) -> Callable[..., Any]:
    """The same, that fails as on a file system that was mounted read-only."""

    def written(self: Any, *given: Any, **named: Any) -> Any:
        if os.path.exists(os.environ["READ_ONLY_WHILE"]):
            path = next((each for each in reversed(given) if isinstance(each, str)), "")
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), self.url(path))
        return write(self, *given, **named)

    return written


if "READ_ONLY_WHILE" in os.environ:
    from cityflow.flow.local_folder import LocalFolder

    for name in ("write_bytes", "put_file"):
        setattr(LocalFolder, name, refusing(getattr(LocalFolder, name)))

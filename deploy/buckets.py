"""Makes buckets of an object store where there are none: ``python deploy/buckets.py NAME…``; endpoint and keys are those of the environment."""

from __future__ import annotations

import sys
import time
from contextlib import suppress

import s3fs

TRIES = 30
"""The store may still be starting: about a minute."""


def make(names: list[str]) -> None:
    for tries_left in reversed(range(TRIES)):
        store = s3fs.S3FileSystem(skip_instance_cache=True)
        try:
            for name in names:
                with suppress(FileExistsError):
                    store.mkdir(name)
            missing = [name for name in names if not store.exists(name)]
            assert not missing, f"no bucket {missing[0]}"
            return
        except Exception:  # every fault of a store that starts has an exception of its own
            if not tries_left:
                raise
            time.sleep(2)


if __name__ == "__main__":
    make(sys.argv[1:])

"""Memory that the workers of a scheduler offer as a resource of Dask's, and what a task asks of it."""

# mypy: disable-error-code="no-untyped-call"
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from distributed import Client

from cityflow.flow.room import MB, RESOURCE


@dataclass(frozen=True, slots=True)
class Offers:
    """What the workers offer.

    Attributes
    ----------
    least_mb, most_mb : of a worker; 0 of one that does not say
    is_alone : every worker runs one task at a time
    """

    least_mb: float = 0.0
    most_mb: float = 0.0
    is_alone: bool = True

    def asked(self, need_mb: float, *, must: bool = False) -> float:
        """MB that a task asks the scheduler for; 0 where any worker will do, and where one does not say what it has, since it would get nothing to do.

        It never asks for more than there is: it would wait for ever.

        Parameters
        ----------
        must : a worker has turned out too small for the task; then it asks wherever any says what it has
        """
        if not (self.least_mb or must) or (self.is_alone and need_mb <= self.least_mb):
            return 0.0
        return min(need_mb, self.most_mb)


def offers_of(client: Client) -> Offers | None:
    """None while there is no worker."""
    workers: list[dict[str, Any]] = list(client.scheduler_info(n_workers=-1)["workers"].values())
    if not workers:
        return None
    offered = [float(w.get("resources", {}).get(RESOURCE, 0.0)) / MB for w in workers]
    return Offers(min(offered), max(offered), all(w["nthreads"] == 1 for w in workers))


def resources(asked_mb: float) -> dict[str, Any] | None:
    """What Dask's `submit` and `map` take."""
    return {RESOURCE: asked_mb * MB} if asked_mb else None

"""Where the edits of a RUN are: in the file that its workflow names, else in ``RUN/edits.gpkg``, which the desk writes."""

from __future__ import annotations

from cityflow.flow.store import Store
from cityflow.pipeline.workflow_parameters import CityParameters

OWN = "edits.gpkg"


def edits_href(city: CityParameters, store: Store) -> str:
    """Path or URL of the file of edits; empty where there is none."""
    return city.edits.path or (store.url(OWN) if store.exists(OWN) else "")


def with_own_edits(city: CityParameters, store: Store) -> CityParameters:
    """Parameters that name the RUN's own edits, where it has some and the workflow names no others."""
    href = edits_href(city, store)
    if href == city.edits.path:
        return city
    return city.model_copy(update={"edits": city.edits.model_copy(update={"path": href})})

"""What products say of their survey, and how they come to the globe: in the digests of those who write them."""

from __future__ import annotations

from functools import lru_cache

from cityflow.core.grid import Bounds
from cityflow.errors import CatalogError
from cityflow.flow.task import digest_of
from cityflow.flow.typed import as_json
from cityflow.handover.product_metadata import ProductMetadata
from cityflow.io.crs import resolve
from cityflow.io.globe import globe_of
from cityflow.survey.survey import Survey


def metadata_inputs(survey: Survey, metadata: ProductMetadata) -> dict[str, str]:
    """What a product says of its survey, and the way from its CRS to the globe, none of a local frame.

    PROJ chooses that way by the bounds of the survey: where these grow, it nearly always stays.
    """
    digest = _digest(survey.catalog.reference.code, survey.lattice.bounds)
    return {"said": digest_of(as_json(metadata)), **({"globe": digest} if digest else {})}


@lru_cache(maxsize=8)
def _digest(crs: str, bounds: Bounds) -> str:
    try:
        globe = globe_of(resolve(crs), bounds)
    except CatalogError as error:
        return digest_of(str(error))  # that of whoever goes there
    return "" if globe is None else digest_of([repr(globe.placing), globe.step_m])  # accuracies may be NaN

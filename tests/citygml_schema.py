"""The CityGML 2.0 schemas, out of the copies that citysmith ships."""

from __future__ import annotations

import io
from functools import cache
from importlib.resources import files
from pathlib import Path

from lxml import etree

MODULES = ("appearance", "building", "relief", "generics")


class _Shipped(etree.Resolver):
    """Schemas by their public address."""

    def resolve(self, system_url: str, public_id: str, context: object) -> object:  # type: ignore[override]
        address = system_url.split("://", 1)[-1]
        if not address.startswith(("schemas.opengis.net", "docs.oasis-open.org", "www.w3.org")):
            return None
        return self.resolve_filename(str(_folder() / address), context)  # type: ignore[attr-defined]


def _folder() -> Path:
    return Path(str(files("citysmith"))) / "data" / "schemas"


@cache
def citygml_schema() -> etree.XMLSchema:
    """A schema that knows the modules that exports use."""
    parser = etree.XMLParser(no_network=True)
    parser.resolvers.add(_Shipped())
    imports = "".join(
        f'<xs:import namespace="http://www.opengis.net/citygml/{name}/2.0" '
        f'schemaLocation="http://schemas.opengis.net/citygml/{name}/2.0/{name}.xsd"/>'
        for name in MODULES
    )
    text = f'<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema">{imports}</xs:schema>'
    return etree.XMLSchema(etree.parse(io.BytesIO(text.encode()), parser))

"""A file of the catalog, in the inputs of tasks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cityflow.errors import CatalogError
from cityflow.flow.typed import TaskInputs
from cityflow.io.catalog.stac import sha256_of


@dataclass(frozen=True, slots=True)
class SourceFile(TaskInputs):
    """Its address; bytes and SHA-256 as they were when the catalog was made."""

    href: str
    size: int
    checksum: str

    def refuse_other(self, path: Path) -> None:
        """Digests promise what is in the files: one that has changed since the catalog was made would break all of them. Raises CatalogError."""
        checksum, size = sha256_of(path)
        if checksum != self.checksum:
            raise CatalogError(
                f"the file has changed since the catalog was made ({size:,} bytes, then {self.size:,})",
                where=self.href,
                remedy="fetch it again, or make the catalog again if the new file is meant",
            )

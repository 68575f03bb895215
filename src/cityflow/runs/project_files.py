"""Workflows and catalogs that come with the project: in the present folder, in its sources, or in the installed package."""

from __future__ import annotations

from pathlib import Path

from cityflow.errors import WorkflowError

PACKAGE = Path(__file__).resolve().parents[1]
SHIPPED = PACKAGE / "shipped"
"""Where an installed package has them (`pyproject.toml`, force-include); sources have them beside `src`."""
PLACES = (Path(), PACKAGE.parents[1], SHIPPED)


def project_file(path: str) -> Path:
    """A workflow or catalog of this project, as in ``workflows/lidar_city.yaml`` or ``catalogs/delft``.

    Raises
    ------
    WorkflowError
        It is nowhere.
    """
    for folder in PLACES:
        if (folder / path).exists():
            return folder / path
    raise WorkflowError("no such file of the project", where=path, remedy="run this in the project's folder")


def named_workflow(path: Path) -> Path:
    """The file itself, or where there is none the project's workflow of that name, so that commands work in any folder."""
    if path.exists() or path.is_absolute() or path.parent.as_posix() != "workflows":
        return path
    return next((folder / path for folder in PLACES if (folder / path).is_file()), path)


def sample_catalog(name: str) -> Path:
    """Folder of a catalog that is shipped: ``delft`` (LiDAR and outlines, EPSG:7415) or ``boruszyn`` (28 photographs from a kite, EPSG:2180).

    Raises
    ------
    WorkflowError
        There is none of this name.
    """
    return project_file(f"catalogs/{name}")

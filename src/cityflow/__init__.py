"""From an oriented flight or a LiDAR survey to a valid LoD2 city model, on Dask.

All names below can be used in notebooks; each is loaded when it is first used, so that `import cityflow` takes no time (docs/python.md).
"""

__version__ = "0.1.0"

_PLACES = {
    "cityflow.api.finished_run": ("Run", "open_run"),
    "cityflow.api.from_images": ("match_images", "points_of_depths", "read_images", "texture_building", "windows_of"),
    "cityflow.api.from_points": (
        "building_from_points", "evidence_from_points", "outlines_from_points", "split_outline", "surface_from_points",
    ),
    "cityflow.api.converted": ("draw_buildings", "surface_dataset", "triangles_of", "write_cityjson"),
    "cityflow.core.building": ("Building", "Outline"),
    "cityflow.core.camera": ("Camera", "OrientedImage"),
    "cityflow.core.colour_image": ("ColourImage",),
    "cityflow.core.pixels": ("ArrayPixels",),
    "cityflow.core.points": ("PointCloud",),
    "cityflow.io.points.las": ("read_points",),
    "cityflow.runs.project_files": ("sample_catalog",),
}  # fmt: skip
"""Module → the names that it gives. They are not imported here: what every part of cityflow imports must not import any of them."""

_MODULE_OF = {name: module for module, names in _PLACES.items() for name in names}
__all__ = [*sorted(_MODULE_OF), "__version__"]


def __getattr__(name: str) -> object:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'cityflow' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})

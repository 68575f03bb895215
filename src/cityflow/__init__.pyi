from cityflow.api.converted import draw_buildings as draw_buildings
from cityflow.api.converted import surface_dataset as surface_dataset
from cityflow.api.converted import triangles_of as triangles_of
from cityflow.api.converted import write_cityjson as write_cityjson
from cityflow.api.finished_run import Run as Run
from cityflow.api.finished_run import open_run as open_run
from cityflow.api.from_images import match_images as match_images
from cityflow.api.from_images import points_of_depths as points_of_depths
from cityflow.api.from_images import read_images as read_images
from cityflow.api.from_images import texture_building as texture_building
from cityflow.api.from_images import windows_of as windows_of
from cityflow.api.from_points import building_from_points as building_from_points
from cityflow.api.from_points import evidence_from_points as evidence_from_points
from cityflow.api.from_points import outlines_from_points as outlines_from_points
from cityflow.api.from_points import split_outline as split_outline
from cityflow.api.from_points import surface_from_points as surface_from_points
from cityflow.core.building import Building as Building
from cityflow.core.building import Outline as Outline
from cityflow.core.camera import Camera as Camera
from cityflow.core.camera import OrientedImage as OrientedImage
from cityflow.core.colour_image import ColourImage as ColourImage
from cityflow.core.pixels import ArrayPixels as ArrayPixels
from cityflow.core.points import PointCloud as PointCloud
from cityflow.io.points.las import read_points as read_points
from cityflow.runs.project_files import sample_catalog as sample_catalog

__all__: list[str]
__version__: str

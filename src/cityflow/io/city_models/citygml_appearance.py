"""Appearances in CityGML 2.0: textures and plain colours of one building, an ortho on the terrain.

Each appearance stands in its own city object, so that a file can be written, and read, object by object. Texture
coordinates are given ring by ring: georeferenced textures and matrices would be shorter on terrain, but most readers
pass them over.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from types import MappingProxyType
from urllib.parse import quote

from cityflow.core.arrays import FloatArray, IntArray
from cityflow.core.building import Building, Lod
from cityflow.core.texture import Colour, Drape, FaceTexture, PlainFace, TexturePage
from cityflow.io.attributes import ncname
from cityflow.io.city_models.appearance import (
    THEME,
    Appearance,
    Look,
    Looks,
    coordinates_of,
    looks_of,
    unit_colour,
)  # fmt: skip

NAMESPACE = "http://www.opengis.net/citygml/appearance/2.0"
SOLID_MARK, BEYOND_MARK = "2", "b"
"""Marks of the two textured shells in the ids of their polygons."""
NO_LOOKS: Mapping[str, Look] = MappingProxyType({})


def polygon_stem(identifier: str, mark: str) -> str:
    """The gml:id of a face's polygon, up to the number of the face."""
    return f"{ncname('p', identifier)}-{mark}-"


def ring_name(polygon: str, ring: int) -> str:
    """The gml:id of a ring of a textured polygon."""
    return f"{polygon}-r{ring}"


class BuildingAppearance:
    """How the faces of one building look."""

    def __init__(self, appearance: Appearance, building: Building) -> None:
        texture = appearance.of(building)
        shells = {SOLID_MARK: Lod.LOD22 in building.solids, BEYOND_MARK: building.beyond is not None}
        looks = {SOLID_MARK: looks_of(texture, "solid"), BEYOND_MARK: looks_of(texture, "beyond")}
        self._appearance, self._id = appearance, building.id
        self._looks: dict[str, Looks] = {mark: looks[mark] for mark, there in shells.items() if there}

    def of(self, mark: str) -> Looks:
        """How the faces of a shell look."""
        return self._looks.get(mark, {})

    @property
    def pages(self) -> Sequence[TexturePage]:
        """That textures of faces refer to."""
        return self._appearance.pages()

    def xml(self, more: Mapping[str, Look] = NO_LOOKS) -> str:
        """The property ``app:appearance``; empty where nothing looks other than it always did.

        Parameters
        ----------
        more : looks of other polygons by their gml:ids
        """
        targets: dict[int, list[str]] = {}
        colours: dict[Colour, list[str]] = {}
        for name, look, rings in chain(self._faces(), _with_rings(more)):
            if isinstance(look, PlainFace):
                colours.setdefault(look.colour, []).append(f"<app:target>#{name}</app:target>\n")
            else:
                targets.setdefault(look.page, []).append(_target(name, rings))
        pages, stem = self._appearance.pages(), ncname("look", self._id)
        members = [_texture(f"{stem}-t{page}", self._appearance, pages[page], found) for page, found in targets.items()]
        members += [_material(f"{stem}-m{n}", colour, found) for n, (colour, found) in enumerate(colours.items())]
        return _appearance(stem, members) if members else ""

    def _faces(self) -> Iterator[tuple[str, Look, list[str]]]:
        """Polygon, look, and of textured faces the texture coordinates of each ring."""
        for mark, looks in self._looks.items():
            stem = polygon_stem(self._id, mark)
            yield from _with_rings({f"{stem}{i}": look for i, look in looks.items()})


def _with_rings(looks: Mapping[str, Look]) -> Iterator[tuple[str, Look, list[str]]]:
    texts = _ring_texts(coordinates_of(looks.values(), closed=True))
    for name, look in looks.items():
        yield name, look, [next(texts) for _ in look.rings] if isinstance(look, FaceTexture) else []


def draped(appearance: Appearance, drape: Drape, name: str, vertices: FloatArray, triangles: IntArray) -> Iterator[str]:
    """The ortho on a terrain, piece by piece: one target, the triangulated surface, with every triangle's ring."""
    stem, surface = ncname("look", name), ncname("triangles", name)
    texts = [_pair(u, v) for u, v in drape.uv(vertices).tolist()]
    head, foot = _texture_frame(f"{stem}-t0", appearance, drape.page)
    yield _APPEARANCE_HEAD.format(stem) + head + f'<app:target uri="#{surface}"><app:TexCoordList>\n'
    for i, (a, b, c) in enumerate(triangles.tolist()):
        yield _ring(triangle_ring(name, i), f"{texts[a]} {texts[b]} {texts[c]} {texts[a]}") + "\n"
    yield f"</app:TexCoordList></app:target>\n{foot}{_APPEARANCE_FOOT}"


def triangle_ring(name: str, triangle: int) -> str:
    """The gml:id of a triangle's ring in a terrain of that name."""
    return f"{ncname('t', name)}-{triangle}"


_APPEARANCE_HEAD = f'<app:appearance><app:Appearance gml:id="{{}}"><app:theme>{THEME}</app:theme>\n'
_APPEARANCE_FOOT = "</app:Appearance></app:appearance>\n"


def _appearance(name: str, members: Iterable[str]) -> str:
    return _APPEARANCE_HEAD.format(name) + "".join(members) + _APPEARANCE_FOOT


def _texture(name: str, appearance: Appearance, page: TexturePage, targets: Iterable[str]) -> str:
    head, foot = _texture_frame(name, appearance, page)
    return head + "".join(targets) + foot


def _texture_frame(name: str, appearance: Appearance, page: TexturePage) -> tuple[str, str]:
    """What stands before and after the targets of a texture."""
    head = (
        f'<app:surfaceDataMember><app:ParameterizedTexture gml:id="{name}">'
        f"<app:imageURI>{quote(appearance.image(page))}</app:imageURI><app:mimeType>{page.media_type}</app:mimeType>"
        "<app:textureType>specific</app:textureType><app:wrapMode>clamp</app:wrapMode>\n"
    )
    return head, "</app:ParameterizedTexture></app:surfaceDataMember>\n"


def _material(name: str, colour: Colour, targets: Iterable[str]) -> str:
    red, green, blue = unit_colour(colour)
    return (
        f'<app:surfaceDataMember><app:X3DMaterial gml:id="{name}">'
        f"<app:diffuseColor>{red} {green} {blue}</app:diffuseColor>\n{''.join(targets)}"
        "</app:X3DMaterial></app:surfaceDataMember>\n"
    )


def _target(polygon: str, rings: Sequence[str]) -> str:
    coordinates = "".join(_ring(ring_name(polygon, n), ring) for n, ring in enumerate(rings))
    return f'<app:target uri="#{polygon}"><app:TexCoordList>{coordinates}</app:TexCoordList></app:target>\n'


def _ring(name: str, coordinates: str) -> str:
    return f'<app:textureCoordinates ring="#{name}">{coordinates}</app:textureCoordinates>'


def _ring_texts(rings: Iterable[list[list[float]]]) -> Iterator[str]:
    for ring in rings:
        yield " ".join([_pair(u, v) for u, v, _ in ring])


def _pair(u: float, v: float) -> str:
    # plain digits: some readers know no exponents
    return f"{u:.7f} {v:.7f}"

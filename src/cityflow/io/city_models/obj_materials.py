"""Materials of OBJ files: by surface type, one for each page of textures, plain colours in few steps."""

from __future__ import annotations

from collections.abc import Iterable

from cityflow.core.building import Face
from cityflow.core.texture import Colour, FaceTexture
from cityflow.io.city_models.appearance import Appearance, Look

MATERIALS = {
    "roof": (0.70, 0.26, 0.20),
    "wall": (0.85, 0.82, 0.75),
    "party_wall": (0.55, 0.52, 0.60),
    "ground": (0.45, 0.45, 0.45),
    "outer_ceiling": (0.75, 0.70, 0.55),
    "outer_floor": (0.68, 0.62, 0.52),
    "terrain": (0.50, 0.60, 0.40),
}
PLAIN_STEPS = 16
"""Steps of each colour channel of plain faces: renderers draw material by material, so there must not be thousands."""


def material_of(face: Face, look: Look | None) -> str:
    """The name of a face's material: its page, its plain colour where it lacks a texture, else its type."""
    if face.neighbour is not None:
        return "party_wall"
    if isinstance(look, FaceTexture):
        return f"page_{look.page}"
    return plain_material(look.colour) if look is not None and look.reason else face.semantic.name.lower()


def plain_material(colour: Colour) -> str:
    """The material of a colour: a hexadecimal digit for each channel.

    >>> plain_material((255, 128, 0))
    'plain_f80'
    """
    return "plain_" + "".join(f"{round(part * (PLAIN_STEPS - 1) / 255):x}" for part in colour)


def materials_file(used: Iterable[str], appearance: Appearance) -> str:
    """The MTL file: all materials by type, and the pages and plain colours among those that are used."""
    draped = appearance.drape is not None
    entries = [_entry(name, kd) for name, kd in MATERIALS.items() if not (draped and name == "terrain")]
    if appearance.drape is not None:
        entries.append(_page("terrain", appearance.image(appearance.drape.page)))
    others = set(used)
    pages = {f"page_{i}": appearance.image(page) for i, page in enumerate(appearance.pages())}
    entries += [_page(name, image) for name, image in pages.items() if name in others]
    entries += [_entry(name, _colour(name)) for name in sorted(others) if name.startswith("plain_")]
    return "".join(entries)


def _colour(plain: str) -> tuple[float, float, float]:
    red, green, blue = (int(digit, 16) / (PLAIN_STEPS - 1) for digit in plain.removeprefix("plain_"))
    return red, green, blue


def _entry(name: str, kd: tuple[float, float, float]) -> str:
    red, green, blue = kd
    return f"newmtl {name}\nKd {red:.2f} {green:.2f} {blue:.2f}\n\n"


def _page(name: str, image: str) -> str:
    return f"newmtl {name}\nKd 1.00 1.00 1.00\nmap_Kd {image}\n\n"

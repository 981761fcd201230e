"""The meshes that are drawn: from the package, or from the checkout beside it."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from jaxtyping import Float, Int

from app.picture.ply import read_ply
from handstudio.arrays import Array
from handstudio.errors import HandstudioError

_PLACES = (
    Path(__file__).parents[1] / "assets" / "meshes",
    Path(__file__).parents[2] / "assets" / "meshes",
)


@cache
def mesh(name: str, mirrored: bool = False) -> tuple[Float[Array, "v 3"], Int[Array, "f 3"]]:
    """Vertices and faces of a mesh by name; mirrored in x for left hands.

    Raises:
        HandstudioError: the installation lacks it.
    """
    for folder in _PLACES:
        path = folder / f"{name}.ply"
        if path.exists():
            vertices, faces = read_ply(path.read_bytes())
            if mirrored:
                return vertices * [-1.0, 1.0, 1.0], faces[:, ::-1]
            return vertices, faces
    raise HandstudioError(
        "The mesh {name} is missing from this installation.", "Install handstudio anew.", name=name
    )

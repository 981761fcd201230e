"""Make the meshes of bones, joints and sensors in this folder.

    python assets/meshes/make_meshes.py [FOLDER]

A bone is described as a solid: a function that says for points how far outside they lie, put
together from ellipsoids and waisted rods that flow into one another. Rays from the bone's axis find
its surface, ring by ring, so every mesh is closed, evenly divided and the same on every machine.

Axes are those of a link: x the flexion axis, y along the bone towards the fingertip, z towards the
back of the hand (README.md here says more).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import trimesh
from trimesh.exchange.ply import export_ply

Array: TypeAlias = np.ndarray[Any, Any]
Solid: TypeAlias = Callable[[Array], Array]
"""Points ``(..., 3)`` to signed distances ``(...)``, negative inside; roughly to scale."""
Axis: TypeAlias = Callable[[Array], Array]
"""Heights y ``(n,)`` to points on the bone's axis ``(n, 3)``, all inside the solid."""

DIGITS = 5
"""Coordinates are rounded, which leaves no room for the last bits in which machines differ."""


def make_all() -> dict[str, trimesh.Trimesh]:
    """Every mesh, by the name of its file."""
    return {
        "forearm": forearm(),
        "joint": joint(),
        "metacarpal": metacarpal(),
        "phalanx": phalanx(),
        "sensor": sensor(),
    }


# --- the meshes -----------------------------------------------------------------------------------


def phalanx() -> trimesh.Trimesh:
    """A finger bone: broad shallow base, waisted shaft, two condyles side by side."""
    axis = arched(0.014)
    solid = union(
        0.06,
        shaft(axis, (0.10, 0.90), (0.090, 0.066, 0.072), flat=0.78),
        ellipsoid((0, 0.085, -0.004), (0.122, 0.090, 0.096)),
        ellipsoid((0, 0.180, 0.000), (0.092, 0.150, 0.072)),
        union(
            0.05,
            ellipsoid((-0.052, 0.922, -0.012), (0.050, 0.078, 0.078)),
            ellipsoid((0.052, 0.922, -0.012), (0.050, 0.078, 0.078)),
        ),
    )
    solid = cut(0.03, solid, ellipsoid((0, -0.065, 0), (0.12, 0.085, 0.10)))
    return fit(sweep(solid, axis, (0.12, 0.90)), half_width=0.12)


def metacarpal() -> trimesh.Trimesh:
    """A bone of the palm: wedge-like base, long slim arched shaft, one round head."""
    axis = arched(0.024)
    solid = union(
        0.06,
        shaft(axis, (0.08, 0.87), (0.078, 0.053, 0.058), flat=0.92),
        ellipsoid((0, 0.065, 0.018), (0.098, 0.076, 0.058)),
        ellipsoid((0, 0.075, -0.026), (0.066, 0.080, 0.064)),
        ellipsoid((0, 0.130, 0.004), (0.064, 0.110, 0.060)),
        ellipsoid((0, 0.920, -0.012), (0.074, 0.080, 0.086)),
        ellipsoid((0, 0.865, 0.000), (0.066, 0.080, 0.056)),
    )
    solid = cut(0.02, solid, ellipsoid((0, -0.080, 0), (0.16, 0.090, 0.16)))
    return fit(sweep(solid, axis, (0.08, 0.92)), half_width=0.10)


def forearm() -> trimesh.Trimesh:
    """Ulna and radius of a right arm side by side, palm and forearm in one plane."""
    ulna, radius = _ulna(), _radius()
    vertices = np.vstack([ulna.vertices, radius.vertices])
    faces = np.vstack([ulna.faces, radius.faces + len(ulna.vertices)])
    return fit(trimesh.Trimesh(vertices, faces, process=False))


def joint() -> trimesh.Trimesh:
    """A ball of radius 1."""
    return finished(trimesh.creation.icosphere(subdivisions=3, radius=1.0))


def sensor() -> trimesh.Trimesh:
    """A board of 1 x 1, 0.3 high, a chip on its upper side (+z), a notch in its front edge (+y)."""
    board, chip = _board_outline, _chip_outline
    layers = [  # outline, how far inside it, height: each edge has a ring close to either side
        (board, 0.10, -0.15),
        (board, 0.03, -0.15),
        (board, 0.01, -0.14),
        (board, 0.00, -0.12),
        (board, 0.00, 0.01),
        (board, 0.01, 0.03),
        (board, 0.03, 0.04),
        (chip, -0.02, 0.04),
        (chip, 0.00, 0.05),
        (chip, 0.00, 0.13),
        (chip, 0.01, 0.145),
        (chip, 0.03, 0.15),
    ]
    angles = _denser_in_front(96)
    rings = [_outline_ring(outline, inset, height, angles) for outline, inset, height in layers]
    return finished(skin(np.array([0, 0, -0.15]), np.array(rings), np.array([0, 0, 0.15])))


# --- parts of them --------------------------------------------------------------------------------


def _ulna() -> trimesh.Trimesh:
    def axis(y: Array) -> Array:
        t = (y - 0.05) / 0.88
        return np.stack([0.030 + 0.032 * t, y, 0.022 - 0.014 * t], axis=-1)

    solid = union(
        0.03,
        shaft(axis, (0.06, 0.93), (0.036, 0.027, 0.018)),
        ellipsoid((0.028, 0.045, 0.022), (0.046, 0.045, 0.042)),  # olecranon, the elbow's tip
        ellipsoid((0.028, 0.125, -0.012), (0.040, 0.032, 0.042)),  # coronoid process
        ellipsoid((0.031, 0.180, 0.014), (0.034, 0.110, 0.034)),
        ellipsoid((0.062, 0.935, 0.006), (0.032, 0.030, 0.030)),  # head
        ellipsoid((0.078, 0.960, 0.016), (0.011, 0.028, 0.011)),  # styloid process
    )
    bite = ellipsoid((0.028, 0.070, -0.042), (0.080, 0.038, 0.044))  # where the upper arm turns
    return sweep(cut(0.012, solid, bite), axis, (0.05, 0.935), rings=30, sides=18)


def _radius() -> trimesh.Trimesh:
    def axis(y: Array) -> Array:
        bow = np.sin(np.pi * np.clip((y - 0.125) / 0.80, 0, 1))
        return np.stack([-0.042 - 0.034 * bow, y, -0.006 + 0.006 * bow], axis=-1)

    solid = union(
        0.03,
        shaft(axis, (0.13, 0.92), (0.025, 0.027, 0.034)),
        ellipsoid((-0.042, 0.122, -0.006), (0.044, 0.026, 0.044)),  # head, a disc
        ellipsoid((-0.040, 0.215, -0.014), (0.022, 0.032, 0.020)),  # tuberosity
        ellipsoid((-0.046, 0.860, 0.000), (0.046, 0.120, 0.036)),
        ellipsoid((-0.040, 0.925, 0.000), (0.066, 0.050, 0.042)),  # broad end at the wrist
        ellipsoid((-0.090, 0.965, 0.000), (0.018, 0.034, 0.020)),  # styloid process
    )
    hollow = ellipsoid((-0.042, 0.086, -0.006), (0.034, 0.020, 0.034))
    return sweep(cut(0.012, solid, hollow), axis, (0.128, 0.925), rings=30, sides=18)


def _board_outline(points: Array) -> Array:
    """Distance of points of the plane to the board's edge, rounded at the corners and notched."""
    notch = 0.11 - np.hypot(points[..., 0], points[..., 1] - 0.5)
    return np.maximum(_square(points, half=0.5, rounding=0.12), notch)


def _chip_outline(points: Array) -> Array:
    return _square(points, half=0.24, rounding=0.03)


def _square(points: Array, half: float, rounding: float) -> Array:
    beyond = np.abs(points) - (half - rounding)
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=-1)
    distance: Array = outside + np.minimum(beyond.max(axis=-1), 0) - rounding
    return distance


def _denser_in_front(count: int) -> Array:
    """Angles about z from +y on, denser there than behind: that is where the notch is."""
    turn = np.arange(count) * 2 * np.pi / count
    return np.pi / 2 + turn - 0.5 * np.sin(turn)


def _outline_ring(outline: Solid, inset: float, height: float, angles: Array) -> Array:
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    reach = surface(lambda p: outline(p) + inset, np.zeros(2), directions, limit=1.0)
    ring = directions * reach[:, None]
    return np.column_stack([ring, np.full(len(ring), height)])


# --- solids ---------------------------------------------------------------------------------------


def ellipsoid(centre: tuple[float, ...], radii: tuple[float, ...]) -> Solid:
    """An ellipsoid with axes along x, y and z."""

    def distance(points: Array) -> Array:
        offset = (points - np.array(centre)) / np.array(radii)
        k0 = np.linalg.norm(offset, axis=-1)
        k1 = np.linalg.norm(offset / np.array(radii), axis=-1)
        # At the very centre both are 0; there the smallest radius is the distance.
        return np.where(k1 > 1e-9, k0 * (k0 - 1) / np.maximum(k1, 1e-9), -min(radii))

    return distance


def shaft(
    axis: Axis, ends: tuple[float, float], radii: tuple[float, float, float], flat: float = 1.0
) -> Solid:
    """A rod about an axis between two heights; its radii at the start, half way and at the end.

    It is flattened along z. Its ends are cut square, to be hidden in something thicker.
    """
    low, high = ends
    waist = np.polynomial.Polynomial.fit([low, (low + high) / 2, high], radii, deg=2)

    def distance(points: Array) -> Array:
        y = points[..., 1]
        offset = points - axis(y)
        radius = waist(np.clip(y, low, high))
        around = np.hypot(offset[..., 0], offset[..., 2] / flat) - radius
        outside: Array = np.maximum(around, np.maximum(low - y, y - high))
        return outside

    return distance


def union(blend: float, *solids: Solid) -> Solid:
    """All solids together, flowing into one another over a width of about `blend`."""

    def distance(points: Array) -> Array:
        total = solids[0](points)
        for solid in solids[1:]:
            total = _smooth_minimum(total, solid(points), blend)
        return total

    return distance


def cut(blend: float, solid: Solid, hole: Solid) -> Solid:
    """The solid without what lies in the hole, its rim rounded over about `blend`."""
    return lambda points: -_smooth_minimum(-solid(points), hole(points), blend)


def _smooth_minimum(a: Array, b: Array, blend: float) -> Array:
    near = np.maximum(blend - np.abs(a - b), 0) / blend
    minimum: Array = np.minimum(a, b) - near**2 * blend / 4
    return minimum


# --- from solids to meshes ------------------------------------------------------------------------


def arched(height: float) -> Axis:
    """An axis along y that bends by `height` towards the back of the hand."""
    return lambda y: np.stack([0 * y, y, height * np.sin(np.pi * np.clip(y, 0, 1))], axis=-1)


def sweep(
    solid: Solid, axis: Axis, ends: tuple[float, float], *, rings: int = 34, sides: int = 24
) -> trimesh.Trimesh:
    """Skin a solid along its axis.

    Between the heights `ends` rays leave the axis level; at either end they fan out to the pole.
    """
    start, end = ends
    caps = rings // 4
    tilt = np.linspace(-np.pi / 2, 0, caps + 1)[1:-1]
    level = np.linspace(0, np.pi, rings - 2 * (caps - 1))
    # Closer to one another near the ends, where the shape is.
    heights = start + (end - start) * (1 - np.cos(level)) / 2

    y = np.concatenate([np.full(caps - 1, start), heights, np.full(caps - 1, end)])
    tilts = np.concatenate([tilt, 0 * heights, -tilt[::-1]])
    angles = np.arange(sides) * 2 * np.pi / sides
    directions = np.stack(
        [
            np.cos(tilts)[:, None] * np.sin(angles),
            np.sin(tilts)[:, None] * np.ones(sides),
            np.cos(tilts)[:, None] * np.cos(angles),
        ],
        axis=-1,
    )
    origins = axis(y)[:, None, :]
    body = origins + directions * surface(solid, origins, directions)[..., None]
    poles = axis(np.array([start, end]))
    down_up = np.array([[0, -1, 0], [0, 1, 0]])
    poles = poles + down_up * surface(solid, poles, down_up)[:, None]
    return skin(poles[0], body, poles[1])


def surface(solid: Solid, origins: Array, directions: Array, limit: float = 0.25) -> Array:
    """How far along each ray the surface lies, by halving; origins lie inside, `limit` outside."""
    shape = np.broadcast_shapes(origins.shape, directions.shape)[:-1]
    inside, outside = np.zeros(shape), np.full(shape, limit)
    for _ in range(48):
        middle = (inside + outside) / 2
        is_inside = solid(origins + directions * middle[..., None]) < 0
        inside = np.where(is_inside, middle, inside)
        outside = np.where(is_inside, outside, middle)
    return inside


def skin(first_pole: Array, rings: Array, last_pole: Array) -> trimesh.Trimesh:
    """Close a stack of rings ``(ring, side, 3)`` with a point at either end."""
    count, sides = rings.shape[:2]
    here = np.arange(sides)
    following = (here + 1) % sides
    faces = [np.column_stack([np.zeros_like(here), 1 + following, 1 + here])]
    for ring in range(count - 1):
        low, high = 1 + ring * sides, 1 + (ring + 1) * sides
        faces.append(np.column_stack([low + here, low + following, high + following]))
        faces.append(np.column_stack([low + here, high + following, high + here]))
    top = 1 + (count - 1) * sides
    last = np.full_like(here, 1 + count * sides)
    faces.append(np.column_stack([top + here, top + following, last]))
    vertices = np.vstack([first_pole, rings.reshape(-1, 3), last_pole])
    mesh = trimesh.Trimesh(vertices, np.vstack(faces), process=False)
    if mesh.volume < 0:  # the rings ran the other way round
        mesh.invert()
    return mesh


def fit(mesh: trimesh.Trimesh, half_width: float | None = None) -> trimesh.Trimesh:
    """Stretch to exactly y = 0 ... 1 and, if asked, to exactly that half width in x."""
    vertices = mesh.vertices.copy()
    low, high = vertices[:, 1].min(), vertices[:, 1].max()
    vertices[:, 1] = (vertices[:, 1] - low) / (high - low)
    if half_width is not None:
        vertices[:, 0] *= half_width / np.abs(vertices[:, 0]).max()
    return finished(trimesh.Trimesh(vertices, mesh.faces, process=False))


def finished(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The mesh as it is written to the file."""
    vertices = np.round(mesh.vertices, DIGITS) + 0.0  # no -0
    return trimesh.Trimesh(vertices.astype(np.float32), mesh.faces, process=False)


def write(folder: Path) -> None:
    """Write every mesh into the folder, as binary PLY."""
    for name, mesh in make_all().items():
        content = export_ply(mesh, vertex_normal=False)
        (folder / f"{name}.ply").write_bytes(content)
        print(f"{name}.ply: {len(mesh.vertices)} vertices, {len(content) / 1000:.0f} kB")


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)

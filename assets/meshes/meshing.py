"""From solids to even meshes: surface nets, thinned out to the edges that are wanted."""

from __future__ import annotations

from typing import Any

import numpy as np
from make_meshes import Array, Solid
from scipy import sparse

SHORT, LONG = 0.80, 1.40
"""Edges shorter than this share of the length that is wanted are drawn together, unless that makes
one longer than that."""
SHARP_RAD = 0.55
"""Angles below this are worth turning an edge for."""


def nets(corners: Array, value: Array) -> tuple[Array, Array]:
    """Surface nets: a vertex a cell that is crossed, a quad an edge of the grid that is."""
    inside = value < 0.0
    cells = tuple(n - 1 for n in value.shape)
    total, count = np.zeros((*cells, 3)), np.zeros(cells)
    quads: list[Array] = []
    for axis in range(3):
        low = _cut(value.ndim, axis, slice(None, -1))
        high = _cut(value.ndim, axis, slice(1, None))
        crossed = np.argwhere(inside[low] != inside[high])
        crossed = crossed[(crossed[:, [k for k in range(3) if k != axis]] > 0).all(axis=1)]
        a, b = tuple(crossed.T), tuple((crossed + np.eye(3, dtype=int)[axis]).T)
        share = (value[a] / (value[a] - value[b]))[:, None]
        point = corners[a] + share * (corners[b] - corners[a])
        u, v = (np.eye(3, dtype=int)[(axis + k) % 3] for k in (1, 2))
        around = [crossed, crossed - u, crossed - u - v, crossed - v]
        for cell in around:
            np.add.at(total, tuple(cell.T), point)
            np.add.at(count, tuple(cell.T), 1.0)
        names = np.stack([np.ravel_multi_index(tuple(cell.T), cells) for cell in around], axis=1)
        quads.append(np.where(inside[a][:, None], names, names[:, ::-1]))
    used = np.flatnonzero(count.ravel())
    number = np.full(count.size, -1)
    number[used] = np.arange(len(used))
    vertices = total.reshape(-1, 3)[used] / count.ravel()[used, None]
    return vertices, number[np.concatenate(quads)]


def _cut(dims: int, axis: int, part: slice) -> tuple[slice, ...]:
    return tuple(part if k == axis else slice(None) for k in range(dims))


def thinned(vertices: Array, faces: Array, wanted: Array) -> tuple[Array, Array]:
    """Edges much shorter than wanted [m] are drawn together, the shortest first."""
    net = _Net(vertices.copy(), wanted, faces)
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = np.unique(np.sort(ends, axis=1), axis=0)
    share = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    share /= wanted[edges].mean(axis=1)
    moved: set[int] = set()
    for number in np.argsort(share, kind="stable"):
        a, b = edges[number].tolist()
        if share[number] > SHORT:
            break
        if a not in moved and b not in moved and net.may_close(a, b):
            net.close(a, b)
            moved |= {a, b}
    left = np.array([face for face in net.corners if face is not None])
    used, renumbered = np.unique(left, return_inverse=True)
    return net.place[used], renumbered.reshape(-1, 3)


class _Net:
    """Triangles whose edges can be closed, one by one."""

    def __init__(self, place: Array, wanted: Array, faces: Array) -> None:
        self.place, self._wanted = place, wanted
        self.corners: list[tuple[int, ...] | None] = [tuple(face) for face in faces.tolist()]
        self._fan: list[set[int]] = [set() for _ in place]  # faces around a vertex
        for number, face in enumerate(faces.tolist()):
            for vertex in face:
                self._fan[vertex].add(number)

    def may_close(self, a: int, b: int) -> bool:
        """Whether the net stays one sheet, its faces on their sides, and its edges short."""
        around_a, around_b = self._around(a), self._around(b)
        opposite, ring = around_a & around_b, (around_a | around_b) - {a, b}
        if len(opposite) != 2 or len(ring) > 9 or any(len(self._fan[v]) < 5 for v in opposite):
            return False
        middle = self._middle(a, b)
        if any(np.linalg.norm(self.place[v] - middle) > LONG * self._wanted[v] for v in ring):
            return False
        apart = self._fan[a] ^ self._fan[b]
        return all(_stays(self.place, self.corners[f], (a, b), middle) for f in apart)

    def close(self, a: int, b: int) -> None:
        """Both ends become one in the middle; the two faces of the edge are gone."""
        self.place[a] = self._middle(a, b)
        for f in self._fan[a] & self._fan[b]:
            for v in self.corners[f] or ():
                self._fan[v].discard(f)
            self.corners[f] = None
        for f in self._fan[b]:
            self.corners[f] = tuple(a if v == b else v for v in self.corners[f] or ())
        self._fan[a] |= self._fan[b]
        self._fan[b] = set()

    def _around(self, vertex: int) -> set[int]:
        return {v for f in self._fan[vertex] for v in self.corners[f] or ()} - {vertex}

    def _middle(self, a: int, b: int) -> Array:
        middle: Array = (self.place[a] + self.place[b]) / 2
        return middle


def _stays(place: Array, face: Any, ends: tuple[int, int], middle: Array) -> bool:
    """Whether a face keeps its side when the ends of an edge meet in the middle."""
    before = place[list(face)]
    after = np.array([middle if v in ends else place[v] for v in face])
    normals = [np.cross(c[1] - c[0], c[2] - c[0]) for c in (before, after)]
    lengths = [float(np.linalg.norm(normal)) for normal in normals]
    return bool(normals[0] @ normals[1] > 0.5 * lengths[0] * lengths[1])


def flipped(vertices: Array, faces: Array) -> Array:
    """Edges are turned within their two faces where that opens the sharpest angle."""
    out = faces.copy()
    side: dict[tuple[int, int], int] = {}
    for number, (a, b, c) in enumerate(out.tolist()):
        side[a, b] = side[b, c] = side[c, a] = number
    sharp = set(np.flatnonzero(_angles(vertices[faces]).min(axis=1) < SHARP_RAD).tolist())
    for a, b in [edge for edge, number in side.items() if number in sharp]:
        if (a, b) not in side or (b, a) not in side:
            continue  # was turned away
        one, other = side[a, b], side[b, a]
        c, d = (int(sum(out[f]) - a - b) for f in (one, other))
        if c == d or (c, d) in side or (d, c) in side:
            continue
        now, then = ((a, b, c), (b, a, d)), ((c, d, b), (d, c, a))
        if _sharpest(vertices, then) <= _sharpest(vertices, now) + 0.02:
            continue
        out[one], out[other] = then
        del side[a, b], side[b, a]
        for face, number in zip(then, (one, other), strict=True):
            for i in range(3):
                side[face[i], face[(i + 1) % 3]] = number
    return out


def _sharpest(vertices: Array, faces: Any) -> float:
    """The smallest angle of two faces [rad]; none where they fold onto one another."""
    corner = vertices[np.array(faces)]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    if normal[0] @ normal[1] < 0.7 * np.linalg.norm(normal[0]) * np.linalg.norm(normal[1]):
        return 0.0
    return float(_angles(corner).min())


def _angles(corner: Array) -> Array:
    """Angles of triangles [rad], (face, 3)."""
    edge = np.roll(corner, -1, axis=1) - corner
    edge /= np.linalg.norm(edge, axis=-1, keepdims=True)
    cosine = -np.sum(edge * np.roll(edge, 1, axis=1), axis=-1)
    out: Array = np.arccos(np.clip(cosine, -1.0, 1.0))
    return out


def halved(vertices: Array, quads: Array) -> Array:
    """Two triangles a quad, along its shorter diagonal."""
    corner = vertices[quads]
    first = np.linalg.norm(corner[:, 0] - corner[:, 2], axis=-1)
    other = np.linalg.norm(corner[:, 1] - corner[:, 3], axis=-1)
    quads = np.where((first <= other)[:, None], quads, np.roll(quads, -1, axis=1))
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def neighbours(count: int, faces: Array) -> Any:
    """Rows of a sparse matrix that average over the neighbours of each vertex."""
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    ones = np.ones(2 * len(a))
    link = sparse.csr_matrix((ones, (np.r_[a, b], np.r_[b, a])), shape=(count, count))
    link.data[:] = 1.0
    return sparse.diags(1.0 / np.asarray(link.sum(axis=1)).ravel()) @ link


def evened(vertices: Array, faces: Array) -> Array:
    """Every vertex moved half the way to the middle of its neighbours."""
    out: Array = 0.5 * vertices + 0.5 * (neighbours(len(vertices), faces) @ vertices)
    return out


def drawn_onto(solid: Solid, vertices: Array, steps: int = 1) -> Array:
    """Newton's way onto the surface along the solid's slope."""
    reach = 5e-5
    for _ in range(steps):
        slope = np.stack(
            [
                (solid(vertices + reach * e) - solid(vertices - reach * e)) / (2 * reach)
                for e in np.eye(3)
            ],
            axis=-1,
        )
        square = np.maximum((slope**2).sum(axis=-1), 0.25)
        vertices = vertices - (solid(vertices) / square)[:, None] * slope
    return vertices

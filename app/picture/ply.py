"""Our meshes as they are kept: binary PLY of triangles. trimesh, which makes them, takes a second
to load, and a page waits for it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from handstudio.arrays import Array

_KINDS = {"float": "<f4", "double": "<f8", "uchar": "u1", "int": "<i4", "uint": "<u4"}
_FACES = ("uchar", "int")  # how many corners, and which


def read_ply(data: bytes) -> tuple[Float[Array, "v 3"], Int[Array, "f 3"]]:
    """Vertices and the corners of triangles.

    Raises:
        ValueError: it is no such file, or not the whole of it.
    """
    header, _, body = data.partition(b"end_header\n")
    lines = [line.split() for line in header.decode("ascii", "replace").splitlines()]
    if ["format", "binary_little_endian", "1.0"] not in lines:
        raise ValueError("not a binary PLY file")
    counts = {line[1]: int(line[2]) for line in lines if line[:1] == ["element"]}
    listed = [tuple(line[2:4]) for line in lines if line[:2] == ["property", "list"]]
    if list(counts) != ["vertex", "face"] or listed != [_FACES]:
        raise ValueError("not vertices and triangles")
    columns = [line for line in lines if line[:1] == ["property"] and line[1] != "list"]
    vertex = np.dtype([(name, _KINDS[kind]) for _, kind, name in columns])
    corners = np.dtype([("count", "u1"), ("which", "<i4", (3,))])
    whole = counts["vertex"] * vertex.itemsize + counts["face"] * corners.itemsize
    if len(body) != whole:
        raise ValueError(f"{len(body)} bytes where {whole} should be")
    points = np.frombuffer(body, vertex, counts["vertex"])
    faces = np.frombuffer(body, corners, offset=points.nbytes)
    if not np.all(faces["count"] == 3):
        raise ValueError("not triangles alone")
    vertices = np.stack([points[axis] for axis in "xyz"], axis=-1).astype(float)
    return vertices, faces["which"].astype(np.int64)

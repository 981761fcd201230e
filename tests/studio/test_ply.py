"""Our reader of meshes, against the library that made them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from app.picture.ply import read_ply

MESHES = sorted((Path(__file__).parents[2] / "assets" / "meshes").glob("*.ply"))


@pytest.mark.parametrize("path", MESHES, ids=lambda path: path.stem)
def test_every_mesh_is_read_as_its_maker_reads_it(path):
    vertices, faces = read_ply(path.read_bytes())
    other = trimesh.load_mesh(path, process=False)
    np.testing.assert_array_equal(vertices, np.asarray(other.vertices))
    np.testing.assert_array_equal(faces, np.asarray(other.faces))


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: data[:-1],
        lambda data: b"ply\nformat ascii 1.0\nend_header\n",
        lambda data: data.replace(b"list uchar int", b"list uchar uint"),
        lambda data: data[:-13] + b"\x04" + data[-12:],
    ],
    ids=["cut", "ascii", "other faces", "a quadrangle"],
)
def test_what_is_no_such_file_is_told(damage):
    with pytest.raises(ValueError, match=r"not|bytes"):
        read_ply(damage(MESHES[0].read_bytes()))

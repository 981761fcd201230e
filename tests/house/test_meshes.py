"""The meshes are what their README says, and what their script makes."""

from __future__ import annotations

import importlib
import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import trimesh

MESHES = Path(__file__).resolve().parents[2] / "assets" / "meshes"
NAMES = ["forearm", "joint", "metacarpal", "phalanx", "sensor"]

# x, y, z; the y of a bone and the widths meant for scaling are exact, the rest is rounded.
BOUNDS: dict[str, list[tuple[float, float]]] = {
    "forearm": [(-0.11, 0.10), (0, 1), (-0.05, 0.07)],
    "joint": [(-1, 1), (-1, 1), (-1, 1)],
    "metacarpal": [(-0.10, 0.10), (0, 1), (-0.10, 0.09)],
    "phalanx": [(-0.12, 0.12), (0, 1), (-0.10, 0.10)],
    "sensor": [(-0.5, 0.5), (-0.5, 0.5), (-0.15, 0.15)],
}


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_meshes", MESHES / "make_meshes.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_mesh_is_listed_here_and_in_the_readme() -> None:
    assert sorted(path.stem for path in MESHES.glob("*.ply")) == NAMES
    readme = (MESHES / "README.md").read_text(encoding="utf-8")
    assert all(f"`{name}.ply`" in readme for name in NAMES)


def test_making_them_again_gives_the_same_vertices_and_faces(script: ModuleType) -> None:
    made = script.make_all()
    assert sorted(made) == NAMES
    for name, mesh in made.items():
        np.testing.assert_array_equal(_load(name).vertices, mesh.vertices, err_msg=name)
        np.testing.assert_array_equal(_load(name).faces, mesh.faces, err_msg=name)


@pytest.mark.parametrize("name", NAMES)
def test_a_mesh_is_closed_faces_outwards_and_is_small(name: str) -> None:
    mesh = _load(name)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert mesh.area_faces.min() > 0
    assert mesh.body_count == (2 if name == "forearm" else 1)
    assert (MESHES / f"{name}.ply").stat().st_size < 60_000


@pytest.mark.parametrize("name", NAMES)
def test_the_bounds_are_as_documented(name: str) -> None:
    exact = np.array([name != "forearm", True, name in ("joint", "sensor")])
    tolerance = np.where(exact, 1e-6, 0.005)
    assert (np.abs(_load(name).bounds - np.transpose(BOUNDS[name])) <= tolerance).all()


def test_a_sensor_shows_which_way_is_front_and_which_is_up() -> None:
    vertices = _load("sensor").vertices
    middle = np.abs(vertices[:, 0]) < 0.05
    assert vertices[middle, 1].max() < 0.45  # the notch
    assert vertices[middle, 1].min() == pytest.approx(-0.5)
    high = vertices[vertices[:, 2] > 0.1]
    assert np.abs(high[:, :2]).max() < 0.3  # the chip


def _load(name: str) -> trimesh.Trimesh:
    """As the file has it: nothing merged, nothing reordered."""
    mesh = trimesh.load_mesh(MESHES / f"{name}.ply", process=False)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


@pytest.mark.long
def test_making_the_hand_again_gives_the_same_surface(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(MESHES))
    made = importlib.import_module("make_hand").make()
    with np.load(MESHES / "hand.npz") as kept:
        assert sorted(kept) == sorted(made)
        for name, array in made.items():
            np.testing.assert_allclose(kept[name], array, atol=1e-5, err_msg=name)

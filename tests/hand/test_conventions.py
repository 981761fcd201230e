"""The page of conventions, word against code: its example, its names, its signs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import handstudio.hand
from handstudio.hand.angles import FLEXION, ROTATION, decompose, hand_angles, sign_of
from handstudio.hand.skeleton import FINGERS, JOINTS

PAGE = Path(handstudio.hand.__file__).with_name("CONVENTIONS.md").read_text(encoding="utf-8")
NAMES = {angle.name for angle in hand_angles()}


def table(first_heading: str) -> list[list[str]]:
    """Cells of the rows of the table whose heading begins so."""
    lines = PAGE.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith(f"| {first_heading} |"))
    rows = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def named(cell: str) -> list[str]:
    """The angles or joints a cell speaks of; F stands for every finger but the thumb."""
    names: list[str] = []
    for word in cell.split(", "):
        fingers = FINGERS[1:] if re.match(r"F_|\.\.\._", word) else ("",)
        names += [re.sub(r"^(F|\.\.\.)_", f"{finger}_", word) for finger in fingers]
    return names


def example() -> np.ndarray:
    found = re.search(r"q = \(([-0-9., \n]+)\)", PAGE)
    assert found is not None
    return np.array([float(number) for number in found[1].split(",")])


def clinical(turns_xzy: np.ndarray) -> np.ndarray:
    return np.rad2deg(turns_xzy * [-1.0, 1.0, 1.0])


def test_the_example_is_a_rotation():
    assert np.linalg.norm(example()) == pytest.approx(1.0, abs=2e-6)


def test_the_example_reads_in_our_order_as_the_page_says():
    stated = [float(cell) for cell in table("order of turns")[0][1:]]
    assert stated == [60.0, 15.0, 5.0]
    np.testing.assert_allclose(clinical(decompose(example())), stated, atol=0.05)
    by_scipy = Rotation.from_quat(example(), scalar_first=True).as_euler("XZY")
    np.testing.assert_allclose(clinical(by_scipy), stated, atol=0.05)


def test_the_example_reads_in_the_order_z_y_x_as_the_page_says():
    stated = [float(cell) for cell in table("order of turns")[1][1:]]
    assert stated == [60.2, 3.2, 15.5]
    z, y, x = Rotation.from_quat(example(), scalar_first=True).as_euler("ZYX")
    np.testing.assert_allclose(clinical(np.array([x, z, y])), stated, atol=0.05)


def test_every_angle_has_its_sign_on_the_page_and_none_is_made_up():
    stated = {}
    for cell, _, right, left in table("angle"):
        stated.update(dict.fromkeys(named(cell), (right, left)))
    assert stated.keys() == NAMES
    for angle in hand_angles():
        axis = {FLEXION: "x", ROTATION: "y"}.get(angle.turn, "z")
        signs = [f"{'+' if sign_of(angle, side) > 0 else '-'}{axis}" for side in ("right", "left")]
        assert tuple(signs) == stated[angle.name], angle.name


def test_every_joint_is_on_the_page_with_what_it_joins():
    stated = {}
    for cell, parent, child, axes in table("joint"):
        for name in named(cell):
            finger = name.split("_")[0]
            ends = [end.replace("...", finger) for end in (parent, child)]
            stated[name] = (None if "start" in parent else ends[0], ends[1], int(axes))
    assert stated == {joint.name: (joint.parent, joint.child, joint.axes) for joint in JOINTS}


def test_normal_ranges_are_of_angles_that_there_are():
    heading = PAGE.index("## Normal active ranges")
    rows = re.findall(r"^\| (\w+) \| (-?\d+) \| (\d+) \|$", PAGE[heading:], flags=re.MULTILINE)
    assert len(rows) == 11
    for cell, least, most in rows:
        assert set(named(cell)) <= NAMES
        assert int(least) <= 0 < int(most)

"""Skin taken off: boards that rock and a forearm that lags behind are brought back to the bone."""

from __future__ import annotations

import numpy as np
import pytest

from handstudio.arrays import Array
from handstudio.hand.angles import compose, joint_index, joint_turns
from handstudio.hand.skeleton import PARENTS, SEGMENTS, nominal_skeleton
from handstudio.hand.skin import LAG_RAD, WRIST_RAD, skin_of, taken_off
from handstudio.maths import so3

FOREARM, HAND = SEGMENTS.index("forearm"), SEGMENTS.index("hand")
ROCKS = [
    ("index_proximal", "index_mcp", 0.08),
    ("index_proximal", "index_pip", -0.05),
    ("hand", "wrist", -0.06),
    ("thumb_metacarpal", "thumb_mcp", 0.05),
]
sides = pytest.mark.parametrize("side", ["right", "left"])


def bones(side: str, turns: Array) -> Array:
    """Attitudes of segments from the turns of joints about x, z, y."""
    skeleton, own = nominal_skeleton(side), compose(turns)
    out = np.empty_like(own)
    for k, parent in enumerate(PARENTS):
        base = so3.IDENTITY if parent < 0 else out[:, parent]
        out[:, k] = so3.multiply(so3.multiply(base, skeleton.q_parent_rest[k]), own[:, k])
    return out


def anyhow(seed: int = 0, count: int = 30) -> Array:
    """Turns of a hand in any posture; joints turn about two axes only."""
    turns = np.random.default_rng(seed).uniform(-0.9, 0.3, (count, len(SEGMENTS), 3))
    return turns * [1.0, 0.3, 0.0]


def rocked(side: str, q: Array, turns: Array) -> Array:
    """What boards on these bones would tell."""
    out = q.copy()
    for segment, joint, share in ROCKS:
        k, j = SEGMENTS.index(segment), joint_index(joint)
        x = np.array([1.0, 0.0, 0.0])
        axis = x if j == k else so3.rotate(nominal_skeleton(side).q_parent_rest[j], x)
        out[:, k] = so3.multiply(out[:, k], so3.exp(share * turns[:, j, :1] * axis))
    return out


@sides
def test_boards_that_rock_are_steadied(side):
    turns = anyhow()
    q = bones(side, turns)
    told = rocked(side, q, turns)
    left = so3.angle_between(taken_off(skin_of(ROCKS), nominal_skeleton(side), told), q)
    before = so3.angle_between(told, q)
    assert np.rad2deg(before.max()) > 4.0
    assert left.max() < 0.15 * before.max()  # shares of shares


@sides
def test_a_forearm_that_lags_behind_is_turned_by_the_hand(side):
    turns = anyhow(1)
    turns[:, HAND, 0] *= 0.5
    q = bones(side, turns)
    lag = np.linspace(-0.2, 0.2, len(q))
    told = q.copy()
    told[:, FOREARM] = so3.multiply(q[:, FOREARM], so3.exp(lag[:, None] * [0.0, 1.0, 0.0]))
    got = taken_off(skin_of([], by_hand=True), nominal_skeleton(side), told)
    left = so3.angle_between(got[:, FOREARM], q[:, FOREARM])
    # the forearm's own board is believed too
    own = (WRIST_RAD / LAG_RAD) ** 2 / np.cos(turns[:, HAND, 0]) ** 2
    assert (left < (1.3 * own / (1.0 + own) + 0.02) * np.abs(lag) + 1e-9).all()
    np.testing.assert_array_equal(np.delete(got, FOREARM, 1), np.delete(told, FOREARM, 1))


def test_a_wrist_bent_square_tells_nothing_of_the_forearm():
    turns = np.zeros((1, len(SEGMENTS), 3))
    turns[0, HAND] = -0.5 * np.pi, 0.3, 0.0
    q = bones("right", turns)
    got = taken_off(skin_of([], by_hand=True), nominal_skeleton("right"), q)
    assert so3.angle_between(got, q).max() < 1e-6


@sides
def test_what_lies_true_stays(side):
    q = bones(side, anyhow(2))
    got = taken_off(skin_of([], by_hand=True), nominal_skeleton(side), q)
    assert so3.angle_between(got, q).max() < 1e-6


def test_a_hand_that_is_not_known_tells_nothing():
    q = bones("right", anyhow(3, 2))
    q[:, HAND] = np.nan
    got = taken_off(skin_of(ROCKS, by_hand=True), nominal_skeleton("right"), q)
    np.testing.assert_allclose(got[:, FOREARM], q[:, FOREARM], atol=1e-15)


def test_every_instant_is_for_itself():
    q, skin = rocked("right", bones("right", anyhow(4)), anyhow(4)), skin_of(ROCKS, by_hand=True)
    whole = taken_off(skin, nominal_skeleton("right"), q)
    for i in (0, 17, 29):
        alone = taken_off(skin, nominal_skeleton("right"), q[i : i + 1])
        np.testing.assert_array_equal(alone[0], whole[i])


def test_angles_of_steadied_boards_are_those_of_the_bones():
    turns = anyhow(5)
    q, skeleton = bones("right", turns), nominal_skeleton("right")
    start = np.tile(so3.IDENTITY, (len(q), 1))
    told = rocked("right", q, turns)
    off = [
        np.abs(joint_turns(skeleton, one, start) - turns).max()
        for one in (told, taken_off(skin_of(ROCKS), skeleton, told))
    ]
    assert off[1] < 0.2 * off[0]

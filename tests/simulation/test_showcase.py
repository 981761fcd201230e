from itertools import pairwise

import numpy as np
import pytest

from handstudio.hand.angles import hand_angles
from handstudio.hand.skeleton import FINGERS, SEGMENTS
from handstudio.layout import glove
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.postures import scripted
from handstudio.simulation.rig import Truth, signals
from handstudio.simulation.subject import ideal_subject

NAMES = [angle.name for angle in hand_angles()]
EVERY_US = 20_000
# normal active ranges [deg], hand/CONVENTIONS.md; the forearm starts pronated, palm down
RANGES = {
    "elbow_flexion": (0, 145),
    "forearm_pronation": (-160, 0),
    "wrist_flexion": (-70, 80),
    "wrist_deviation_ulnar": (-20, 30),
    "mcp_flexion": (-45, 90),
    "mcp_abduction": (-20, 20),
    "mcp_deviation_ulnar": (-20, 20),
    "pip_flexion": (0, 100),
    "dip_flexion": (0, 80),
    "thumb_cmc_flexion": (-20, 15),
    "thumb_cmc_abduction": (0, 70),
    "thumb_cmc_rotation": (0, 0),
    "thumb_mcp_flexion": (0, 50),
    "thumb_ip_flexion": (-20, 80),
    "ulnar_cmc_flexion": (0, 0),
}


@pytest.fixture(scope="module", params=["right", "left"])
def shown(request) -> Truth:
    side = request.param
    time_us = np.arange(0, int(showcase(side).duration_s * 1e6), EVERY_US)
    return signals(ideal_subject(side), glove(side), showcase(side), time_us)[1]


def degrees(shown: Truth, name: str) -> np.ndarray:
    return np.rad2deg(shown.angles[:, NAMES.index(name)])


def distance(shown: Truth, tip: str, other: str) -> np.ndarray:
    a, b = (shown.t_world_tip[:, FINGERS.index(finger)] for finger in (tip, other))
    return np.linalg.norm(a - b, axis=-1)


def bones(shown: Truth, fingers: tuple[str, ...]) -> np.ndarray:
    """Points along all phalanges of these fingers, (n, points, 3)."""
    points = []
    for finger in fingers:
        names = ["proximal", *(["intermediate"] if finger != "thumb" else []), "distal"]
        ends = [shown.t_world_joint[:, SEGMENTS.index(f"{finger}_{name}")] for name in names]
        ends.append(shown.t_world_tip[:, FINGERS.index(finger)])
        for start, end in pairwise(ends):
            points += [start + share * (end - start) for share in np.linspace(0.0, 1.0, 8)]
    return np.stack(points, axis=1)


def test_it_lasts_about_forty_seconds_and_loops_at_rest(shown):
    assert 35.0 < showcase("right").duration_s < 45.0
    assert showcase("right").periodic
    still = np.arange(0, 2_500_000, EVERY_US) // EVERY_US
    np.testing.assert_allclose(shown.angles[still], 0.0, atol=1e-12)
    np.testing.assert_allclose(shown.angles[-1], 0.0, atol=1e-12)


def test_nobody_is_hurt(shown):
    for name in NAMES:
        least, most = RANGES.get(name) or RANGES[name.split("_", 1)[1]]
        values = degrees(shown, name)
        assert least - 1e-9 <= values.min(), name
        assert values.max() <= most + 1e-9, name


def test_joints_turn_at_a_human_pace():
    motion = showcase("right").at(np.arange(0.0, 40.0, 0.002))
    assert np.rad2deg(np.abs(motion.rates).max()) < 500.0


def test_everything_moves_that_should(shown):
    for name in RANGES.keys() & set(NAMES) - {"thumb_cmc_rotation", "ulnar_cmc_flexion"}:
        assert np.ptp(degrees(shown, name)) > 10.0, name
    for finger in FINGERS[1:]:
        assert degrees(shown, f"{finger}_mcp_flexion").max() > 75.0


def test_the_last_joint_follows_the_one_before(shown):
    for finger in FINGERS[1:]:
        pip, dip = (degrees(shown, f"{finger}_{joint}_flexion") for joint in ("pip", "dip"))
        np.testing.assert_allclose(dip, 0.6 * pip, atol=1e-9)


def test_the_fist_closes_twice_with_the_thumb_outside(shown):
    closed = degrees(shown, "middle_pip_flexion") > 94.0
    assert np.count_nonzero(np.diff(closed.astype(int)) == 1) == 2
    palm = shown.t_world_joint[:, SEGMENTS.index("middle_proximal")]
    middle = np.linalg.norm(shown.t_world_tip[:, 2] - palm, axis=-1)
    assert middle[closed].max() < 0.06  # the fingertip is in the palm
    folded = closed & (degrees(shown, "thumb_ip_flexion") > 60.0)
    over = shown.t_world_joint[:, SEGMENTS.index("index_distal")]
    thumb = np.linalg.norm(shown.t_world_tip[:, 0] - over, axis=-1)
    assert folded.any()
    assert thumb[folded].max() < 0.03


def test_the_pinch_brings_thumb_and_index_together(shown):
    assert distance(shown, "thumb", "index").min() < 0.015


def test_the_thumb_passes_no_finger(shown):
    apart = bones(shown, FINGERS[1:])[:, None] - bones(shown, ("thumb",))[:, :, None]
    assert np.linalg.norm(apart, axis=-1).min() > 0.0085


def test_an_angle_that_no_hand_has_is_refused():
    with pytest.raises(ValueError, match="index_ip_flexion"):
        scripted([(1.0, {"index_ip_flexion": 10.0})], "right")

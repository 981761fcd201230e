"""Real hands on virtual ones: from places come the angles that they were made with."""

from dataclasses import replace

import numpy as np
import pytest

from handstudio.errors import SetupError
from handstudio.hand.skeleton import FINGERS, SEGMENTS
from handstudio.maths import so3
from handstudio.simulation.motions.actor import Actor, HandRecording, Material
from handstudio.simulation.motions.language import perform
from handstudio.simulation.motions.reach import acted, bent, raised, reach
from handstudio.simulation.motions.recorded import recorded_angles, replayed
from handstudio.simulation.postures import channel_of, channels, thumb
from handstudio.simulation.rig import hand_at
from handstudio.simulation.subject import ideal_subject, subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.world import World

AHEAD = World(heading_rad=0.5 * np.pi)
NAMES = (
    *("elbow_flexion", "forearm_pronation", "wrist_flexion", "wrist_deviation_ulnar"),
    *("thumb_cmc_flexion", "thumb_cmc_abduction", "thumb_mcp_flexion", "thumb_ip_flexion"),
    *(
        f"{f}_{j}"
        for f in FINGERS[1:]
        for j in ("mcp_flexion", "mcp_abduction", "pip_flexion", "dip_flexion")
    ),
)

sides = pytest.mark.parametrize("side", ["right", "left"])


def moved(side: str) -> Trajectory:
    """Fingers, thumb, wrist and forearm of an ideal hand."""
    actor = Actor(ideal_subject(side), 3)
    ease = raised(actor.subject)
    closed = ease | bent(actor.subject, 60.0, 70.0) | thumb(12.0, 30.0, 30.0, 40.0)
    spread = ease | bent(actor.subject, 5.0, 10.0, 10.0)
    turned = ease | {"forearm_pronation": -60.0}
    bowed = ease | {"wrist_flexion": 22.0, "wrist_deviation_ulnar": 12.0}
    steps = [(0.8, p) for p in (closed, spread, turned, bowed, ease)]
    return acted(actor, "moved", ease, steps)


def recording(side: str, every_s: float = 1.0 / 110.0) -> HandRecording:
    part, who = moved(side), ideal_subject(side)
    time_s = np.arange(0.0, part.duration_s, every_s)
    _, at = hand_at(who, part, time_s, AHEAD)
    joints = np.full((len(time_s), 5, 5, 3), np.nan)
    for index, finger in enumerate(FINGERS):
        bones = ["metacarpal", "proximal"] if finger == "thumb" else ["proximal", "intermediate"]
        places = (0, 1, 2) if finger == "thumb" else (1, 2, 3)
        for place, bone in zip(places, [*bones, "distal"], strict=True):
            joints[:, index, place] = at.t[:, SEGMENTS.index(f"{finger}_{bone}")]
        distal = at[:, SEGMENTS.index(f"{finger}_distal")]
        joints[:, index, 4] = distal.t + so3.rotate(distal.q, who.skeleton.t_distal_tip[index])
    palm = so3.to_matrix(at.q[:, SEGMENTS.index("hand")])
    return HandRecording(side, time_s, joints, palm)


def named(part: Trajectory, time_s: np.ndarray, side: str) -> dict[str, np.ndarray]:
    posture = part.posture(time_s)
    return {n: posture[:, channel_of(n)] / channels({n: 1.0}, side)[channel_of(n)] for n in NAMES}


def lag_free_error(a: Trajectory, b: Trajectory, a_side: str, b_side: str) -> dict[str, float]:
    """Largest differences [deg]; the replay has half a second of run-up."""
    time_s = np.arange(0.1, a.duration_s - 0.1, 0.01)
    one, other = named(a, time_s, a_side), named(b, time_s + 0.5, b_side)
    return {name: float(np.abs(one[name] - other[name]).max()) for name in NAMES}


@sides
@pytest.mark.parametrize("on", ["right", "left"])
def test_a_hand_that_is_played_back_turns_its_joints_as_it_did(side, on):
    part = replayed(recording(side), Actor(ideal_subject(on)))
    errors = lag_free_error(moved(side), part, side, on)
    # how palm and forearm share the wrist's way is not recorded
    free = ("elbow_flexion", "wrist_flexion", "wrist_deviation_ulnar", "forearm_pronation")
    assert max(e for name, e in errors.items() if name not in free) < 2.0, errors


@sides
def test_the_palm_ends_up_where_it_was(side):
    part, time_s = replayed(recording(side), Actor(ideal_subject(side))), np.arange(0.2, 3.5, 0.05)
    hand = SEGMENTS.index("hand")
    was = hand_at(ideal_subject(side), moved(side), time_s, AHEAD)[1].q[:, hand]
    now = hand_at(ideal_subject(side), part, time_s + 0.5, AHEAD)[1].q[:, hand]
    apart = so3.log(so3.multiply(so3.conjugate(was), now))
    assert np.rad2deg(np.linalg.norm(apart, axis=-1)).max() < 3.0


def test_faults_and_gaps_of_the_recorder_are_bridged():
    whole = recording("right")
    rng = np.random.default_rng(4)
    joints = whole.joints_m.copy()
    wrong = rng.choice(len(joints), 12, replace=False)
    joints[wrong, 1, 3] += rng.normal(0.0, 0.03, (12, 3))  # a fingertip here and there
    joints[rng.choice(len(joints), 5, replace=False), 2] = np.nan
    there = np.ones(len(joints), dtype=bool)
    there[120:128] = False  # and 70 ms of nothing
    broken = HandRecording("right", whole.time_s[there], joints[there], whole.palm[there])
    part = replayed(broken, Actor(ideal_subject()))
    errors = lag_free_error(moved("right"), part, "right", "right")
    assert errors["index_dip_flexion"] < 6.0
    assert errors["middle_pip_flexion"] < 3.0
    assert errors["ring_mcp_flexion"] < 3.0


def test_shaking_that_no_hand_does_is_taken_out():
    whole = recording("right")
    rng = np.random.default_rng(5)
    noisy = replace(whole, joints_m=whole.joints_m + rng.normal(0.0, 0.0004, whole.joints_m.shape))
    part = replayed(noisy, Actor(ideal_subject()))
    raw = np.rad2deg(recorded_angles(noisy)["index_pip_flexion"])
    time_s = np.arange(0.6, part.duration_s - 0.6, 0.01)
    replayed_rates = np.rad2deg(np.abs(part.derivatives(time_s)[1][:, :-3]).max())
    raw_rates = np.abs(np.diff(raw) * 110.0).max()
    assert replayed_rates < 0.75 * raw_rates


@sides
@pytest.mark.parametrize("number", [0, 3, 104])
def test_a_recorded_hand_stays_within_the_subjects_range(number, side):
    wild = recording("right")
    # everything half as far again from the palm's plane: no subject bends like this
    joints = wild.joints_m.copy()
    joints[:, 1:, 2:] += 0.8 * (joints[:, 1:, 2:] - joints[:, 1:, 1:2]) * [1.0, 0.3, 1.0]
    who = subject(number, side)
    part = replayed(replace(wild, joints_m=joints), Actor(who))
    for name, values in named(part, np.arange(0.0, part.duration_s, 0.01), side).items():
        low, high = reach(who, name)
        assert low - 5.0 < values.min(), name
        assert values.max() < high + 5.0, name


def test_it_begins_and_ends_at_rest():
    part = replayed(recording("right"), Actor(subject(3)))
    _, *ends = part.derivatives(np.array([0.0, part.duration_s]))
    np.testing.assert_allclose(ends, 0.0, atol=1e-6)
    inner = part.breaks_s[1:-1]
    before, after = (part.derivatives(inner + e) for e in (-1e-9, 1e-9))
    for left, right, allowed in zip(before, after, (1e-6, 1e-5, 1e-3), strict=True):
        np.testing.assert_allclose(left, right, atol=allowed * max(1.0, np.abs(right).max()))


def test_a_recording_is_asked_for_by_its_name():
    material = Material(recordings={"wave": lambda: recording("right")})
    part = perform("recorded:wave", Actor(subject(3), material=material))
    assert [span.name for span in part.spans] == ["work"]
    with pytest.raises(SetupError, match="There is no recording of a hand called 'pinch'") as told:
        perform("recorded:pinch", Actor(subject(3), material=material))
    assert "wave" in told.value.remedy
    with pytest.raises(SetupError, match="There are no recordings of hands"):
        perform("recorded", Actor(subject(3)))


def test_a_recording_of_nothing_is_refused():
    whole = recording("right")
    short = HandRecording("right", whole.time_s[:5], whole.joints_m[:5], whole.palm[:5])
    with pytest.raises(SetupError, match="has 5 instants: too few"):
        replayed(short, Actor(subject(3)))
    joints = whole.joints_m.copy()
    joints[:, 2] = np.nan
    with pytest.raises(SetupError, match="has nothing of middle_mcp_flexion"):
        replayed(replace(whole, joints_m=joints), Actor(subject(3)))

"""What virtual subjects do is what it is called, and what a person could do."""

from functools import cache

import numpy as np
import pytest

from handstudio.errors import SetupError
from handstudio.hand.skeleton import DISTALS, FINGERS, JOINTS, SEGMENTS
from handstudio.layout import glove
from handstudio.maths import so3
from handstudio.simulation.motions.actor import Actor
from handstudio.simulation.motions.calibration import CALIBRATION
from handstudio.simulation.motions.chores import CHORES
from handstudio.simulation.motions.exercises import EXERCISES
from handstudio.simulation.motions.language import perform
from handstudio.simulation.motions.reach import reach
from handstudio.simulation.motions.trials import JOINT_TRIALS
from handstudio.simulation.moving import Moving
from handstudio.simulation.postures import channel_of, channels
from handstudio.simulation.rig import hand_at, signals
from handstudio.simulation.subject import Subject, subject
from handstudio.simulation.trajectory import Trajectory
from handstudio.simulation.world import World

ALL = (*CALIBRATION, *EXERCISES, *CHORES)
SINGLE = [motion.name for motion in ALL if not motion.of]
TRIALS = [trial.name for trial in JOINT_TRIALS]
AHEAD = World(heading_rad=0.5 * np.pi)  # the forearm starts along y of the world

ANGLES = (
    *(f"{j.name}_flexion" for j in JOINTS),
    *(f"{finger}_mcp_abduction" for finger in FINGERS),
    *("elbow_rotation", "forearm_pronation", "wrist_deviation_ulnar"),
    *("thumb_cmc_abduction", "thumb_cmc_rotation"),
)
SIGNS = {
    side: {n: channels({n: 1.0}, side)[channel_of(n)] for n in ANGLES} for side in ("right", "left")
}
# Fastest [deg/s]. Joints of people reach more in sports than here: an elbow over 2000 in pitching;
# what is asked is that calm motions stay calm. The others are chores.
FASTEST = {
    "ball_throw": 900.0,
    "spinning_top": 1400.0,
    "typing": 700.0,
    "tissue": 700.0,
    "open_close": 700.0,
}
CALM = 600.0

everyone = pytest.mark.parametrize("number", [0, 3, 8, 104])
sides = pytest.mark.parametrize("side", ["right", "left"])
single = pytest.mark.parametrize("name", SINGLE)
trials = pytest.mark.parametrize("name", TRIALS)


@cache
def someone(number: int, side: str = "right") -> Subject:
    return subject(number, side)


@cache
def done(text: str, number: int = 3, side: str = "right", seed: int = 5) -> Trajectory:
    return perform(text, Actor(someone(number, side), seed))


def angles(part: Trajectory, side: str = "right", step_s: float = 0.01) -> dict[str, np.ndarray]:
    """Every named angle [deg] over a motion."""
    posture = part.posture(np.arange(0.0, part.duration_s + step_s, step_s))
    return {name: posture[:, channel_of(name)] / sign for name, sign in SIGNS[side].items()}


def within_range(part: Trajectory, who: Subject, but: tuple[str, ...] = ()) -> dict[str, float]:
    """By how much [deg] angles go beyond the subject's range by more than 5 deg."""
    beyond = {}
    for name, values in angles(part, who.side).items():
        low, high = reach(who, name)
        over = max(low - values.min(), values.max() - high)
        if over > 5.0 and name not in but:
            beyond[name] = over
    return beyond


def segments(part: Trajectory, time_s: np.ndarray, who: Subject) -> Moving:
    return hand_at(who, part, time_s, AHEAD)[1]


def tips(part: Trajectory, time_s: np.ndarray, who: Subject) -> np.ndarray:
    distal = segments(part, time_s, who)[:, [SEGMENTS.index(name) for name in DISTALS]]
    return distal.t + so3.rotate(distal.q, who.skeleton.t_distal_tip)


def spans(part: Trajectory) -> list[tuple[str, float, float]]:
    return [(span.name, span.start_s, span.end_s) for span in part.spans]


@single
@sides
def test_it_begins_and_ends_at_rest_and_nothing_jumps(name, side):
    part = done(name, side=side)
    _, *ends = part.derivatives(np.array([0.0, part.duration_s]))
    np.testing.assert_allclose(ends, 0.0, atol=1e-6)
    inner = part.breaks_s[1:-1]
    before, after = (part.derivatives(inner + e) for e in (-1e-9, 1e-9))
    hardest = np.abs(part.derivatives(np.arange(0.0, part.duration_s, 0.01))[2]).max()
    for left, right, allowed in zip(before, after, (1e-6, 1e-5, 1e-4), strict=True):
        np.testing.assert_allclose(left, right, atol=allowed * max(1.0, hardest))


@single
@sides
@everyone
def test_no_joint_goes_beyond_its_range(name, side, number):
    # in a tumble the whole body turns, not only the elbow
    but = ("elbow_flexion", "forearm_pronation", "elbow_rotation") if name == "tumble" else ()
    assert within_range(done(name, number, side), someone(number, side), but) == {}


def test_the_measure_of_ranges_sees_what_is_beyond():
    part, who = done("index_mcp:flexion~fast", 0), someone(0)
    wild = Trajectory(part.breaks_s, 2.0 * part.coefficients)
    assert "index_mcp_flexion" in within_range(wild, who)


@single
def test_joints_turn_at_a_human_pace(name):
    part = done(name)
    rates = part.derivatives(np.arange(0.0, part.duration_s, 0.002))[1]
    fastest = np.rad2deg(np.abs(rates[:, :-3]).max())
    assert fastest < FASTEST.get(name, CALM)


@single
def test_a_seed_is_a_performance(name):
    who = someone(3)
    again = perform(name, Actor(who, 5))
    np.testing.assert_array_equal(again.coefficients, done(name).coefficients)
    np.testing.assert_array_equal(again.breaks_s, done(name).breaks_s)
    if name not in ("static", "flat_hand", "rest"):  # nothing is to be done there
        other = perform(name, Actor(who, 6))
        assert other.coefficients.shape != again.coefficients.shape or np.any(
            other.coefficients != again.coefficients
        )


@trials
@sides
@everyone
def test_the_joint_of_a_trial_moves_most_and_the_others_hardly(name, side, number):
    trial = JOINT_TRIALS[TRIALS.index(name)]
    moved = {n: np.ptp(v) for n, v in angles(done(name, number, side), side).items()}
    assert max(moved, key=lambda n: moved[n]) == trial.angle
    coupled = {trial.angle, f"{trial.follower}_dip_flexion", *trial.along}
    others = {n: size for n, size in moved.items() if n not in coupled}
    assert max(others.values()) < 3.0, others


@trials
def test_a_trial_is_two_seconds_still_and_eight_of_swinging_both_ways(name):
    part, trial = done(name), JOINT_TRIALS[TRIALS.index(name)]
    assert spans(part) == [("static", 0.0, 2.0), (name, 2.0, 10.0)]
    values = angles(part)[trial.angle]
    np.testing.assert_array_equal(values[:200], values[0])
    middle = 0.5 * (values.max() + values.min())
    through = np.count_nonzero(np.diff(np.sign(values[200:] - middle)))
    assert 8 <= through <= 24  # 0.5 to 1.5 times a second to and fro


def test_no_swing_is_like_another():
    values = angles(done("index_mcp:flexion"))["index_mcp_flexion"][200:]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(values)))) + 1
    far, when = values[turns], turns * 0.01
    assert np.std(far[far > 30.0]) > 1.0
    assert np.std(np.diff(when)) > 0.02


@everyone
@pytest.mark.parametrize("finger", FINGERS[1:])
def test_the_last_joint_follows_the_one_before_as_the_subjects_does(finger, number):
    named = angles(done(f"{finger}_pip:flexion", number))
    pip, dip = named[f"{finger}_pip_flexion"], named[f"{finger}_dip_flexion"]
    ratio = float(someone(number).dip_per_pip[FINGERS.index(finger) - 1])
    below = ratio * pip < reach(someone(number), f"{finger}_dip_flexion")[1] - 5.0
    slope = np.polyfit(pip[below], dip[below], 1)[0]
    assert slope == pytest.approx(ratio, abs=0.05)


@trials
def test_nothing_hits_the_table_in_a_trial(name):
    part, who = done(name), someone(3)
    time_s = np.arange(0.0, 10.0, 0.05)
    assert tips(part, time_s, who)[..., 2].min() > 0.01
    assert segments(part, time_s, who).t[..., 2].min() > -1e-9


@sides
def test_all_sensors_share_the_turn_of_the_heading_rotation(side):
    who = someone(3, side)
    omega = segments(done("heading_rotation", 3, side), np.arange(0.0, 2.0, 0.01), who).omega
    np.testing.assert_allclose(omega, np.broadcast_to(omega[:, :1], omega.shape), atol=1e-9)
    fastest = omega[np.argmax(np.linalg.norm(omega[:, 0], axis=-1)), 0]
    assert np.rad2deg(np.linalg.norm(fastest)) > 60.0
    assert abs(fastest[2]) < 0.2 * np.linalg.norm(fastest)  # roughly horizontal


@sides
def test_the_shoulder_turns_the_forearm_about_the_upper_arm(side):
    who = someone(0, side)
    forearm = segments(done("elbow:rotation", 0, side), np.arange(2.0, 10.0, 0.02), who)[:, 0]
    fast = np.linalg.norm(forearm.omega, axis=-1) > 1.0
    axis = forearm.omega[fast] / np.linalg.norm(forearm.omega[fast], axis=-1, keepdims=True)
    assert np.abs(axis[:, 1]).min() > 0.98  # the upper arm lies along the start's y
    along = so3.rotate(forearm.q, np.array([0.0, 1.0, 0.0]))
    assert np.abs(along[:, 1]).max() < 0.1  # and the forearm stays square to it


def test_a_tumble_rests_in_directions_all_around():
    part, who = done("tumble"), someone(3)
    time_s = np.arange(0.0, part.duration_s, 0.05)
    hand = segments(part, time_s, who)[:, SEGMENTS.index("hand")]
    still = np.linalg.norm(hand.omega, axis=-1) < 1e-9
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    rests = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 30]
    assert len(rests) >= 18
    up = np.array(
        [so3.rotate(so3.conjugate(hand.q[a]), np.array([0.0, 0.0, 1.0])) for a, _ in rests]
    )
    signs = np.array(np.meshgrid(*[[-1, 0, 1]] * 3)).reshape(3, -1).T
    corners = signs[np.any(signs != 0, axis=1)]
    corners = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    assert np.rad2deg(np.arccos((corners @ up.T).max(axis=1))).max() < 45.0
    omega = np.rad2deg(np.linalg.norm(hand.omega, axis=-1))
    assert omega.max() < 400.0


def test_a_calibration_is_its_parts_in_their_order():
    names = [name for name, *_ in spans(done("calibration"))]
    labels = [name for name in names if name != "static"]
    assert labels == ["heading_rotation", *TRIALS, "flat_hand", "work"]
    # one before and one after the heading rotation, and one a trial
    assert names.count("static") == 2 + len(TRIALS)
    assert TRIALS[:3] == ["elbow:flexion", "elbow:rotation", "wrist:flexion"]


@pytest.mark.parametrize(("number", "near_m"), [(0, 0.015), (3, 0.03), (8, 0.03), (104, 0.03)])
def test_the_tryout_brings_the_thumb_to_every_fingertip(number, near_m):
    part, who = done("tryout", number), someone(number)
    at = tips(part, np.arange(0.0, part.duration_s, 0.02), who)
    apart = np.linalg.norm(at[:, 1:] - at[:, :1], axis=-1)
    nearest = apart.min(axis=0)
    assert nearest.max() < near_m
    assert np.all(np.diff(np.argmin(apart, axis=0)) > 0)  # index to little, in turn


@pytest.mark.parametrize("seconds", [15.0, 30.0])
def test_the_index_finger_of_the_thesis_takes_as_long_as_it_says(seconds):
    part = done(f"thesis_index:{seconds:g}")
    assert part.duration_s == pytest.approx(seconds, abs=1e-3)
    assert [name for name, *_ in spans(part)] == ["static", "heading_rotation", "work"]
    named = angles(part)
    for name in ("elbow", "wrist", "index_mcp", "index_pip", "index_dip"):
        assert np.ptp(named[f"{name}_flexion"]) > 30.0
    assert np.ptp(named["middle_mcp_flexion"][500:]) < 0.01


@pytest.mark.parametrize("axis", ["up", "north", "west", "all", ""])
def test_the_elbow_swings_by_some_centimetres_at_some_tenths_of_g(axis):
    part = done(f"elbow_moving:{axis}" if axis else "elbow_moving", seed=8)
    place, _, acceleration = part.at(np.arange(0.0, part.duration_s, 0.01)).elbow
    moves = [axis in ("", "all", name) for name in ("north", "west", "up")]
    travel = np.ptp(place, axis=0)
    np.testing.assert_array_equal(travel > 0.0, moves)
    assert np.all((travel[moves] > 0.05) & (travel[moves] < 0.15))
    assert 0.08 < np.linalg.norm(acceleration, axis=-1).max() / 9.81 < 0.45
    assert place[:, 2].min() > -1e-4  # the table is below


def test_the_elbow_waits_if_it_is_told_to():
    part = done("thesis_index&elbow_moving:up 11 4")
    assert part.duration_s == pytest.approx(15.0)
    place = part.at(np.arange(0.0, 15.0, 0.01)).elbow[0]
    np.testing.assert_array_equal(place[:400], 0.0)
    assert np.ptp(place[400:, 2]) > 0.05


@pytest.mark.parametrize(
    ("name", "least", "most"), [("ball_throw", 800.0, 1900.0), ("spinning_top", 1200.0, 3000.0)]
)
def test_fingers_turn_by_more_than_a_thousand_degrees_a_second(name, least, most):
    part, who = done(name), someone(3)
    moving = segments(part, np.arange(0.0, part.duration_s, 0.005), who)
    omega = moving.omega[:, SEGMENTS.index("index_distal")]
    assert least < np.rad2deg(np.linalg.norm(omega, axis=-1).max()) < most


def test_who_rests_is_almost_still():
    part = done("resting:60")
    assert part.duration_s == pytest.approx(60.0)
    assert part.spans == ()
    moved = [np.ptp(values) for values in angles(part).values()]
    assert 0.3 < max(moved) < 3.0
    rates = np.rad2deg(np.abs(part.derivatives(np.arange(0.0, 60.0, 0.05))[1][:, :-3]))
    assert 0.0 < rates.max() < 1.5


def test_work_is_labelled_so():
    for motion in (*EXERCISES, *CHORES):
        names = [name for name, *_ in spans(done(motion.name))]
        assert ("work" in names) == (motion.name != "resting")


@pytest.mark.parametrize(
    "text", ["rest:soon", "rest:-1", "rest:0", "rest:1e9", "rest:nan", "thesis_index:5"]
)
def test_a_time_that_makes_no_sense_is_refused(text):
    with pytest.raises(SetupError, match="is no time that this motion can take"):
        done(text)


@pytest.mark.parametrize("text", ["elbow_moving:down", "elbow_moving:up 11 4 9"])
def test_an_elbow_that_cannot_move_so_is_refused(text):
    with pytest.raises(SetupError, match="The elbow cannot move"):
        done(text)


@everyone
@pytest.mark.parametrize(
    ("sensor", "child", "asked"),
    [
        ("SN1", "forearm", ("elbow:flexion", "elbow:rotation")),
        ("SN11", "hand", ("wrist:flexion", "wrist:deviation")),
        ("SN15", "index_proximal", ("index_mcp:flexion", "index_mcp:abduction")),
        ("SN18", "thumb_metacarpal", ("thumb_cmc:flexion", "thumb_cmc:abduction")),
    ],
)
def test_two_trials_of_a_joint_tell_where_it_is(sensor, child, asked, number):
    """By what a sensor feels of turning about a fixed centre: a = (dw x + w x w x) P."""
    matrices, felt, where = [], [], []
    for text in asked:
        time_us = np.arange(2_000_000, 10_000_000, 10_000)
        samples, truth = signals(someone(number), glove("right"), done(text, number), time_us)
        index = glove("right").names.index(sensor)
        omega, q_sensor_world = samples.gyr[:, index], so3.conjugate(truth.q_world_sensor[:, index])
        gravity = so3.rotate(q_sensor_world, np.array([0.0, 0.0, AHEAD.gravity_mps2]))
        turning = crossing(np.gradient(omega, 0.01, axis=0)) + crossing(omega) @ crossing(omega)
        matrices.append(turning[2:-2].reshape(-1, 3))
        felt.append((samples.acc[:, index] - gravity)[2:-2].ravel())
        arm = truth.t_world_sensor[:, index] - truth.t_world_joint[:, SEGMENTS.index(child)]
        where.append(so3.rotate(q_sensor_world, arm).mean(axis=0))
    found = np.linalg.lstsq(np.concatenate(matrices), np.concatenate(felt), rcond=None)[0]
    # two axes of a real joint need not meet, and a finger is not moved alone: some millimetres
    assert np.linalg.norm(found - np.mean(where, axis=0)) < (0.002 if number == 0 else 0.006)


def crossing(vectors: np.ndarray) -> np.ndarray:
    """Matrices of the cross product from the left."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)

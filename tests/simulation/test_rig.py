"""The signals against differences of the truth, and against physics at rest."""

import numpy as np
import pytest

from handstudio.errors import LayoutError
from handstudio.hand.angles import joint_angles
from handstudio.hand.skeleton import SEGMENTS, nominal_skeleton
from handstudio.layout import JointPlace, Layout, SensorPlace, glove
from handstudio.maths import so3
from handstudio.samples import STANDARD_GRAVITY
from handstudio.simulation.motions.showcase import showcase
from handstudio.simulation.mounting import Mounting, nominal_mounting
from handstudio.simulation.rig import signals
from handstudio.simulation.subject import ideal_subject, subject
from handstudio.simulation.trajectory import CHANNELS, Trajectory, through_stops
from handstudio.simulation.world import World

STEP_US = 1000
# central differences of order 8, of the instants from -4 to 4
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])

sides = pytest.mark.parametrize("side", ["right", "left"])
people = pytest.mark.parametrize("number", [0, 3, 8])


def thrashing() -> Trajectory:
    """All 54 turns at once, faster than a hand."""
    postures = np.random.default_rng(2).uniform(-1.2, 1.2, size=(4, CHANNELS))
    postures[0] = 0.0
    return through_stops(np.array([0.0, 0.6, 1.2, 1.8]), postures)


def crooked(side: str) -> Mounting:
    """Every sensor turned and shifted at random."""
    rng = np.random.default_rng(3)
    nominal = nominal_mounting(glove(side), nominal_skeleton(side))
    q = so3.normalize(rng.normal(size=nominal.q_segment_sensor.shape))
    t = nominal.t_segment_sensor
    return Mounting(q, t + 0.01 * rng.normal(size=t.shape))


def differences(values: np.ndarray, stencil: np.ndarray, order: int) -> np.ndarray:
    n = len(values) - 8
    step_s = STEP_US * 1e-6
    return sum(c * values[k : k + n] for k, c in enumerate(stencil)) / step_s**order


def within_one_blend() -> np.ndarray:
    return np.arange(610_000, 1_190_000, STEP_US)


@sides
@people
def test_gyroscopes_read_what_their_orientations_turn(number, side):
    args = subject(number, side), glove(side), thrashing(), within_one_blend()
    samples, truth = signals(*args, mounting=crooked(side))
    q_sensor_world = so3.conjugate(truth.q_world_sensor[4:-4])
    rate = so3.multiply(q_sensor_world, differences(truth.q_world_sensor, FIRST, 1))
    expected = 2.0 * rate[..., 1:]
    error = np.abs(samples.gyr[4:-4] - expected).max()
    assert error < 1e-7 * np.abs(expected).max()


@sides
@people
def test_accelerometers_read_how_their_places_accelerate(number, side):
    args = subject(number, side), glove(side), thrashing(), within_one_blend()
    samples, truth = signals(*args, mounting=crooked(side))
    lift = differences(truth.t_world_sensor, SECOND, 2) + np.array([0.0, 0.0, STANDARD_GRAVITY])
    expected = so3.rotate(so3.conjugate(truth.q_world_sensor[4:-4]), lift)
    error = np.abs(samples.acc[4:-4] - expected).max()
    assert error < 1e-7 * np.abs(expected).max()


@sides
@pytest.mark.parametrize("heading_rad", [0.0, 0.6, -2.5])
def test_at_rest_the_start_reads_gravity_and_the_field(side, heading_rad):
    world = World(heading_rad=heading_rad)
    args = ideal_subject(side), glove(side), showcase(side), np.arange(0, 2_500_000, 10_000)
    samples, truth = signals(*args, world=world)
    np.testing.assert_array_equal(samples.gyr, 0.0)
    norms = np.linalg.norm(samples.acc, axis=-1)
    np.testing.assert_allclose(norms, STANDARD_GRAVITY, rtol=1e-14)
    forearm, field = slice(0, 3), world.field_ut
    upwards = np.broadcast_to([0.0, 0.0, STANDARD_GRAVITY], samples.acc[:, forearm].shape)
    np.testing.assert_allclose(samples.acc[:, forearm], upwards, atol=1e-14)
    back = so3.rotate(truth.q_world_sensor, samples.mag)
    np.testing.assert_allclose(back, np.broadcast_to(field, back.shape), atol=1e-13)
    along = so3.rotate(truth.q_world_segment[:, 0], np.array([0.0, 1.0, 0.0]))
    pointing = [np.cos(heading_rad), np.sin(heading_rad), 0.0]
    np.testing.assert_allclose(along, np.broadcast_to(pointing, along.shape), atol=1e-15)


@people
def test_a_left_hand_feels_the_mirror_image_of_a_right_one(number):
    time_us = np.arange(4_000_000, 39_000_000, 50_000)
    right, _ = signals(subject(number, "right"), glove("right"), showcase("right"), time_us)
    left, _ = signals(subject(number, "left"), glove("left"), showcase("left"), time_us)
    np.testing.assert_allclose(left.acc, right.acc * [-1.0, 1.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(left.gyr, right.gyr * [1.0, -1.0, -1.0], atol=1e-12)


@sides
def test_true_angles_are_what_the_attitudes_of_the_segments_say(side):
    someone, time_us = subject(5, side), np.arange(0, 40_000_000, 100_000)
    _, truth = signals(someone, glove(side), showcase(side), time_us)
    start = np.broadcast_to(World().q_world_start, (len(time_us), 4))
    angles = joint_angles(someone.skeleton, truth.q_world_segment, start)
    np.testing.assert_allclose(truth.angles, angles, atol=1e-12)


def test_an_instant_reads_the_same_alone_and_among_others():
    args = ideal_subject("right"), glove(), showcase("right")
    time_us = np.arange(5_000_000, 6_000_000, 10_000)
    samples, _ = signals(*args, time_us)
    alone, _ = signals(*args, time_us[37:38])
    assert samples[37:38] == alone


def test_nominal_sensors_sit_on_the_back_of_their_segments():
    skeleton = nominal_skeleton("right")
    mounting = nominal_mounting(glove(sensors=["SN1", "SN2", "SN3", "SN16", "Tip"]), skeleton)
    place = mounting.t_segment_sensor
    assert (place[:, 2] > 0.005).all()
    assert 0.0 < place[0, 1] < place[1, 1] < place[2, 1] < skeleton.length_m[0]
    lengths = dict(zip(SEGMENTS, skeleton.length_m, strict=True))
    assert place[3, 1] == pytest.approx(0.5 * lengths["index_intermediate"])
    assert place[4, 1] == pytest.approx(lengths["index_distal"])


def test_a_layout_that_is_no_hand_is_refused():
    joints = (JointPlace("hinge", "door", "frame", 1),)
    layout = Layout("unknown", (SensorPlace("A", "door"),), joints)
    with pytest.raises(LayoutError, match="A sits on door"):
        signals(ideal_subject("right"), layout, showcase("right"), np.arange(1))
